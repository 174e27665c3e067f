"""The parts of the main window, and where they lie."""

from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMainWindow, QSplitter, QVBoxLayout, QWidget

from app.controls import fill, order_focus
from app.engines.client import Clients, EngineClient
from app.engines.engines import Builders
from app.image_view.crop_handles import CropHandles
from app.image_view.engine_pane import EnginePane
from app.image_view.exactness_slider import ExactnessSlider, FidelityLine
from app.image_view.gestures import ViewGestures, ViewKeys
from app.image_view.pane_focus import WipeLine
from app.image_view.reference_controls import ReferenceControls
from app.latent_browser.latent_browser import LatentBrowser
from app.sensitivity_view.sensitivity_view import SensitivityView
from app.state.latent_session import LatentState
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.workspace import Viewing, Workspace
from app.tf_editor.editor import DockSplitter, PlotMemory, TransferFunctionEditor
from app.window.cards import CropCard, EmptyCard, UpAxisCard
from app.window.context import Context
from app.window.figure_saving import FigureSaving
from app.window.files import Files
from app.window.notices import Floating, Notices
from app.window.overlays import ImageError, Overlays
from app.window.pane_layout import PaneLayout
from app.window.presets import Presets
from app.window.ruler import Ruler
from app.window.scene_notices import SceneNotices
from app.window.sessions import Sessions
from app.window.slices import Slices
from app.window.status_line import StatusLine
from app.window.top_bar import ToolStrip, TopBar
from app.window.window_memory import WindowMemory, size_on


class WindowParts(QMainWindow):
    """A window with all of its parts, which `MainWindow` connects."""

    def __init__(self, builders: Builders, preferences: Preferences | None) -> None:
        super().__init__()
        self.preferences = preferences or Preferences(None, self)
        self.state = ViewerState(self)
        self.sensitivity_state = SensitivityState(self)
        self.latent_state = LatentState(self)
        names = "generator", "reference", "analyst"
        generator, reference, analyst = (EngineClient(name, self) for name in names)
        self.brightness = self.state.brightness
        self.generator = EnginePane("Generator", generator, self.brightness, "learned")
        self.reference = EnginePane("Ground truth", reference, self.brightness, "exact")
        self.pane_b = EnginePane(
            "B", reference, self.brightness, "exact", channel=reference.images_b
        )
        self.editor = TransferFunctionEditor(self.state)
        self.notice, self.status = Notices(), StatusLine(self.state, self.sensitivity_state)
        states = self.state, self.sensitivity_state, self.latent_state, self.preferences
        viewing = Viewing(*states)
        clients = Clients(generator, reference, analyst)
        self.workspace = Workspace(viewing, clients, builders, self)
        panes = self.generator, self.reference, self.pane_b
        parts = *states, self, self.workspace, analyst, panes, self.notice, self.status
        self.context = Context(*parts)
        self._build_widgets()
        self._lay_out()
        self._build_layers()
        self._build_actors()

    def _build_widgets(self) -> None:
        work = self.workspace.reference
        self.browser = LatentBrowser(self.state, self.workspace.latent, self.reference, self.editor)
        self.plot_memory = PlotMemory(self.editor.area, self.preferences)
        self.reference_controls = ReferenceControls(self.state, work, self)
        self.exactness = ExactnessSlider(work)
        controls = self.reference_controls
        self.top_bar = TopBar(controls.ball, controls.light, self.exactness)
        self.panes = PaneLayout(self.browser, self.context.panes)
        self.up_axis_card = UpAxisCard(self.context)
        self.crop_card = CropCard(self.state)
        self.tools = ToolStrip(self.sensitivity_state)
        self.tools.setEnabled(False)
        self.reference.caption.hide()

    def _lay_out(self) -> None:
        work = self.workspace.reference
        for pane in self.context.panes:
            gestures = ViewGestures(pane.canvas, self.state)
            work.lightRangeChanged.connect(partial(setattr, gestures, "light_range"))
            ViewKeys(pane.canvas, self.state)
        # The images, and what floats over them.
        images = QWidget()
        fill(QVBoxLayout(images), self.panes)
        self._floating = Floating(images)
        self._floating.add("top", self.notice)
        self._floating.add("bottom", self.crop_card)
        self._floating.add("bottom", self.up_axis_card)
        # Next to the images, the slices.
        row = self.images_and_slices = QSplitter(Qt.Orientation.Horizontal)
        row.setHandleWidth(1)
        row.setChildrenCollapsible(False)
        row.addWidget(images)
        row.setStretchFactor(0, 1)
        self._splitter = DockSplitter(row, self.editor)
        self.slices = Slices(self.context, row, self.editor.area, self.crop_card)
        central = QWidget()
        fill(QVBoxLayout(central), self._splitter)
        self.setMenuWidget(self.top_bar)
        self.setCentralWidget(central)
        self.setStatusBar(self.status)
        self.setWindowTitle("tfscope")
        self.setAcceptDrops(True)
        self.resize(size_on(self.screen()))

    def _build_layers(self) -> None:
        """Stack the overlays on the images, and give them the mouse in order."""
        self.overlays = Overlays(self.context, self.browser.grid)
        self.fidelity = FidelityLine(self.reference, self.state, self.workspace.reference)
        self.fidelity.judged.connect(partial(setattr, self.exactness, "moving"))
        # Before the sensitivities, so that it is below regions.
        self.image_error = ImageError(self.context, self.overlays)
        # After the gestures, so that regions get the mouse first.
        self.sensitivity = SensitivityView(self.workspace, self.context.panes, self.editor, self)
        self.crop_handles = [CropHandles(pane.canvas, self.state) for pane in self.context.panes]
        self.ruler = Ruler(self.context, self.overlays, self.slices)
        # Last, so that a pane has the focus before anything is done there.
        self.wipe = WipeLine(self.state.tf_input, self.reference, self.pane_b)

    def _build_actors(self) -> None:
        """Build the objects that open, save and report."""
        self.memory = WindowMemory(
            self, self._splitter, self.panes, self.state, self.editor.moves, self.preferences
        )
        self.sessions = Sessions(
            self.context, self.overlays, self.memory, self.wipe, self.image_error
        )
        self.files = Files(self.context, self.sessions, self.editor.range.show_small_range)
        self.saving = FigureSaving(self.context, self.overlays, self.image_error, self.sessions)
        self.empty_card = EmptyCard(self.context, self.files)
        Presets(self.editor.menu.presets, self.context)
        self.scene_notices = SceneNotices(self.context, self.editor.range.set_range)

    def arrange(self) -> None:
        """Put cube, tools and cards over the visible images."""
        images = self.panes.images
        self.reference.is_alone = len(images) == 1 and not self.panes.wipes
        self.overlays.lie_over(images[-1].canvas)
        self.tools.lie_over(images[0].canvas)
        self._floating.set_corner_of(images[-1] if self.panes.is_browsing else None)
        # Tab goes from the bar to the tools, then from image to image.
        tools = self.tools
        chain: list[QWidget] = [self.top_bar.save, tools.rectangle, tools.lasso, tools.crop]
        for pane in images:
            chain += [pane.canvas, pane.caption]
        order_focus(chain)
        self.notice.image, self.notice.before = images[0].canvas, chain[-1]

    def areas(self) -> list[QWidget]:
        """Return the areas of the window that F6 goes through."""
        images = [pane.canvas for pane in self.panes.images]
        dock = [*self.editor.areas, self.sensitivity.findings]
        found = [self.top_bar, self.browser, *images, *self.slices.areas, self.crop_card]
        return [*found, *dock]
