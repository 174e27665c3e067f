"""The 4 x 4 grid: pictures of the TFs that differ most, or of the brushed rectangle's cells."""

from PySide6.QtCore import QEvent, QRectF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QFont,
    QFontInfo,
    QFontMetricsF,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QWheelEvent,
)

from app import theme
from app.controls import ARROWS, Painted
from app.image_view.image_canvas import LEAST_PROGRESS, KeyedWidget, paint_progress
from app.picture import BLACK, Background, compose
from app.state.edits import Brightness
from app.state.latent_pictures import GridPicture
from model.latent.latent_map import CELLS

GAP = 3
STALE_OPACITY = 0.45

LEAST_SHOWN = 1.5  # brightness factor from which a picture's caption shows it
CAPTION = 0.8  # size of captions, as a share of the usual letters


class CellGrid(KeyedWidget):
    """Shows pictures of cells, or of the TFs that differ most, as large as possible."""

    chosen = Signal(int)  # with the cell, row by row, that was clicked
    zoomed = Signal(object)  # emitted with the cell to come closer to, or None to go back
    hovered = Signal(object)  # with the cell under the mouse, or None

    picture = Painted[GridPicture | None](None, "_paint_images")  # those of the cells
    background = Painted[Background](BLACK, "_paint_images")
    is_stale = Painted(False)  # of an earlier view, light or colours
    message = Painted("")  # where there are no pictures
    progress = Painted[float | None](None)  # progress of the pictures, if they take long

    def __init__(self, brightness: Brightness) -> None:
        super().__init__()
        self._brightness = brightness
        self.images: dict[int, QImage] = {}  # by cell
        self._cell: int | None = None
        self._turned = 0.0
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.WheelFocus)
        self.setAccessibleName("Grid of pictures")
        brightness.changed.connect(self._paint_images)

    def _paint_images(self) -> None:
        self.images = {}
        if self.picture is not None:
            source, exposures = self.picture.source, self.picture.exposures
            for cell, image in self.picture.images.items():
                brightness, ground = self._brightness.of(source), self.background
                if cell in exposures:
                    brightness = self._brightness.usual[source] * exposures[cell]
                    # On white, what is brightened would vanish.
                    ground = BLACK if exposures[cell] >= LEAST_SHOWN else ground
                self.images[cell] = compose(image, ground, brightness)
        self.update()

    @property
    def text(self) -> str:
        """Text in the middle: why there are no pictures, or that they follow."""
        if self.progress is not None:
            return "drawing …"
        return self.message if self.picture is None else ""

    def cell_rect(self, cell: int) -> QRectF:
        """Rectangle of a cell in pixels."""
        side = min(self.width(), self.height())
        left, top = (self.width() - side) / 2, (self.height() - side) / 2
        row, column = divmod(cell, CELLS)
        edge = (side - (CELLS - 1) * GAP) / CELLS
        return QRectF(left + column * (edge + GAP), top + row * (edge + GAP), edge, edge)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint pictures with their captions, and frames of cells without samples."""
        painter = QPainter(self)
        painter.setRenderHints(
            QPainter.RenderHint.SmoothPixmapTransform | QPainter.RenderHint.Antialiasing
        )
        picture = self.picture
        for cell in range(CELLS**2):
            rect = self.cell_rect(cell)
            if cell in self.images:
                painter.setOpacity(STALE_OPACITY if self.is_stale else 1.0)
                painter.drawImage(rect, self.images[cell])
                painter.setOpacity(1.0)
            else:
                painter.setPen(QPen(QColor(theme.ON_IMAGE.line), 1, Qt.PenStyle.DashLine))
                painter.setBrush(QColor(theme.ON_IMAGE.panel))
                painter.drawRect(rect)
            if picture is not None and (caption := caption_of(picture, cell)):
                self._paint_caption(painter, rect, caption)
            if cell == self._cell and cell in self.images:
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 2))
                painter.drawRect(rect)
        if text := self.text:
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            room = self.rect().adjusted(20, 20, -20, -20)
            plate = painter.boundingRect(room, flags, text).adjusted(-8, -4, 8, 4)
            painter.fillRect(plate, QColor(theme.ON_IMAGE.panel))
            painter.setPen(QColor(theme.ON_IMAGE.dim))
            painter.drawText(room, flags, text)
        if self.progress is not None:
            whole = self.cell_rect(0).united(self.cell_rect(CELLS**2 - 1)).toRect()
            paint_progress(painter, whole, max(self.progress, LEAST_PROGRESS))
        self._paint_ring(painter)

    def _paint_caption(self, painter: QPainter, rect: QRectF, text: str) -> None:
        usual = painter.font()
        font = QFont(usual)
        font.setPixelSize(round(CAPTION * QFontInfo(usual).pixelSize()))
        painter.setFont(font)
        metrics = QFontMetricsF(font)
        width, height = metrics.horizontalAdvance(text) + 8, metrics.height()
        box = QRectF(rect.right() - width, rect.bottom() - height, width, height)
        painter.fillRect(box, QColor(0, 0, 0, 180))
        painter.setPen(QColor(theme.ON_IMAGE.dim))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
        painter.setFont(usual)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Say which cell is under the mouse."""
        self._hover(self._cell_at(event))

    def leaveEvent(self, _event: QEvent) -> None:
        """Forget the cell under the mouse."""
        self._hover(None)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Accept the press, so that the release arrives here."""
        event.accept()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Choose the cell under the mouse."""
        cell = self._cell_at(event)
        if event.button() == Qt.MouseButton.LeftButton and cell in self.images:
            self.chosen.emit(cell)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Come closer to a cell, or move away, by whole notches."""
        self._turned += event.angleDelta().y() / 120
        cell = self._cell_at(event)
        if self._turned >= 1 and cell is not None:
            self._turned = 0.0
            self.zoomed.emit(cell)
        elif self._turned <= -1:
            self._turned = 0.0
            self.zoomed.emit(None)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from cell to cell by arrow keys, take one by Enter, divide it by + and return by −."""
        key, cell = event.key(), self._cell
        if key in ARROWS:
            right, down = ARROWS[key]
            row, column = divmod(cell or 0, CELLS)
            row, column = (min(max(n, 0), CELLS - 1) for n in (row + down, column + right))
            self._hover(0 if cell is None else row * CELLS + column)
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and cell in self.images:
            self.chosen.emit(cell)
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal) and cell is not None:
            self.zoomed.emit(cell)
        elif key == Qt.Key.Key_Minus:
            self.zoomed.emit(None)
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Deselect the cell that was chosen by keys."""
        self._hover(None)
        super().focusOutEvent(event)

    def _cell_at(self, event: QMouseEvent | QWheelEvent) -> int | None:
        at = event.position()
        return next((c for c in range(CELLS**2) if self.cell_rect(c).contains(at)), None)

    def _hover(self, cell: int | None) -> None:
        if cell != self._cell:
            self._cell = cell
            tip = ""
            if self.picture is not None and cell is not None:
                tip = explanation_of(self.picture, cell)
            self.setToolTip(tip)
            shapes = Qt.CursorShape
            self.setCursor(shapes.PointingHandCursor if cell in self.images else shapes.ArrowCursor)
            self.hovered.emit(cell)
            self.update()


def caption_of(picture: GridPicture, cell: int) -> str:
    """Return how many TFs a picture averages, or by how much it is brightened."""
    if picture.cells is not None:
        count = int(picture.cells.count.flat[cell])
        return f"{count} TF{'s' * (count != 1)}"
    exposure = picture.exposures.get(cell, 1.0)
    return f"{exposure:.0f} \u00d7 as bright" if exposure >= LEAST_SHOWN else ""


def explanation_of(picture: GridPicture, cell: int) -> str:
    """Return the tool tip of a picture."""
    if picture.tfs[cell] is None:
        return "There is no TF in this part of the map."
    if picture.cells is not None:
        return f"The mean of {caption_of(picture, cell)}. Click to take it."
    if caption := caption_of(picture, cell):
        return f"This picture is {caption} as usual. Click to take the TF as shown."
    return "Click to take this TF."
