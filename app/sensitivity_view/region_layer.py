"""Regions over an image, edited with the mouse, and the label of values at a clicked place."""

from collections.abc import Callable, Sequence
from html import escape
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QCursor, QMouseEvent, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QGraphicsOpacityEffect, QHBoxLayout, QLabel, QWidget

from app import theme
from app.controls import CLICK_REACH, Card, Painted, fill
from app.icons import IconButton
from app.image_view.image_canvas import ImageCanvas, paint_plate
from app.placing import freest
from app.sensitivity_view.response_layer import STALE
from app.state.piece_finder import PieceFinder
from app.state.sensitivity_asker import SensitivityAsker
from app.state.sensitivity_state import SensitivityState, Tool
from model.rendering.pieces import Piece
from model.scene.region import Outline
from model.sensitivity.peaks import percentages

REACH = 8.0  # distance in pixels from which a corner or an edge reacts to the mouse
LASSO_STEP = 3.0  # least distance of a lasso's points, in pixels
LEAST_SIDE = 0.004  # least side of a new rectangle, as a fraction of the image
MARK = 7

HINTS: dict[Tool, str] = {
    "rectangle": "Drag a rectangle; Escape ends it",
    "lasso": "Draw around something; Escape ends it",
}
"""Instructions while a region is to be drawn."""

HINT_PLACE = QPointF(60, 60)  # their place on the canvas: below its caption, next to the tools


class RegionLayer(QObject):
    """Shows the regions over a canvas and edits the active one."""

    def __init__(
        self, canvas: ImageCanvas, asked: SensitivityState, clicked: Callable[[], object]
    ) -> None:
        super().__init__(canvas)
        self._canvas, self._state = canvas, asked
        self._clicked = clicked  # called before a click asks about its place
        self._pressed: QPointF | None = None
        self._moved = False
        self._grip: str | int | None = None
        self._start = Outline()
        self._lasso: list[QPointF] = []  # what is being drawn; a tool may be chosen in a drag
        self._tool: Tool | None = None
        self._place_before: tuple[float, float] | None = None
        canvas.setMouseTracking(True)
        canvas.decorations.append(self._paint)
        canvas.customContextMenuRequested.connect(lambda at: self._ask(at.toPointF()))
        canvas.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle mouse events on regions, and while a tool is chosen; pass on all others."""
        kind = event.type()
        if not self._state.choices.shown and self._state.tool is not None:
            return False
        if kind == QEvent.Type.MouseButtonPress:
            return self._press(cast("QMouseEvent", event))
        if kind == QEvent.Type.MouseMove:
            return self._move(cast("QMouseEvent", event).position())
        if kind == QEvent.Type.MouseButtonDblClick:
            # The first click does not count: a double click returns to the home view.
            self._state.pick(self._place_before)
            self._pressed = None
        if kind == QEvent.Type.MouseButtonRelease and self._pressed is not None:
            return self._release(cast("QMouseEvent", event).position())
        return False

    def refresh(self) -> None:
        """Show the regions and the tool's cursor; end a drag if sensitivities are hidden."""
        is_drag = self._grip is not None or self._state.tool is not None
        if not self._state.choices.shown and self._pressed is not None and is_drag:
            self._pressed, self._grip, self._lasso = None, None, []
            self._state.set_tool(None)
            self._state.finish("regions")
        if self._state.tool != self._tool:
            if self._lasso:
                # What is being drawn is dropped; the release is no click.
                self._pressed = None
            self._tool, self._lasso = self._state.tool, []
            self._show_cursor(self._tool)
        self._canvas.update()

    def _press(self, event: QMouseEvent) -> bool:
        if event.button() != Qt.MouseButton.LeftButton or event.modifiers():
            return False
        self._pressed, self._moved = event.position(), False
        self._place_before = self._state.place
        if self._state.tool is not None:
            self._lasso = [event.position()]
            return True
        self._grip = self._grip_at(event.position())
        self._start = self._state.outline
        return self._grip is not None

    def _move(self, position: QPointF) -> bool:
        if self._pressed is None:
            self._show_cursor(self._state.tool, self._grip_at(position))
            return False
        if (position - self._pressed).manhattanLength() > CLICK_REACH:
            self._moved = True
        if self._lasso:
            self._draw(position)
            return True
        if self._grip is None:
            return False
        (x0, y0), (x, y) = map(self._canvas.place_of, (self._pressed, position))
        if isinstance(self._grip, int):
            changed = _resized(self._start, self._grip, x, y)
        else:
            changed = self._start.moved(x - x0, y - y0)
        self._state.change_region(changed, self._canvas.reach)
        return True

    def _release(self, position: QPointF) -> bool:
        handled = bool(self._lasso) or self._grip is not None
        if self._lasso:
            self._finish_drawing(position)
        elif self._grip is not None:
            self._state.finish("regions")
        elif not (self._moved or self._canvas.gave_focus):
            self._ask(position)
        self._pressed, self._grip, self._lasso = None, None, []
        self._canvas.update()
        return handled

    def _ask(self, position: QPointF) -> None:
        place = self._canvas.place_of(position)
        self._clicked()
        self._state.pick(place if self._canvas.has_place(place) else None)

    def _draw(self, position: QPointF) -> None:
        if self._state.tool == "lasso":
            if (position - self._lasso[-1]).manhattanLength() >= LASSO_STEP:
                self._lasso.append(position)
        else:
            self._lasso = [self._lasso[0], position]
        self._canvas.update()

    def _finish_drawing(self, position: QPointF) -> None:
        outline = self._drawn_outline()
        self._state.set_tool(None)
        if outline is not None:
            self._state.add_region(outline)
            self._state.open_panel()
            self._state.finish("regions")
        self._show_cursor(None, self._grip_at(position))

    def _drawn_outline(self) -> Outline | None:
        """The outline that was drawn; None for a click."""
        places = [self._canvas.place_of(point) for point in self._lasso]
        xs, ys = [x for x, _ in places], [y for _, y in places]
        left, right, top, bottom = min(xs), max(xs), min(ys), max(ys)
        right_half, lower_half = self._canvas.reach
        aside = max(left - 0.5, 0.5 - right) >= right_half
        outside = aside or max(top - 0.5, 0.5 - bottom) >= lower_half
        if not self._moved or outside or max(right - left, bottom - top) < LEAST_SIDE:
            return None
        if self._state.tool == "rectangle" or len(places) < 3:
            return Outline.rectangle(left, top, right, bottom)
        return Outline(tuple(places))

    def _grip_at(self, position: QPointF) -> str | int | None:
        """The active region's corner at a position, "edge" for its edge, else None."""
        polygon = self._polygon(self._state.outline, self._canvas.image_rect)
        if polygon.isEmpty() or not self._state.choices.shown:
            return None
        points = [polygon.at(i) for i in range(polygon.size())]
        if _is_rectangle(self._state.outline):
            for index, corner in enumerate(points):
                if (corner - position).manhattanLength() <= 1.5 * REACH:
                    return index
        edges = zip(points, [*points[1:], points[0]], strict=True)
        if any(_distance(position, a, b) <= REACH for a, b in edges):
            return "edge"
        return None

    def _show_cursor(self, tool: object, grip: str | int | None = None) -> None:
        shape = Qt.CursorShape.OpenHandCursor
        if tool is not None:
            shape = Qt.CursorShape.CrossCursor
        elif isinstance(grip, int):
            diagonal = Qt.CursorShape.SizeFDiagCursor, Qt.CursorShape.SizeBDiagCursor
            shape = diagonal[grip % 2]
        elif grip is not None:
            shape = Qt.CursorShape.SizeAllCursor
        if self._canvas.cursor().shape() != shape:
            self._canvas.setCursor(QCursor(shape))

    def _paint(self, painter: QPainter, rect: QRect) -> None:
        if not self._state.choices.shown:
            return
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if self._state.regions:
            self._paint_regions(painter, rect)
        if len(self._lasso) > 1:
            outline = self._drawn_outline()
            if outline is not None:
                self._paint_outline(painter, self._polygon(outline, rect), True)
        self._paint_place(painter, rect)
        if self._state.tool is not None and not self._lasso:
            hint = HINTS[self._state.tool]
            colors = theme.ON_IMAGE
            self._paint_plate(painter, hint, HINT_PLACE, colors.change, colors.panel)

    def _paint_regions(self, painter: QPainter, rect: QRect) -> None:
        names = []
        for index, region in enumerate(self._state.regions):
            active = index == self._state.active
            self._paint_outline(painter, self._polygon(region.outline, rect), active)
            if active and _is_rectangle(region.outline):
                self._paint_corners(painter, self._polygon(region.outline, rect))
            around = self._polygon(region.outline, rect).boundingRect()
            names.append((not active, region.name, around))
        # The active region's name has the first choice.
        names.sort(key=lambda name: name[0])
        plates = [_plate(painter, name) for _, name, _ in names]
        direct = Qt.FindChildOption.FindDirectChildrenOnly
        above = [
            QRectF(each.geometry())
            for each in self._canvas.findChildren(QWidget, options=direct)
            if each.isVisible()
        ]
        corners = name_corners([around for _, _, around in names], plates, above)
        for (passive, name, _), corner in zip(names, corners, strict=True):
            ink, ground = theme.ON_IMAGE.dim, theme.ON_IMAGE.panel
            if not passive:
                ink, ground = theme.ON_IMAGE.window, theme.ON_IMAGE.change
            self._paint_plate(painter, name, corner, ink, ground)

    def _paint_outline(self, painter: QPainter, polygon: QPolygonF, active: bool) -> None:
        # A dark line beneath, so that it is seen on bright pictures, too.
        ink = theme.ON_IMAGE.change if active else theme.ON_IMAGE.dim
        for color, width in ((theme.ON_IMAGE.window, 3.5), (ink, 1.5)):
            painter.setPen(QPen(QColor(color), width))
            painter.drawPolygon(polygon)

    def _paint_corners(self, painter: QPainter, polygon: QPolygonF) -> None:
        painter.setPen(QPen(QColor(theme.ON_IMAGE.window), 1))
        painter.setBrush(QColor(theme.ON_IMAGE.change))
        for index in range(polygon.size()):
            corner = polygon.at(index)
            painter.drawRect(QRectF(corner.x() - 3.5, corner.y() - 3.5, 7, 7))
        painter.setBrush(Qt.BrushStyle.NoBrush)

    def _paint_plate(
        self, painter: QPainter, text: str, corner: QPointF, ink: str, ground: str
    ) -> None:
        """Write on a background, because images have any colour."""
        paint_plate(painter, _plate(painter, text).translated(corner), ground, 220)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QColor(ink))
        painter.drawText(corner, text)

    def _paint_place(self, painter: QPainter, rect: QRect) -> None:
        if self._state.place is None:
            return
        at = _point(self._state.place, rect)
        for color, width in ((theme.ON_IMAGE.window, 3.5), (theme.ON_IMAGE.text, 1.5)):
            painter.setPen(QPen(QColor(color), width))
            painter.drawEllipse(at, MARK, MARK)

    def _polygon(self, outline: Outline, rect: QRect) -> QPolygonF:
        return QPolygonF([_point(place, rect) for place in outline.points])


def _point(place: tuple[float, float], rect: QRect) -> QPointF:
    return QPointF(rect.left() + place[0] * rect.width(), rect.top() + place[1] * rect.height())


def name_corners(
    regions: Sequence[QRectF], plates: Sequence[QRectF], covered: Sequence[QRectF] = ()
) -> list[QPointF]:
    """Return positions of the regions' names that do not overlap."""
    taken = list(covered)
    corners = []
    for region, plate in zip(regions, plates, strict=True):
        above, below = region.top() - 7, region.bottom() + 18
        xs = region.left() + 6, region.right() - 1 - plate.right()
        # The region may be above the image.
        ys = [y for y in (above, below) if y >= 18] or [18.0]
        places = [QPointF(x, y) for y in ys for x in xs]
        steps = range(1, len(regions) + 1)
        places += [places[0] + QPointF(0, step * (plate.height() + 1)) for step in steps]
        boxes = [plate.translated(place) for place in places]
        x, y = freest([(box.x(), box.y()) for box in boxes], plate.size(), taken)
        corners.append(QPointF(x, y) - plate.topLeft())
        taken.append(plate.translated(corners[-1]))
    return corners


def _plate(painter: QPainter, text: str) -> QRectF:
    return QRectF(painter.fontMetrics().boundingRect(text)).adjusted(-5, -2, 5, 2)


def _is_rectangle(outline: Outline) -> bool:
    points = outline.points
    return len(points) == 4 and len({x for x, _ in points}) == 2 == len({y for _, y in points})


def _resized(outline: Outline, corner: int, x: float, y: float) -> Outline:
    left, top = outline.points[(corner + 2) % 4]
    return Outline.rectangle(min(left, x), min(top, y), max(left, x), max(top, y))


def _distance(point: QPointF, start: QPointF, end: QPointF) -> float:
    along, to = end - start, point - start
    square = QPointF.dotProduct(along, along)
    share = 0.0 if square == 0 else min(max(QPointF.dotProduct(to, along) / square, 0.0), 1.0)
    away = to - along * share
    return float((away.x() ** 2 + away.y() ** 2) ** 0.5)


AWAY = 14  # distance from the place to the right and downwards, in pixels
PIECE_TIP = (
    "Show only what is connected to this place (I), or all but that (X); Ctrl+Z takes it back.\n"
    "A piece that is shown alone fades into the values around it."
)
EDGE = 4  # least distance from the canvas's edges, in pixels
NARROW = 480  # width of the canvas below which a piece has a line for each of its facts
ROW = "<tr><td>{}</td><td align='right' style='padding-left: 12px'>{}</td>{}</tr>"


class PlaceLabel(Card):
    """Label with the values at the clicked place in this canvas."""

    is_covered = Painted(False, "refresh")  # whether another TF's picture is shown

    def __init__(self, canvas: ImageCanvas, asker: SensitivityAsker, finder: PieceFinder) -> None:
        super().__init__(canvas)
        self._canvas, self._asker, self._finder = canvas, asker, finder
        self.is_here = False  # whether it was this canvas that was clicked
        self._last: tuple[float, float] | None = None  # the place that was shown
        self._links = ""  # rows of the pieces there
        self._at = QPoint()  # where they were placed
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.text = QLabel()
        by = Qt.TextInteractionFlag
        self.text.setTextInteractionFlags(by.LinksAccessibleByMouse | by.LinksAccessibleByKeyboard)
        # By Tab: after a click on a link, keys are the image's again.
        self.text.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.text.linkActivated.connect(self._take)
        self.text.setToolTip(PIECE_TIP)
        # Dim while what is found belongs to an earlier state.
        self.dim = QGraphicsOpacityEffect(self.text, opacity=STALE)
        self.dim.setEnabled(False)
        self.text.setGraphicsEffect(self.dim)
        finder.changed.connect(self.refresh)
        asker.state.inputsChanged.connect(self._follow_inputs)
        self.button = IconButton("panel", "Values and edits", "F8", colors=theme.ON_IMAGE)
        self.button.clicked.connect(lambda: asker.asked.open_panel())
        # On the left, where it stays when the text grows.
        row = fill(QHBoxLayout(self), margins=(3, 3, 8, 3), spacing=4)
        row.addWidget(self.button, 0, Qt.AlignmentFlag.AlignTop)
        row.addWidget(self.text)
        self.hide()
        for follow in (self._follow_inputs, self.refresh):
            canvas.resized.connect(follow)

    def refresh(self) -> None:
        """Show the values at the place; until they are known, say so."""
        asker, place = self._asker, self._asker.asked.place
        # The clicked place may lie outside this narrower image.
        is_seen = self.is_here and place is not None and self._canvas.has_place(place)
        if self.is_covered or not (is_seen and asker.asked.choices.shown):
            self.hide()
            return
        found = asker.listed
        lines = [
            (asker.state.range_text(one.reach), f"{percent} %")
            for one, percent in zip(found, percentages(found), strict=True)
        ]
        rows = "".join(ROW.format(escape(text), part, "") for text, part in lines)
        # Nothing moves while the same place's values and pieces come again, as after a turn.
        is_same = place == self._last and (asker.pick is None or self._finder.is_searching)
        is_kept = is_same and bool(self._links)
        self.dim.setEnabled(is_kept)
        if not is_kept:
            texts = [text for text, _ in lines]
            pieces = (self._row_of(p, n, texts) for n, p in enumerate(self._finder.pieces))
            self._links = "".join(pieces) if asker.pick else ""
        nothing = "Nothing visible here" if asker.pick else asker.waiting
        rows = rows or (self._links and f"<tr><td>{nothing}</td></tr>")
        # While one image wipes the other, both lie here.
        whose = f"<tr><td>In {asker.state.tf_input.pane}</td></tr>" if self._canvas.wiped else ""
        # Links are above the values, whose number changes, so that no click misses them.
        self.text.setText(f"<table>{whose}{self._links}{rows}</table>" if rows else nothing)
        said = ", ".join(" ".join(line) for line in lines)
        self.setAccessibleName(f"Values here: {said or nothing}")
        self._last = place
        self._place()
        self.show()
        self.raise_()
        QWidget.setTabOrder(self._canvas, self.text)

    def _row_of(self, piece: Piece, number: int, listed: Sequence[str]) -> str:
        band = piece.values
        values = "voxels" if band is None else self._asker.state.range_text(band)
        if band is not None and values not in listed:
            values = f"peak of the TF, {values}"
        does = " · ".join(
            f"<a href='{action}{number}' style='color: {theme.ON_IMAGE.change}'>{text}</a>"
            for action, text in (("a", "isolate"), ("c", "cut away"))
        )
        name, space = f"Connected {escape(values)}", self._finder.space_of(piece)
        if self._canvas.width() < NARROW:
            return f"<tr><td colspan='2'>{name}<br>{space}<br>{does}</td></tr>"
        return ROW.format(name, space, f"<td style='padding-left: 12px'>{does}</td>")

    def _take(self, link: str) -> None:
        self._finder.take(int(link[1:]), alone=link[0] == "a")

    def _follow_inputs(self) -> None:
        """Forget a place where nothing was visible, as another image may show something there."""
        self.dim.setEnabled(self._finder.is_searching)
        asker = self._asker
        if self.is_here and asker.pick and not asker.listed:
            asker.asked.pick(None)

    def carry(self) -> None:
        """Go along with the clicked place; what it says there is asked for again."""
        self._last = self._asker.asked.place
        if self.isVisible():
            self._place()

    def _place(self) -> None:
        place = self._asker.asked.place
        if place is None:
            return
        self.adjustSize()
        canvas, size = self._canvas, self.size()
        at = _point(place, canvas.image_rect).toPoint()
        if self._links and self._at == at and canvas.rect().contains(QRect(self.pos(), size)):
            return
        self._at = at if self._links else QPoint()
        xs = at.x() + AWAY, at.x() - AWAY - size.width()
        ys = at.y() + AWAY, at.y() - AWAY - size.height()
        corners = [
            (
                max(min(left, canvas.width() - size.width() - EDGE), EDGE),
                max(min(top, canvas.height() - size.height() - EDGE), EDGE),
            )
            for top in ys
            for left in xs
        ]
        others = (c for c in self.window().findChildren(Card) if c.isVisible() and c is not self)
        cards = [QRect(canvas.mapFromGlobal(c.mapToGlobal(QPoint())), c.size()) for c in others]
        self.move(*map(round, freest(corners, size, cards)))
