"""The latent browser: map and grid with their controls, wired to the pictures and the TF.

The module is long because it connects all parts of the browser, and computes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QInputDialog, QMenu, QWidget

from app.controls import add_action
from app.image_view.engine_pane import EnginePane
from app.latent_browser.browser_bar import HEIGHT, BrowserBar
from app.latent_browser.cell_grid import CellGrid
from app.latent_browser.map_colors import shades_of
from app.latent_browser.map_view import MapView
from app.latent_browser.preview import Preview
from app.latent_browser.search_control import SearchControl
from app.state.latent_path import Frame
from app.state.latent_pictures import GridPicture, HoverPicture
from app.state.latent_state import LatentChoices, Place
from app.state.latent_thumbnails import thumbnail
from app.state.latent_work import LatentWork
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.editor import TransferFunctionEditor
from model.errors import LatentError
from model.latent.interpolation import CELLS, Brush
from model.scene.range_fitting import opacity_over
from model.scene.tf_fitting import fitted_curve, fitted_modes, tf_difference
from model.scene.transfer_function import OpacityTF

SOURCES = {"exact": "ray caster", "learned": "model"}
OPENING = "Opening the map …"
NO_VOLUME = "Open a volume: the map of its TFs will be here."
SAME_TF = 0.02
"""Difference in opacity (RMS) up to which a fitted TF stands at the place it was found."""

GAP = 8
"""Around map and grid, and between them, in pixels."""

LEAST_SQUARE = 116
"""Least side of map and grid, in pixels: no window becomes higher because they are opened."""

LEAST_SIDE = 0.01
"""Least side of a brush that a wheel's turn leads to."""

Images = NDArray[np.float32]


class LatentBrowser(QWidget):
    """Shows the map beside the grid; what the mouse is over shows in the reference's pane.

    Parameters
    ----------
    regions : SensitivityState
        Its active region is the one that a search is about.
    """

    problem = Signal(str)
    """Emitted with an error sentence for the notice bar; empty when it no longer holds."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""
    movieRequested = Signal()
    """Emitted when the path is to be saved as a movie."""

    def __init__(
        self,
        state: ViewerState,
        work: LatentWork,
        regions: SensitivityState,
        reference: EnginePane,
        editor: TransferFunctionEditor,
    ) -> None:
        super().__init__()
        self._state = state
        self._work = work
        self._latent = work.state
        self._regions = regions
        self._reference = reference
        self._units = ""
        self._brushes: list[Brush] = []
        self.search = SearchControl(state, work, regions, reference, self)
        self.facts = ""
        self.bar = BrowserBar(self._latent)
        self.cancel, self.keep = self.bar.stop, self.bar.take
        brightness = reference.brightness
        self.map = MapView(self._latent, work.session, work.pictures, work.thumbnails, brightness)
        self.grid = CellGrid(brightness)
        self.preview = Preview(reference, editor.area)
        self._frame: Frame | None = None
        self.map.show_message(NO_VOLUME)
        for part in (self.bar, self.map, self.grid):
            part.setParent(self)
        self._connect()

    def set_units(self, units: str) -> None:
        """Set the unit of the scalar values; may be empty."""
        self._units = units

    def escape(self) -> bool:
        """End a search, a path or the map's computation, else the browsing; False without any."""
        if not self._latent.choices.shown:
            return False
        if self._is_running:
            self._stop()
        else:
            self._latent.choose(shown=False)
        return True

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """End by Escape what :meth:`escape` ends; lasso by L, the whole map by Home."""
        if event.key() == Qt.Key.Key_Escape:
            self.escape()
        elif event.key() == Qt.Key.Key_L and not event.modifiers():
            self.bar.lasso.click()
        elif event.key() == Qt.Key.Key_Home:
            self.map.reset()
        else:
            super().keyPressEvent(event)

    def event(self, event: QEvent) -> bool:
        """Keep L, which elsewhere draws a region, while the browser has the keys."""
        if (
            isinstance(event, QKeyEvent)
            and event.type() == QEvent.Type.ShortcutOverride
            and event.key() == Qt.Key.Key_L
            and not event.modifiers()
        ):
            event.accept()
            return True
        return super().event(event)

    def side_for(self, width: int, height: int) -> int:
        """Side of map and grid in a room of some width and height."""
        return max(min((width - 3 * GAP) // 2, height - HEIGHT - GAP), LEAST_SQUARE)

    def width_for(self, height: int) -> int:
        """Width at which both squares are as large as a height allows."""
        return 2 * max(height - HEIGHT - GAP, LEAST_SQUARE) + 3 * GAP

    def minimumSizeHint(self) -> QSize:
        """Return the least size of bar and squares."""
        least = 2 * LEAST_SQUARE + 3 * GAP
        return QSize(max(least, self.bar.minimumSizeHint().width()), HEIGHT + LEAST_SQUARE + GAP)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Put two equal squares below the bar, in the middle of the width."""
        super().resizeEvent(event)
        side = self.side_for(self.width(), self.height())
        left = max((self.width() - 2 * side - GAP) // 2, 0)
        self.bar.setGeometry(0, 0, self.width(), HEIGHT)
        self.map.setGeometry(left, HEIGHT, side, side)
        self.grid.setGeometry(left + side + GAP, HEIGHT, side, side)

    def take(self, tf: OpacityTF, text: str, place: Place | None = None) -> None:
        """Make an opacity TF of the map the present one, as one edit that can be undone.

        Parameters
        ----------
        text : str
            Name of the edit in the menu.
        place : tuple of float, optional
            Where it was found.
        """
        if tf.scalar_range != self._state.scalar_range:
            # Asked for while another volume was opened.
            return
        self._work.search.cancel()
        as_modes = self._latent.choices.as_modes
        fitted = self._editable(tf)
        difference = tf_difference(fitted, tf)
        if place is not None and difference < SAME_TF:
            self._work.session.remember_place(fitted, place)
        self._state.tf_input.set(replace(self._state.transfer_function, opacity=fitted), text)
        what = f"{len(fitted.modes)} modes" if as_modes else f"{len(fitted.points)} points"
        self.news.emit(f"The TF has {what}; {difference:.3f} from the map's (RMS).")

    def _editable(self, tf: OpacityTF) -> OpacityTF:
        """Return a TF of the map, which has many samples, with few handles."""
        return fitted_modes(tf) if self._latent.choices.as_modes else fitted_curve(tf)

    def _connect(self) -> None:
        work, latent, bar = self._work, self._latent, self.bar
        session, pictures = work.session, work.pictures
        session.mapClosed.connect(lambda: self.map.show_message(OPENING))
        latent.choicesChanged.connect(self._choices_changed)
        # Its picture is shown again, instead of that of the place under the mouse.
        self._state.edits.undone.connect(lambda: latent.set_hover(None))
        session.mapOpened.connect(lambda: self.map.show_message(""))
        session.mapChanged.connect(lambda _map: self._show_map())
        session.progressed.connect(self._show_progress)
        session.overviewChanged.connect(lambda _overview: self._color())
        session.placeChanged.connect(lambda _place: self._place_moved())
        session.problem.connect(self._session_problem)
        work.errors.changed.connect(self._color)
        latent.choicesChanged.connect(lambda _choices: self._color())
        session.filterChanged.connect(self._color)
        latent.hoverChanged.connect(lambda _place: self._tell())
        latent.brushChanged.connect(lambda _brush: self._brushes.clear())
        pictures.gridDrawn.connect(self._show_grid)
        pictures.grid_at_work.changed.connect(self.grid.set_progress)
        pictures.hoverDrawn.connect(self._show_hover)
        pictures.hoverMoved.connect(self.preview.show_tf)
        pictures.problem.connect(self.problem)
        self._state.inputsChanged.connect(self._mark_stale)
        self.map.chosen.connect(self._choose_place)
        self.map.menuRequested.connect(self._open_menu)
        self.grid.chosen.connect(self._choose_cell)
        self.grid.zoomed.connect(self._zoom_into)
        self.grid.widened.connect(self._widen)
        self.grid.hovered.connect(self._hover_cell)
        self.grid.menuRequested.connect(self._open_grid_menu)
        bar.resetRequested.connect(self.map.reset)
        bar.problem.connect(self.problem)
        bar.nameRequested.connect(self._name_present)
        bar.placeRequested.connect(self._take_named)
        bar.renameRequested.connect(self._rename)
        bar.forgetRequested.connect(latent.forget_place)
        bar.playRequested.connect(self._play)
        bar.movieRequested.connect(self.movieRequested)
        bar.seekRequested.connect(self.search.seek)
        self.search.problem.connect(self.problem)
        self.search.news.connect(self.news)
        self.search.told.connect(self._tell)
        self.search.changed.connect(self._show_cancel)
        self.search.changed.connect(self._tell)
        bar.search.menu().aboutToShow.connect(self._fill_search)
        work.path.frameDrawn.connect(self._show_frame)
        work.path.ended.connect(self._path_ended)
        self.cancel.clicked.connect(self._stop)
        self.keep.clicked.connect(self._take_frame)
        self._fill_search()

    def _choices_changed(self, choices: LatentChoices) -> None:
        if not choices.shown:
            # Nobody sees what they do.
            self._work.search.cancel()
            if not self._work.path.is_movie:
                self._work.path.cancel()
            self._latent.set_hover(None)
            self.preview.show_tf(None)

    # The map.

    def _show_map(self) -> None:
        self._brushes.clear()
        self.map.show_map()
        self._color()
        self._tell()

    def _session_problem(self, text: str) -> None:
        if self._work.session.map is None:
            self.map.show_message(text or OPENING)
        elif text:
            self.problem.emit(text)

    def _color(self) -> None:
        session = self._work.session
        if session.map is None or not self._latent.choices.shown:
            return
        shades = shades_of(
            session, self._latent, self._state.scalar_range, self._units, self._work.errors.errors
        )
        self.map.show_shades(shades)
        self.bar.explain_colors(shades.legend.title)

    def _place_moved(self) -> None:
        if self._latent.choices.coloring == "distance":
            self._color()
        self._tell()

    def _choose_place(self) -> None:
        place = self._latent.hover
        if place is not None:
            self.take(self._tf_under_mouse(place), "TF from the map", place)

    def _tf_under_mouse(self, place: Place) -> OpacityTF:
        latent = self._latent
        sample = latent.hover_sample if place == latent.hover else None
        tf, _ = self._work.session.tf_at(place, sample, latent.closeness)
        return tf

    def _open_menu(self, place: Place, point: QPoint) -> None:
        if self._work.session.map is None:
            return
        tf = self._tf_under_mouse(place)
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        apply = partial(self.take, tf, "TF from the map", place)
        add_action(menu, "Apply transfer function", apply)
        shown = self._work.pictures.hover
        picture = shown.image if shown is not None and shown.tf == tf else None
        name = partial(self._ask_name, place, self._editable(tf), picture)
        add_action(menu, "Name this place…", name)
        menu.popup(point)

    # The grid.

    def _show_grid(self, picture: GridPicture | None) -> None:
        self.grid.show_grid(picture)
        self._mark_stale()
        self._tell()

    def _mark_stale(self) -> None:
        pictures = self._work.pictures
        if pictures.grid is not None and self._latent.choices.shown:
            self.grid.set_stale(not pictures.is_fresh(pictures.grid))

    def _choose_cell(self, cell: int) -> None:
        tf = self._work.pictures.cell_tf(cell)
        if tf is not None:
            self.take(tf, "TF from the grid", self._work.pictures.cell_place(cell))

    def _hover_cell(self, cell: int | None) -> None:
        self.map.mark_cell(cell)
        self.preview.show_tf(None if cell is None else self._work.pictures.cell_tf(cell))

    def _open_grid_menu(self, point: QPoint) -> None:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        nearest = menu.addAction("Nearest TF in empty cells")
        nearest.setCheckable(True)
        nearest.setChecked(self._latent.choices.nearest)
        nearest.triggered.connect(lambda on: self._latent.choose(nearest=on))
        menu.popup(point)

    def _zoom_into(self, cell: int) -> None:
        left, lower, right, upper = self._latent.brush
        width, height = (right - left) / CELLS, (upper - lower) / CELLS
        if min(width, height) < LEAST_SIDE:
            return
        row, column = divmod(cell, CELLS)
        x, y = left + column * width, upper - (row + 1) * height
        self._set_brush((x, y, x + width, y + height), [*self._brushes, self._latent.brush])

    def _widen(self) -> None:
        """Return to the rectangle before the last zoom, or to one of twice the size."""
        before = self._brushes
        if before:
            brush = before[-1]
        else:
            left, lower, right, upper = self._latent.brush
            dx, dy = (right - left) / 2, (upper - lower) / 2
            brush = (
                min(left, max(left - dx, -1.0)), min(lower, max(lower - dy, -1.0)),
                max(right, min(right + dx, 1.0)), max(upper, min(upper + dy, 1.0)),
            )  # fmt: skip
        self._set_brush(brush, before[:-1])

    def _set_brush(self, brush: Brush, before: list[Brush]) -> None:
        """Set the rectangle, and those that the wheel returns to."""
        self._latent.set_brush(brush)
        self._brushes = before
        self.map.look_at(brush)

    # The picture under the mouse.

    def _show_hover(self, picture: HoverPicture | None) -> None:
        if picture is None:
            self.preview.show_picture(None)
            return
        source = SOURCES[picture.source]
        drawn = f"{source} from the code" if picture.of_code else source
        of = {0: "nearest sample, none in the disc", 1: "one sample"}.get(
            picture.samples, f"{picture.samples} samples"
        )
        text = f"Under the mouse: {of}; {drawn}, {1000 * picture.seconds:.0f} ms"
        self.preview.show_picture(picture.image, text, picture.source)

    # Places and paths.

    def _name_present(self) -> None:
        place = self._work.session.place
        if place is not None:
            self._ask_name(place, self._state.transfer_function.opacity, self.search.image)

    def _ask_name(self, place: Place, tf: OpacityTF, picture: Images | None) -> None:
        self._ask_text(
            f"Place {self._latent.place_count + 1}",
            partial(self._name, place, tf, picture),
        )

    def _name(self, place: Place, tf: OpacityTF, picture: Images | None, name: str) -> None:
        # Another volume may have been opened meanwhile.
        if tf.scalar_range == self._state.scalar_range:
            small = None if picture is None else thumbnail(picture)
            self._latent.name_place(place, tf, name, small)

    def _rename(self, index: int) -> None:
        self._ask_text(
            self._latent.places[index].name,
            lambda name: self._latent.rename_place(index, name),
        )

    def _ask_text(self, text: str, take: Callable[[str], None]) -> QInputDialog:
        dialog = QInputDialog(self)
        dialog.setWindowTitle("Name a place")
        dialog.setLabelText("Name of the place:")
        dialog.setTextValue(text)
        dialog.textValueSelected.connect(take)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()
        return dialog

    def _take_named(self, index: int) -> None:
        """Make a named TF the present one, exactly as it was named."""
        named, present = self._latent.places[index], self._state.transfer_function
        if named.tf.scale != present.scale:
            self.news.emit(
                f"{named.name} was named on the other scale, by TF > Axis > Logarithmic scale."
            )
            return
        self._work.search.cancel()
        opacity = opacity_over(named.tf, self._state.scalar_range)
        self._work.session.remember_place(opacity, named.place)
        self._state.tf_input.set(replace(present, opacity=opacity), f"TF of {named.name}")
        self.news.emit(f"The TF is that of {named.name}.")

    def _play(self) -> None:
        try:
            self._work.path.play()
        except LatentError as error:
            self.problem.emit(str(error))
        self._show_cancel()

    def _take_frame(self) -> None:
        frame = self._frame
        self._work.path.cancel()
        if frame is not None:
            self.take(frame.tf, "TF of the path", frame.place)

    def _show_frame(self, frame: Frame | None) -> None:
        self._frame = frame
        if frame is None:
            self.preview.show_tf(None)
            self.preview.show_picture(None)
            self.map.mark_path(None)
            self._show_cancel()
            self._tell("Writing the movie …" if self._work.path.is_movie else "")
            return
        self._show_cancel()
        self.map.mark_path(frame.place)
        self.preview.show_tf(frame.tf)
        text = f"Path: picture {frame.number + 1} of {frame.count}"
        self.preview.show_picture(frame.image, text, self._work.path.engine)
        self._tell(text)

    def _path_ended(self, text: str) -> None:
        if text.startswith("Saved "):
            self.news.emit(text)
        elif text:
            self.problem.emit(text)
        self._show_cancel()
        self._tell()

    # What is going on.

    def _fill_search(self) -> None:
        self.bar.show_search(
            self._work.search.is_running, self.search.has_goal, self._regions.region_name
        )

    def _stop(self) -> None:
        work = self._work
        if work.search.is_running or work.path.is_running:
            work.search.cancel()
            work.path.cancel()
        else:
            work.session.cancel()
        self._show_cancel()

    def _show_progress(self, done: float) -> None:
        self._show_cancel()
        self._tell("" if done >= 1 else f"Computing the map: {100 * done:.0f} %")

    @property
    def _is_running(self) -> bool:
        work = self._work
        return work.search.is_running or work.path.is_running or work.session.is_embedding

    def _show_cancel(self) -> None:
        work = self._work
        self.cancel.setVisible(self._is_running)
        playing = work.path.is_running and not work.path.is_movie and self._frame is not None
        self.keep.setVisible(playing)
        self._fill_search()

    def _tell(self, text: str = "") -> None:
        """Say on the map what is going on, or how many TFs there are; the rest in the caption."""
        session, pictures = self._work.session, self._work.pictures
        if text or session.map is None:
            self.facts = text
            self.map.show_note(text)
            return
        if session.is_embedding or self._work.search.is_running or self._work.path.is_running:
            return
        samples = session.map.samples
        count = f"{len(samples.codes):,}"
        if session.wanted is not None and not session.wanted.all():
            count = f"{session.wanted.sum():,} of {count}"
        self.map.show_note(count)
        facts = [f"{count} TFs"]
        dimensions, effective = samples.codes.shape[1], samples.effective_dimension
        singular = ", ".join(f"{value:.2g}" for value in samples.singular_values)
        explained = [
            f"The map shows {dimensions} dimensions of codes, of which {effective:.1f} are used.\n"
            f"Singular values of the codes: {singular}."
        ]
        if not session.map.is_final:
            facts.append("principal components only")
        if session.place is not None:
            near = "" if session.is_exact else ", about here"
            facts.append(f"present TF{near} (differs by {session.place_error:.3f})")
            explained.append(
                "The present TF differs from the nearest that can be browsed by so much opacity "
                "(root mean square)."
            )
        grid = pictures.grid
        if grid is not None and grid.images:
            size = next(iter(grid.images.values())).shape[0]
            source, ms = SOURCES[grid.source], 1000 * grid.seconds
            of = " from codes" if grid.of_codes else ""
            if self._latent.hover is None:
                # Both do not have room.
                facts.append(f"{len(grid.images)} pictures by the {source}{of} in {ms:.0f} ms")
            explained.append(
                f"Pictures of the grid have {size} × {size} pixels; the number in a corner\n"
                "is how many of the TFs lie in that cell of the frame."
            )
        if self._latent.hover is not None:
            x, y = self._latent.hover
            facts.append(f"({x:.2f}, {y:.2f})")
        self.facts = "    ".join(facts)
        self.preview.set_facts("\n".join([*facts, *explained]))
