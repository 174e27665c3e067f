"""The latent browser: map and grid with their controls, wired to the pictures and the TF.

It connects the parts of the browser, and computes nothing.
"""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QEvent, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QMenu, QWidget

from app.controls import add_action
from app.image_view.engine_pane import EnginePane
from app.latent_browser.browser_bar import HEIGHT, BrowserBar
from app.latent_browser.cell_grid import CellGrid
from app.latent_browser.grid_control import GridControl
from app.latent_browser.map_colors import shades_of
from app.latent_browser.map_facts import count_of, facts_of
from app.latent_browser.map_view import MapView
from app.latent_browser.path_control import PathControl
from app.latent_browser.place_naming import PlaceNaming
from app.latent_browser.preview import Preview
from app.latent_browser.search_control import SearchControl
from app.latent_browser.tf_taking import TFTaking
from app.state.latent_state import LatentChoices, Place
from app.state.latent_work import LatentWork
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.editor import TransferFunctionEditor
from model.scene.transfer_function import OpacityTF

OPENING = "Opening the map …"
NO_VOLUME = "Open a volume: the map of its TFs will be here."
GAP = 8
"""Around map and grid, and between them, in pixels."""

LEAST_SQUARE = 116
"""Least side of map and grid, in pixels: no window becomes higher because they are opened."""


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
        self._units = ""
        self.search = SearchControl(state, work, regions, reference, self)
        self.facts = ""
        self.bar = BrowserBar(self._latent)
        self.cancel, self.keep = self.bar.stop, self.bar.take
        self.taking = TFTaking(state, work, self)
        self.naming = PlaceNaming(state, self._latent, self)
        brightness = reference.brightness
        self.map = MapView(self._latent, work.session, work.pictures, work.thumbnails, brightness)
        self.grid = CellGrid(brightness)
        self.preview = Preview(reference, editor.area)
        self._grids = GridControl(
            self.grid, self._latent, work.pictures, self.map, self.preview, self.taking
        )
        self._path = PathControl(work.path, self.map, self.preview, self.taking, self)
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
        pictures.gridDrawn.connect(lambda _picture: self._tell())
        pictures.hoverDrawn.connect(self.preview.show_hover)
        pictures.hoverMoved.connect(self.preview.show_tf)
        pictures.problem.connect(self.problem)
        self._state.inputsChanged.connect(self._grids.mark_stale)
        self.map.chosen.connect(self._choose_place)
        self.map.menuRequested.connect(self._open_menu)
        bar.resetRequested.connect(self.map.reset)
        bar.problem.connect(self.problem)
        bar.nameRequested.connect(self._name_present)
        bar.placeRequested.connect(self.taking.take_named)
        bar.renameRequested.connect(self.naming.rename)
        bar.forgetRequested.connect(latent.forget_place)
        bar.playRequested.connect(self._path.play)
        bar.movieRequested.connect(self.movieRequested)
        bar.seekRequested.connect(self.search.seek)
        for part in (self.search, self._path):
            part.problem.connect(self.problem)
            part.news.connect(self.news)
            part.told.connect(self._tell)
            part.changed.connect(self._show_cancel)
        self.search.changed.connect(self._tell)
        self.taking.news.connect(self.news)
        bar.search.menu().aboutToShow.connect(self._fill_search)
        self.cancel.clicked.connect(self._stop)
        self.keep.clicked.connect(self._path.take_frame)
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
        self._grids.forget_zooms()
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
            self.taking.take(self._tf_under_mouse(place), "TF from the map", place)

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
        apply = partial(self.taking.take, tf, "TF from the map", place)
        add_action(menu, "Apply transfer function", apply)
        shown = self._work.pictures.hover
        picture = shown.image if shown is not None and shown.tf == tf else None
        name = partial(self.naming.ask, place, self.taking.editable(tf), picture)
        add_action(menu, "Name this place…", name)
        menu.popup(point)

    def _name_present(self) -> None:
        place = self._work.session.place
        if place is not None:
            self.naming.ask(place, self._state.transfer_function.opacity, self.search.image)

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
        self.cancel.setVisible(self._is_running)
        self.keep.setVisible(self._path.is_playing)
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
        self.map.show_note(count_of(session, session.map))
        facts, explained = facts_of(session, session.map, pictures, self._latent)
        self.facts = "    ".join(facts)
        self.preview.set_facts("\n".join([*facts, *explained]))
