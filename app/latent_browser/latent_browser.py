"""The latent browser: grid and map with their controls, wired to the pictures and the TF."""

import re
from collections.abc import Callable
from dataclasses import replace

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QObject, QSize, Qt, Signal
from PySide6.QtGui import QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QMenu, QPushButton, QToolButton, QWidget

from app import theme
from app.controls import add_choices, fill, named, show_tips
from app.engines.client import EngineState
from app.icons import IconButton, icon
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import to_qimage
from app.latent_browser.cell_grid import CellGrid
from app.latent_browser.map_marks import shades_of
from app.latent_browser.map_view import MapView
from app.picture import BLACK
from app.state.latent_pictures import GridPicture, HoverPicture, LatentPictures
from app.state.latent_session import CodecChoice, LatentChoices, LatentState, Place
from app.state.viewer_state import ViewerState
from app.tf_editor.editor import TransferFunctionEditor
from app.tf_editor.histogram import Curve
from app.tf_editor.plot_area import PlotArea
from model.latent.latent_map import CELLS, Brush
from model.scene.tf_editing import fitted_curve
from model.scene.transfer_function import OpacityTF, Range

CODECS: dict[CodecChoice, tuple[str, str]] = {
    "shipped": ("Shipped codec", "The codec that ships with tfscope, for any volume"),
    "model": ("Model's codec", "The codec of this volume's model"),
}

HEIGHT = 36
BAND_WIDTH = 84, 150  # least and greatest width of the field of values, in pixels


class BrowserBar(QWidget):
    """Controls in one row: map or pictures, filter, codec, and cancelling the map's computation."""

    def __init__(
        self,
        latent: LatentState,
        reset: Callable[[], object],
        stop: Callable[[], object],
        report: Callable[[str], object],
    ) -> None:
        super().__init__()
        self._latent, self._report = latent, report
        self._band_before: Range | None = None
        self._refused: str | None = None
        self.setFixedHeight(HEIGHT)
        tip = "The map of all TFs, and a picture of each of its cells"
        self.map = IconButton("browse", "Map", tip=tip, text="Map")
        self.map.setCheckable(True)
        self.band = QLineEdit(placeholderText="Find values …", clearButtonEnabled=True)
        self.band.setAccessibleName("Shows values")
        self.band.setToolTip(
            "Type scalar values, such as 90 to 120 (Ctrl+F). Pictures that show none of them fade."
        )
        self.band.setMinimumWidth(BAND_WIDTH[0])
        self.band.setMaximumWidth(BAND_WIDTH[1])
        self._eye = self.band.addAction(icon("eye"), QLineEdit.ActionPosition.LeadingPosition)
        QShortcut(QKeySequence("Ctrl+F"), self, self.band.setFocus)
        self.reset = IconButton("home", "Whole map", "Home")
        self.stop = named(QPushButton("Stop"), tip="Stop the computation of the map (Escape)")
        self.stop.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.more = IconButton("more", "Codec")  # shown where a model fits the volume
        menu = QMenu(self.more)
        show_tips(menu)
        self.more.setMenu(menu)
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._codecs = add_choices(menu, CODECS, lambda codec: latent.choose(codec=codec))
        left = self.map, self.band, self.reset
        fill(QHBoxLayout(self), *left, 0, self.stop, self.more, margins=(8, 0, 8, 0), spacing=4)
        self.stop.hide()
        self.more.hide()
        for signal, slot in (
            (self.band.editingFinished, self._read_band),
            (self.band.textChanged, lambda text: None if text else self._read_band()),
            (self.map.clicked, lambda on: latent.choose(on_map=on)),
            (self.reset.clicked, reset),
            (self.stop.clicked, stop),
            (latent.choicesChanged, lambda _choices: self._show_choices()),
        ):
            signal.connect(slot)
        self._show_choices()

    def changeEvent(self, event: QEvent) -> None:
        """Draw the field's icon again in another theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self._eye.setIcon(icon("eye"))
        super().changeEvent(event)

    def _show_choices(self) -> None:
        choices = self._latent.choices
        self._codecs[choices.codec].setChecked(True)
        self.map.setChecked(choices.on_map)
        self.reset.setVisible(choices.on_map)
        if choices.band != self._band_before:
            self.band.setText(" to ".join(f"{value:.10g}" for value in choices.band or ()))
        self._band_before = choices.band

    def _read_band(self) -> None:
        text = self.band.text().strip()
        if text == self._refused:
            return
        self._refused = None
        try:
            band = parsed_band(text)
        except ValueError:
            self._refused = text
            self._report(
                f"'{text}' is not a range of scalar values; write two numbers, such as 90 to 120."
            )
            return
        self._report("")
        self._band_before = band  # as it is written
        self._latent.choose(band=band)


def parsed_band(text: str) -> Range | None:
    """Read a value, or two with "to", a comma or a dash between them; None for nothing."""
    if not text:
        return None
    number = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
    found = re.fullmatch(rf"({number})(?:\s*(?:to|,|–|-|\.\.)\s*({number}))?", text)
    if found is None:
        raise ValueError(text)
    low = float(found[1])
    high = low if found[2] is None else float(found[2])
    return min(low, high), max(low, high)


class Preview(QObject):
    """Covers the reference image by another TF's picture, and draws that TF over the editor's."""

    tfChanged = Signal(object)  # emitted with the TF shown instead of the image, or None

    def __init__(self, pane: EnginePane, area: PlotArea) -> None:
        super().__init__(pane)
        self._pane = pane
        self._area = area
        self.is_shown = False  # whether a picture covers the reference's
        self._curve = Curve(area.opacity)
        self._curve.pen = pg.mkPen(theme.ATTENTION, width=1.6, dash=[5, 3])
        self._curve.setZValue(80)
        self._curve.hide()

    def show_tf(self, tf: OpacityTF | None) -> None:
        """Draw a TF over the editor's own; None for none."""
        if tf is not None:
            self._area.draw(self._curve, tf.sample(), tf.scalar_range, are_opacities=True)
        self._curve.setVisible(tf is not None)

    def show_hover(self, picture: HoverPicture | None) -> None:
        """Show the picture of the place under the mouse instead of the reference's, or not."""
        if picture is None and not self.is_shown:
            return
        self.is_shown = picture is not None
        self.tfChanged.emit(picture and picture.tf)
        if picture is None:
            self._pane.canvas.cover = None
            self._pane.name_cover("")
            return
        brightness = self._pane.brightness.of(picture.source)
        is_clear = self._pane.background != BLACK
        self._pane.canvas.cover = to_qimage(picture.image, brightness, clear=is_clear)
        of = {0: "The nearest TF of the map", 1: "A TF of the map"}
        explained = of.get(picture.samples, f"The mean of {picture.samples} TFs of the map")
        self._pane.name_cover("At the mouse", "click to take", explained)


OPENING = "Opening the map …"
CHOOSING = "Choosing TFs that show different things:{:\u2007>4.0f} %"  # as wide for any number
NO_TFS = "No TF passes the filters. The map's TFs cover the values {}."
NO_VOLUME = "Open a volume to see what TFs show of it."
GAP = 8  # around map and grid, and between them, in pixels
LEAST_SQUARE = 116  # side of map and grid in pixels: opening them does not enlarge the window
LEAST_SIDE = 0.01  # least side of a brush that a wheel's turn leads to


class LatentBrowser(QWidget):
    """Shows the TFs that differ most, or the map next to the grid of its cells."""

    resized = Signal()  # when its best width has changed, see `width_for`
    problem = Signal(str)  # emitted with an error sentence; empty when it no longer holds

    def __init__(
        self,
        state: ViewerState,
        pictures: LatentPictures,
        reference: EnginePane,
        editor: TransferFunctionEditor,
    ) -> None:
        super().__init__()
        self._state, self._pictures = state, pictures
        self._session, self._latent = pictures.session, pictures.state
        self._looked = 0.0  # share of the TFs whose tiny pictures are drawn
        self._brushes: list[Brush] = []  # earlier rectangles, for the grid's wheel
        self._brightness = reference.brightness
        self.map = MapView(self._latent, self._session)
        self.bar = BrowserBar(self._latent, self.map.reset, self._session.cancel, self.problem.emit)
        self.grid = CellGrid(reference.brightness)
        self.preview = Preview(reference, editor.area)
        self._show_message(NO_VOLUME)
        for part in (self.bar, self.map, self.grid):
            part.setParent(self)
        whole = QShortcut(QKeySequence("Home"), self, self.map.reset)
        whole.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        self.map.hide()
        self._connect()

    def escape(self) -> bool:
        """End the map's computation, or else close the browser; False if neither is active."""
        if not self._latent.choices.shown:
            return False
        if self._session.is_embedding:
            self._session.cancel()
        else:
            self._latent.choose(shown=False)
        return True

    def width_for(self, height: int) -> int:
        """Width at which the squares are as large as a height allows."""
        squares = self._squares
        return squares * max(height - HEIGHT - GAP, LEAST_SQUARE) + (squares + 1) * GAP

    @property
    def _squares(self) -> int:
        return 2 if self._latent.choices.on_map else 1

    def minimumSizeHint(self) -> QSize:
        """Return the minimum size of bar and squares."""
        least = 2 * LEAST_SQUARE + 3 * GAP
        return QSize(max(least, self.bar.minimumSizeHint().width()), HEIGHT + LEAST_SQUARE + GAP)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Put equal squares below the bar, in the middle of the width."""
        super().resizeEvent(event)
        self._place_squares()

    def _place_squares(self) -> None:
        squares = self._squares
        wide, high = (self.width() - GAP) // squares - GAP, self.height() - HEIGHT - GAP
        side = max(min(wide, high), LEAST_SQUARE)
        right = (self.width() + squares * (side + GAP) - GAP) // 2
        self.bar.setGeometry(0, 0, self.width(), HEIGHT)
        self.grid.setGeometry(right - side, HEIGHT, side, side)
        self.map.setGeometry(right - 2 * side - GAP, HEIGHT, side, side)

    def _connect(self) -> None:
        session, pictures, latent = self._session, self._pictures, self._latent
        for signal, slot in (
            (pictures.exact.stateChanged, self._say_why),
            (latent.choicesChanged, self._choices_changed),
            (latent.brushChanged, lambda _brush: self._brushes.clear()),
            # Its picture is shown again, instead of that of the place under the mouse.
            (self._state.edits.undone, lambda: latent.set_hover(None)),
            (session.mapChanged, self._show_map),
            (session.progressed, self._show_progress),
            (session.overviewChanged, self._color),
            (session.problem, self._session_problem),
            (session.filterChanged, self._show_filter),
            (pictures.gridDrawn, self._show_grid),
            (pictures.hoverDrawn, self.preview.show_hover),
            (pictures.hoverMoved, self.preview.show_tf),
            (pictures.problem, self.problem),
            (pictures.slow_grid.changed, lambda part: setattr(self.grid, "progress", part)),
            (self._state.inputsChanged, self._state.refreshes.soon(self._mark_stale)),
            (self.map.chosen, self._choose_place),
            (self.grid.chosen, self._choose_cell),
            (self.grid.zoomed, self._zoom),
            (self.grid.hovered, self._hover_cell),
        ):
            signal.connect(slot)
        session.looked.connect(self._note_look, Qt.ConnectionType.QueuedConnection)

    def _choices_changed(self, choices: LatentChoices) -> None:
        if not choices.shown:
            self._latent.set_hover(None)
            self.preview.show_tf(None)
        if choices.on_map == self.map.isHidden():
            self._latent.set_hover(None)
            self.map.setVisible(choices.on_map)
            self._place_squares()
            self.resized.emit()
        self._color()

    def _show_message(self, text: str) -> None:
        self.map.message = text
        self.grid.message = text

    def _show_map(self, map_: object) -> None:
        if map_ is None:
            self._show_message(OPENING)
            return
        self._brushes.clear()
        self.map.reset()
        self._show_filter()

    def _show_filter(self) -> None:
        self.map.message = ""
        self._say_why()
        self._color()
        self._show_note()

    def _note_look(self, done: float) -> None:
        self._looked = min(done, 1.0)
        self._say_why()

    def _say_why(self, _state: object = None) -> None:
        """Say why there are no pictures yet."""
        exact, choosing = self._pictures.exact, CHOOSING.format(100 * self._looked)
        if self._session.map is not None:
            why = exact.text if exact.state is EngineState.WAITING else choosing
            none = NO_TFS.format(self._state.range_text(self._session.window))
            self.grid.message = why if self._session.chosen is not None else none

    def _session_problem(self, text: str) -> None:
        if self._session.map is None:
            self._show_message(text or OPENING)
        elif text:
            self.problem.emit(text)

    def _color(self, _overview: object = None) -> None:
        if self._session.map is not None and self._latent.choices.shown:
            self.map.shades = shades_of(self._session, self._state.units)

    def _choose_place(self) -> None:
        place = self._latent.hover
        if place is not None:
            tf, _ = self._session.tf_at(place, self._latent.closeness)
            self.take(tf, "TF from the map", place)

    def take(self, tf: OpacityTF, text: str, place: Place, exposure: float | None = None) -> None:
        """Take an opacity TF from a place of the map, as one undo step."""
        if tf.scalar_range != self._state.scalar_range:
            # Asked for while another volume was opened.
            return
        # A TF of the map has many points.
        fitted = fitted_curve(tf)
        self._session.taken = fitted, place
        with self._state.edits.as_one(text):
            taken = replace(self._state.transfer_function, opacity=fitted)
            self._state.tf_input.exchange(taken, text)
            if exposure is not None:
                usual = self._brightness.usual["exact"]
                self._brightness.set(None if exposure == 1 else exposure * usual)

    def _show_grid(self, picture: GridPicture | None) -> None:
        self.grid.picture = picture
        self._mark_stale()

    def _mark_stale(self) -> None:
        grid = self._pictures.grid
        if grid is not None and self._latent.choices.shown:
            self.grid.is_stale = not self._pictures.is_fresh(grid)

    def _choose_cell(self, cell: int) -> None:
        grid = self._pictures.grid
        if grid is not None and (tf := grid.tfs[cell]) is not None:
            x, y = grid.places[cell].tolist()
            self.take(tf, "TF from the grid", (x, y), grid.exposures.get(cell))

    def _hover_cell(self, cell: int | None) -> None:
        self.map.active_cell = cell
        grid = self._pictures.grid
        self.preview.show_tf(None if cell is None or grid is None else grid.tfs[cell])

    def _zoom(self, cell: int | None) -> None:
        """Shrink the rectangle to one of its cells; None goes back, or doubles it."""
        if not self._latent.choices.on_map:
            return
        left, lower, right, upper = self._latent.brush
        before = list(self._brushes)
        if cell is not None:
            width, height = (right - left) / CELLS, (upper - lower) / CELLS
            if min(width, height) < LEAST_SIDE:
                return
            before.append(self._latent.brush)
            row, column = divmod(cell, CELLS)
            x, y = left + column * width, upper - (row + 1) * height
            brush = x, y, x + width, y + height
        elif before:
            brush = before.pop()
        else:
            dx, dy = (right - left) / 2, (upper - lower) / 2
            brush = (
                min(left, max(left - dx, -1.0)), min(lower, max(lower - dy, -1.0)),
                max(right, min(right + dx, 1.0)), max(upper, min(upper + dy, 1.0)),
            )  # fmt: skip
        self._latent.set_brush(brush)
        self._brushes = before
        self.map.look_at(brush)

    def _show_progress(self, done: float) -> None:
        self.bar.stop.setVisible(self._session.is_embedding)
        self._show_note("" if done >= 1 else f"Computing the map: {100 * done:.0f} %")

    def _show_note(self, text: str = "") -> None:
        """Show on the map what is going on, or how many TFs there are."""
        session = self._session
        if not text and session.map is not None and session.wanted is not None:
            if session.is_embedding:
                return
            count = f"{len(session.map.codes):,} TFs"
            text = count if session.wanted.all() else f"{session.wanted.sum():,} of {count}"
        self.map.note = text
