"""The main window: two synchronized images and the transfer-function editor below."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import (
    QCloseEvent,
    QDragEnterEvent,
    QDropEvent,
    QKeyEvent,
    QStatusTipEvent,
)
from PySide6.QtWidgets import QMainWindow, QVBoxLayout, QWidget

from app.controls import order_focus
from app.engines.client import EngineClient
from app.engines.engines import REAL_BUILDERS, Builders
from app.engines.exactness import STOPS
from app.image_view.crop_handles import CropHandles
from app.image_view.engine_pane import EnginePane
from app.image_view.exactness_slider import ExactnessSlider
from app.image_view.fidelity_line import FidelityLine
from app.image_view.gestures import ViewGestures
from app.image_view.reference_controls import ReferenceControls
from app.image_view.view_keys import ViewKeys
from app.latent_browser.latent_browser import LatentBrowser
from app.sensitivity_view.sensitivity_view import SensitivityView
from app.state.brightness import Brightness
from app.state.generator_work import LIGHTS
from app.state.latent_state import LatentChoices, LatentState
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.tf_editor.dock_splitter import DockSplitter
from app.tf_editor.editor import TransferFunctionEditor
from app.tf_editor.plot_memory import PlotMemory
from app.window.crop_card import CropCard
from app.window.empty_card import EmptyCard
from app.window.figure import Subject
from app.window.file_dialogs import FileDialogs
from app.window.file_opening import FileOpening
from app.window.floating import Floating
from app.window.focus_areas import FocusAreas
from app.window.image_error import ImageError
from app.window.menus import Menus, WindowParts
from app.window.movie_saving import MovieSaving
from app.window.notices import Notices
from app.window.overlays import Overlays
from app.window.pane_layout import PaneLayout
from app.window.picture_saving import PictureSaving
from app.window.preset_pictures import PresetPictures
from app.window.quitting import may_quit
from app.window.scene_notices import EmptinessNotice, LightNotice, LogarithmOffer, NarrowNotice
from app.window.sessions import Sessions
from app.window.shown_images import ShownImages
from app.window.status_line import KeyHints, StatusLine
from app.window.tool_strip import ToolStrip
from app.window.top_bar import TopBar
from app.window.up_axis_question import UpAxisCard, UpAxisQuestion
from app.window.window_memory import WindowMemory, size_on
from model.rendering.scale_bar import Scale


class MainWindow(QMainWindow):
    """Shows a generator's image and the ground truth while the user edits view and TF.

    Parameters
    ----------
    builders : Builders
        Functions that read volumes and build engines.
    device : str
        Of generators: "auto", "cpu" or "cuda".
    preferences : Preferences or None
        What is remembered between runs; None for nothing.
    """

    def __init__(
        self,
        builders: Builders = REAL_BUILDERS,
        device: str = "auto",
        preferences: Preferences | None = None,
    ) -> None:
        super().__init__()
        self.preferences = preferences or Preferences(None, self)
        self._alt_alone = False
        self.state = ViewerState(self)
        self.sensitivity_state = SensitivityState(self)
        self.latent_state = LatentState(self)
        generator, reference, analyst = (
            EngineClient(name, self) for name in ("generator", "reference", "analyst")
        )
        self.brightness = Brightness(self.preferences, self, self.state)
        self.generator = EnginePane("Generator", generator, self.brightness, "learned")
        self.reference = EnginePane("Ground truth", reference, self.brightness, "exact")
        self.editor = TransferFunctionEditor(self.state)
        self.notice = Notices()
        self.workspace = Workspace(
            self.state,
            self.sensitivity_state,
            self.latent_state,
            generator,
            reference,
            analyst,
            self.brightness,
            builders,
            self.preferences,
            device,
            self,
        )
        self.browser = LatentBrowser(self.state, self.workspace.latent, self.reference, self.editor)
        self.plot_memory = PlotMemory(self.editor.area, self.preferences)
        self.reference_controls = ReferenceControls(
            self.state, self.workspace.reference, self.brightness, self
        )
        self.exactness = ExactnessSlider(self.workspace.reference)
        self.top_bar = TopBar(
            self.reference_controls.ball, self.reference_controls.light, self.exactness
        )
        self.browse = self.top_bar.browse
        self.panes = PaneLayout(self.browser, self.generator, self.reference)
        self.up_axis_card = UpAxisCard()
        self.crop_card = CropCard(self.state)
        self.tools = ToolStrip(self.sensitivity_state, self.crop_card)
        self.tools.setEnabled(False)
        self.status = StatusLine(self.state)
        self._images = QWidget()
        self._floating = Floating(self._images)
        self._splitter = DockSplitter(self._images_and_floating(), self.editor)
        self._lay_out()
        self.overlays = Overlays((self.generator, self.reference), self.state, self.preferences)
        work = self.workspace.reference
        self.fidelity = FidelityLine(
            self.reference, self.state, work.whole_raster, lambda: work.is_preparing
        )
        self.exactness.follow(self.fidelity)
        self._memory = WindowMemory(
            self, self._splitter, self.panes, self.state, self.editor.moves, self.preferences
        )
        # Before the sensitivities, so that it lies below regions.
        self.image_error = ImageError(self.generator, self.reference, self.state, self.workspace)
        # After the gestures, so that regions get the mouse first.
        self.sensitivity = SensitivityView(
            self.workspace, self.generator, self.reference, self.editor, self
        )
        self.crop_handles = [
            CropHandles(pane.canvas, self.state) for pane in (self.generator, self.reference)
        ]
        self.opening = FileOpening(self, self.state, self.workspace, self.preferences, self.notice)
        self.files = FileDialogs(self, self.state, self.opening, self.preferences)
        shown = ShownImages(
            self.generator,
            self.reference,
            self.overlays,
            self.image_error,
            self.brightness,
            self.workspace.reference,
        )
        self.pictures = PictureSaving(self, self.state, self.files, shown)
        self.movies = MovieSaving(self, self.state, self.files, shown)
        self.sessions = Sessions(
            self,
            self.state,
            self.sensitivity_state,
            self.latent_state,
            self.workspace,
            self.preferences,
            self.files,
            self.opening,
            self.overlays,
            self._memory,
            self.notice,
        )
        self.empty_card = EmptyCard(self.reference, self.workspace, self.opening, self.files)
        self.browser.preview.tfChanged.connect(self.overlays.preview)
        self._question = UpAxisQuestion(
            self.up_axis_card,
            self.state,
            self.workspace,
            analyst,
            reference,
            self.brightness,
            self.preferences,
        )
        presets = self.editor.menu.presets
        PresetPictures(
            presets, self.state, analyst, reference, self.brightness, self.workspace.reference
        )
        self.logarithm_offer = LogarithmOffer(self.state, self.workspace, self.notice, self)
        NarrowNotice(self.state, self.notice, self.editor.range.set_range, self)
        LightNotice(self.workspace.reference, self.notice)
        for pane in (self.generator, self.reference):
            EmptinessNotice(pane, self.state, self.workspace, self.notice)
        parts = WindowParts(
            opening=self.opening,
            files=self.files,
            pictures=self.pictures,
            movies=self.movies,
            sessions=self.sessions,
            state=self.state,
            workspace=self.workspace,
            preferences=self.preferences,
            generator=self.generator,
            reference=self.reference,
            bar=self.top_bar,
            controls=self.reference_controls,
            error=self.image_error,
            panes=self.panes,
            overlays=self.overlays,
            crop=self.crop_card,
            editor=self.editor,
            sensitivity=self.sensitivity_state,
            view=self.sensitivity,
            latent=self.latent_state,
        )
        self._menus = Menus(self, parts)
        self.top_bar.take_menus()
        self._hints = KeyHints(
            self.status,
            self.sensitivity_state,
            images=[pane.canvas for pane in (self.generator, self.reference)],
            maps=[self.browser.map, self.browser.grid],
            plot=self.editor,
            panel=self.sensitivity.findings,
        )
        self._areas = FocusAreas(self, self._focus_areas)
        self._connect()
        self._arrange()
        # Not the bar's first button: keys are the images' at the start.
        self.reference.canvas.setFocus()
        self._show_model()
        if self.preferences.start_problem:
            self.notice.tell(self.preferences.start_problem, tone="error")

    def _connect(self) -> None:
        self.browse.clicked.connect(lambda on: self.latent_state.choose(shown=on))
        self.latent_state.choicesChanged.connect(self._show_browser)
        self._show_browser(self.latent_state.choices)
        self.workspace.modelChanged.connect(self._show_model)
        self.crop_card.shownChanged.connect(self._show_crop_handles)
        self.sensitivity_state.changed.connect(self._show_crop_handles)
        self.panes.imagesShown.connect(self.workspace.show_images)
        self.panes.arranged.connect(self._arrange)
        self.reference.canvas.resized.connect(
            lambda: self.workspace.reference.set_pane_pixels(*self.reference.canvas.pixels)
        )
        self.workspace.volumeOpened.connect(self._show_volume)
        self.workspace.volumeOpened.connect(self.brightness.start_volume)
        self.workspace.reference.settingsChanged.connect(
            lambda settings: self.brightness.set_lighting("exact", settings.lighting)
        )
        self.workspace.reference.settingsChanged.connect(lambda _settings: self._name_light())
        self._name_light()
        self.workspace.rangeChanged.connect(self._show_range)
        self.workspace.scaleChanged.connect(self._show_scale)
        # A band kept over the plot would be one of other values.
        self.workspace.scaleChanged.connect(lambda _opened: self.sensitivity_state.unpin())
        self.opening.transferFunctionOpened.connect(self.editor.show_small_range)
        self.editor.menu.scale_wanted.connect(self.workspace.opening.show_on_scale)
        # Errors of an earlier file no longer apply.
        self.workspace.opening.volumeRead.connect(lambda _opened: self.notice.clear())
        self.workspace.volumeStarted.connect(self.editor.select_strongest)
        self.workspace.volumeStarted.connect(self.plot_memory.settle)
        self.workspace.hintChanged.connect(self.generator.set_hint)
        for source in (
            self.workspace, self.opening, self.files, self.sessions, self.pictures, self.movies,
        ):  # fmt: skip
            source.problem.connect(partial(self._tell, source))
            source.news.connect(self.status.tell)
        self.browser.problem.connect(partial(self._tell, self.browser))
        self.preferences.problem.connect(partial(self.notice.tell, tone="error"))

    def _name_light(self) -> None:
        """Say in which light the reference is drawn, and which one follows once it can."""
        work = self.workspace.reference
        shown, coming = work.settings.lighting, work.wanted.lighting
        follows = "" if coming == shown else LIGHTS[coming]
        samples = STOPS[work.choices.stop].samples if shown == "path" else 0
        self.reference.set_light(LIGHTS[shown], follows, samples)

    @property
    def errors(self) -> list[str]:
        """Errors shown by the two images."""
        clients = (self.generator.client, self.reference.client)
        return [client.error for client in clients if client.error]

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Show what an edit would change while Ctrl or W is held; end what goes on by Escape.

        Alt alone opens the menus where they are folded; a menu bar knows that key itself.
        """
        self._alt_alone = event.key() == Qt.Key.Key_Alt
        if event.key() == Qt.Key.Key_Control:
            self._show_effect(True)
        if event.key() == Qt.Key.Key_W and not event.modifiers():
            if not event.isAutoRepeat():
                self.sensitivity.what_if.start()
        elif not (event.key() == Qt.Key.Key_Escape and self._escape()):
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Show the images again, or where the value under the mouse is visible."""
        if event.key() == Qt.Key.Key_Control:
            self._show_effect(False)
        if event.key() == Qt.Key.Key_Alt and self._alt_alone and self.top_bar.is_folded:
            self.top_bar.open_menus()
        if event.key() == Qt.Key.Key_W and not event.isAutoRepeat():
            self.sensitivity.what_if.end()
        else:
            super().keyReleaseEvent(event)

    def _escape(self) -> bool:
        """End what was begun last, or dismiss the newest notice; return False if there is none."""
        if self.sensitivity.escape():
            return True
        if self.crop_card.is_shown:
            self.crop_card.set_shown(False)
            return True
        # Wherever the focus is: the status line names the key for what is under the mouse.
        return self.browser.escape() or self.notice.dismiss_newest()

    def event(self, event: QEvent) -> bool:
        """Show the keys of what is under the mouse, which Qt tells as its status tip."""
        if isinstance(event, QStatusTipEvent):
            self._hints.show(event.tip())
            return True
        return super().event(event)

    def _show_effect(self, effect: bool) -> None:
        """Show the effect of edits, or where values are visible, at the value under the mouse."""
        band = self.sensitivity_state.band
        if band is not None and not band.pinned:
            self.sensitivity_state.show_effect(effect)

    def changeEvent(self, event: QEvent) -> None:
        """End what is held when another window takes the keys."""
        if event.type() == QEvent.Type.ActivationChange and not self.isActiveWindow():
            self.sensitivity.what_if.end()
        super().changeEvent(event)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take files."""
        if any(url.isLocalFile() for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open files: volumes, models and TFs."""
        event.acceptProposedAction()
        for url in event.mimeData().urls():
            if url.isLocalFile():
                self.opening.open(Path(url.toLocalFile()))

    def closeEvent(self, event: QCloseEvent) -> None:
        """Hide the window at once, then wait for the threads to end."""
        work = (self.pictures, self.movies)
        if self.isVisible() and not may_quit(self, [each.unfinished for each in work]):
            event.ignore()
            return
        self.movies.cancel()
        self.workspace.stop()
        self._memory.note()
        self.hide()
        self.workspace.join()
        self.movies.join()
        self.preferences.finish()
        event.accept()

    def _lay_out(self) -> None:
        for pane in (self.generator, self.reference):
            gestures = ViewGestures(pane.canvas, self.state)
            self.workspace.reference.lightRangeChanged.connect(gestures.set_light_range)
            ViewKeys(pane.canvas, self.state)
        self.setMenuWidget(self.top_bar)
        central = QWidget()
        column = QVBoxLayout(central)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self._splitter)
        self.setCentralWidget(central)
        self.setStatusBar(self.status)
        self.workspace.reference.preparation.progressed.connect(self.status.show_preparation)
        self.setWindowTitle("tfscope")
        self.setAcceptDrops(True)
        self.resize(size_on(self.screen()))

    def _images_and_floating(self) -> QWidget:
        """Return the images, and what floats over them and moves nothing."""
        column = QVBoxLayout(self._images)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.panes)
        self._floating.add_top(self.notice)
        self._floating.add_bottom(self.crop_card)
        self._floating.add_bottom(self.up_axis_card)
        return self._images

    def _arrange(self) -> None:
        """Put cube, tools and cards over the images that are there."""
        images = self.panes.images
        self.reference.set_alone(len(images) == 1)
        self.overlays.lie_over(images[-1].canvas)
        self.tools.lie_over(None if self.panes.is_browsing else images[0].canvas)
        self._floating.set_corner_of(images[-1] if self.panes.is_browsing else None)
        # Tab goes from the bar to the tools, then from image to image.
        tools = self.tools
        chain: list[QWidget] = [self.top_bar.save, tools.rectangle, tools.lasso, tools.crop]
        for pane in images:
            chain += [pane.canvas, pane.caption]
        order_focus(chain)
        self.notice.come_after(chain[-1])

    def _focus_areas(self) -> list[QWidget]:
        """Return the areas of the window that F6 goes through."""
        images = [pane.canvas for pane in self.panes.images]
        dock = [*self.editor.areas, self.sensitivity.findings]
        return [self.top_bar, self.browser, *images, self.crop_card, *dock]

    def _show_browser(self, choices: LatentChoices) -> None:
        """Show the latent browser in the generator's place, or the generator again."""
        self.panes.set_browsing(choices.shown)
        self.browse.setChecked(choices.shown)

    def _show_crop_handles(self, _change: object) -> None:
        # While a region is drawn, the mouse is the drawing's.
        shown = self.crop_card.is_shown and self.sensitivity_state.tool is None
        for handles in self.crop_handles:
            handles.set_active(shown)

    def _show_model(self) -> None:
        """Make room for the generator's image, or give it to the reference."""
        # Until it draws something else, one image is enough.
        self.panes.set_model(self.workspace.model.is_open and not self.workspace.model.awaits_path)
        self.generator.set_drawer(self.workspace.model.who, self.workspace.model.worth)
        self.brightness.set_lighting("learned", self.workspace.model_lighting)
        self.browser.bar.set_model(self.workspace.latent.model is not None)

    def _tell(self, source: QObject, text: str) -> None:
        """Show an error; one about what was tried last replaces the one before."""
        keys = {self.opening: "opening", self.files: "files", self.browser: "browser"}
        self.notice.tell(text, key=keys.get(source, ""), tone="error")

    def _show_range(self, opened: OpenedVolume) -> None:
        self.editor.area.histogram.set_data(opened.counts, opened.edges)
        self.editor.area.set_axis(self.editor.area.axis)

    def _show_scale(self, opened: OpenedVolume) -> None:
        volume = opened.volume
        self.editor.set_scale(
            opened.counts, opened.edges, volume.data_range, volume.units, volume.scale
        )

    def _show_volume(self, opened: OpenedVolume) -> None:
        volume = opened.volume
        shape = " × ".join(str(n) for n in volume.dimensions)
        self.setWindowTitle(f"{volume.name} ({shape}) – tfscope")
        self.top_bar.volume.set_title(volume.name)
        self.top_bar.volume.set_detail(shape)
        self.browser.set_units(volume.units)
        scale = Scale.of(volume, opened.shown)
        self.overlays.start_volume(Subject(volume.units, scale))
        self.tools.setEnabled(True)
        self._hints.start_volume()
        self.files.volume_name = volume.name
        self.crop_card.set_volume(volume.dimensions)
        for handles in self.crop_handles:
            handles.set_volume(volume.dimensions)
        self.plot_memory.start(opened)
        self.editor.set_data(
            opened.counts, opened.edges, volume.data_range, volume.units, volume.scale
        )
