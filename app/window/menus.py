"""The menu bar of the window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from PySide6.QtCore import QObject
from PySide6.QtGui import QActionGroup, QKeySequence
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QMainWindow,
    QMenu,
    QTextBrowser,
    QVBoxLayout,
)

from app.controls import add_action
from app.glosses import open_glossary
from app.image_view.engine_pane import EnginePane
from app.image_view.reference_bar import ReferenceBar
from app.sensitivity_view.sensitivity_view import SensitivityView
from app.state.latent_state import LatentState
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.tf_editor.editor import TransferFunctionEditor
from app.window.crop_bar import CropBar
from app.window.file_dialogs import FileDialogs
from app.window.file_opening import FileOpening
from app.window.movie_saving import MovieSaving
from app.window.overlays import Overlays
from app.window.pane_layout import PaneLayout, Shown
from app.window.picture_saving import PictureSaving
from app.window.recent_menu import RecentMenus
from app.window.sample_menus import SampleMenus
from model.scene.axes import AXES
from model.scene.orientation import STANDARD_VIEWS

TEXT_WIDTH = 620
"""Width of the help's texts, in pixels."""

IMAGES: dict[str, Shown] = {
    "Both": "both",
    "Model alone": "generator",
    "Reference alone": "reference",
}
"""Images to show, by their menu entries."""

ABOUT = """<h3>tfscope</h3>
<p>Look into volumes through transfer functions, beside a generative model of
their renderings.</p>
<p>After M. Berger, J. Li and J. A. Levine, <i>A Generative Model for Volume
Rendering</i>, IEEE TVCG 2018. The reference images are rendered by VTK
or by tfscope's own ray caster.</p>
<p>BSD 3-Clause licence.</p>"""

GESTURES = """<h3>Images</h3>
<table cellspacing="6">
<tr><td>Drag, or arrow keys</td><td>turn</td></tr>
<tr><td>Right drag, or Ctrl and drag; Page up, down</td><td>roll</td></tr>
<tr><td>Middle drag, or Shift and drag; Ctrl and arrow keys</td><td>pan</td></tr>
<tr><td>Wheel, or + and −</td><td>come closer to what is under the mouse, move away</td></tr>
<tr><td>Double click, or Home</td><td>return to the first view</td></tr>
<tr><td>Alt and arrow keys</td><td>the view before, the view after</td></tr>
<tr><td>Click a face of the cube</td><td>look from there; drag it to turn</td></tr>
<tr><td>Drag a round handle of the crop box (Ctrl+K)</td><td>move that plane</td></tr>
<tr><td>O</td><td>the opacity images</td></tr>
<tr><td>Drag in the ball above a lit image, or Ctrl, Shift and drag</td><td>move the light</td></tr>
</table>
<h3>Sensitivity</h3>
<table cellspacing="6">
<tr><td>R, then drag in an image</td><td>draw a rectangle (L: a lasso)</td></tr>
<tr><td>Drag its edge or corner</td><td>move or resize it</td></tr>
<tr><td>Click in an image</td><td>which values show there?</td></tr>
<tr><td>Hover over the opacity curve</td><td>where is this value visible?</td></tr>
<tr><td>With Ctrl, or in What if</td><td>what would an edit there change?</td></tr>
<tr><td>Wheel over the curve</td><td>width of the band</td></tr>
<tr><td>Drag beside the handles</td><td>keep a band of several values</td></tr>
<tr><td>P</td><td>keep the value under the mouse</td></tr>
<tr><td>Escape, or click beside the handles</td><td>return to the images</td></tr>
<tr><td>Click a numbered flag</td><td>add a mode there</td></tr>
<tr><td>Hold W</td><td>what would a mode there change?</td></tr>
</table>
<h3>Map of TFs (Ctrl+B)</h3>
<table cellspacing="6">
<tr><td>Move the mouse over the map</td><td>picture and TF of that place</td></tr>
<tr><td>Click</td><td>make it the TF</td></tr>
<tr><td>D</td><td>a model's pictures of decoded TFs, or of the codes</td></tr>
<tr><td>Drag in the rectangle, at its edges</td><td>move it, resize it</td></tr>
<tr><td>Drag beside it, or with Shift</td><td>draw a new one</td></tr>
<tr><td>Wheel over the map</td><td>come closer, until thumbnails appear</td></tr>
<tr><td>Middle drag, or Ctrl and drag</td><td>move the map</td></tr>
<tr><td>Wheel over a picture of the grid</td><td>divide that cell; return</td></tr>
<tr><td>Home, Escape</td><td>the whole map; stop what is running</td></tr>
</table>
<h3>Transfer function</h3>
<table cellspacing="6">
<tr><td>Drag a mode's peak</td><td>its value and opacity</td></tr>
<tr><td>Drag a square at its side</td><td>its width</td></tr>
<tr><td>Double click beside the handles</td><td>add a mode</td></tr>
<tr><td>Drag a line at an end of the range</td><td>stretch the TF (with Ctrl: cut it)</td></tr>
<tr><td>Ctrl and wheel, middle drag; Home</td><td>zoom and move the axis; all of it</td></tr>
<tr><td>Click the colour strip</td><td>add a colour stop</td></tr>
<tr><td>Double click a colour stop</td><td>choose its colour</td></tr>
<tr><td>Arrow keys, faster with Shift</td><td>nudge the selection</td></tr>
<tr><td>Delete</td><td>remove the selection</td></tr>
<tr><td>T</td><td>the TF decoded from the model's code</td></tr>
</table>"""


@dataclass(frozen=True)
class WindowParts:
    """Parts of the window that menus act on.

    Attributes
    ----------
    opening : FileOpening
    files : FileDialogs
    pictures : PictureSaving
    movies : MovieSaving
    state : ViewerState
    workspace : Workspace
    preferences : Preferences
    generator, reference : EnginePane
    bar : ReferenceBar
    panes : PaneLayout
    overlays : Overlays
    crop : CropBar
    editor : TransferFunctionEditor
    sensitivity : SensitivityState
    view : SensitivityView
    latent : LatentState
    """

    opening: FileOpening
    files: FileDialogs
    pictures: PictureSaving
    movies: MovieSaving
    state: ViewerState
    workspace: Workspace
    preferences: Preferences
    generator: EnginePane
    reference: EnginePane
    bar: ReferenceBar
    panes: PaneLayout
    overlays: Overlays
    crop: CropBar
    editor: TransferFunctionEditor
    sensitivity: SensitivityState
    view: SensitivityView
    latent: LatentState


class Menus(QObject):
    """Builds the menus and performs their actions.

    Parameters
    ----------
    window : QMainWindow
        The window of the menu bar.
    parts : WindowParts
    """

    def __init__(self, window: QMainWindow, parts: WindowParts) -> None:
        super().__init__(window)
        self._window = window
        self._parts = parts
        self._state = parts.state
        self._recent = RecentMenus(parts.opening, parts.workspace, parts.preferences)
        self._build_file(self._menu("&File"))
        self._build_edit(self._menu("&Edit"))
        self._build_view(self._menu("&View"))
        self._build_sensitivity(self._menu("&Sensitivity"))
        self._build_help(self._menu("&Help"))

    def _menu(self, title: str) -> QMenu:
        return self._window.menuBar().addMenu(title)

    def _build_file(self, menu: QMenu) -> None:
        files, recent = self._parts.files, self._recent
        samples = SampleMenus(self._parts.opening, self._parts.workspace)
        keys = QKeySequence.StandardKey
        add_action(menu, "Open &volume…", files.open_volume, keys.Open)
        add_action(menu, "Open &DICOM folder…", files.open_dicom)
        samples.add_volumes(menu)
        recent.add_recent(menu, "volumes")
        self._add_volume(menu)
        menu.addSeparator()
        add_action(menu, "Open &model…", files.open_model, "Ctrl+M")
        samples.add_models(menu)
        recent.add_models(menu)
        recent.add_recent(menu, "models")
        menu.addSeparator()
        add_action(menu, "Open &transfer function…", files.open_transfer_function, "Ctrl+T")
        add_action(menu, "&Save transfer function as…", files.save_transfer_function, keys.Save)
        recent.add_recent(menu, "transfer_functions")
        menu.addSeparator()
        self._add_pictures(menu)
        menu.addSeparator()
        add_action(menu, "&Quit", self._window.close, "Ctrl+Q")

    def _add_volume(self, menu: QMenu) -> None:
        """Add what there is to know of the open volume and its file."""
        opening, workspace = self._parts.opening, self._parts.workspace
        others = add_action(menu, "Other &volumes in this file…", opening.ask_for_content)
        about = add_action(menu, "Volume p&roperties…", opening.show_properties, "Ctrl+I")

        def enable() -> None:
            opened = workspace.opened
            about.setEnabled(opened is not None)
            others.setEnabled(opened is not None and bool(opened.volume.file.contents))

        workspace.volumeStarted.connect(enable)
        enable()

    def _add_pictures(self, menu: QMenu) -> None:
        pictures, movies = self._parts.pictures, self._parts.movies
        add_action(menu, "Save &figure…", pictures.save, "Ctrl+Shift+S")
        add_action(menu, "&Copy figure…", pictures.copy, "Ctrl+Shift+C")
        add_action(menu, "Save mo&vie…", movies.save)

    def _build_edit(self, menu: QMenu) -> None:
        state = self._state
        stack = state.undo_stack
        self._undo = add_action(menu, "&Undo", state.undo, QKeySequence.StandardKey.Undo)
        self._redo = add_action(menu, "&Redo", state.redo, QKeySequence.StandardKey.Redo)
        # Both of the usual keys, whatever the system's own is.
        usual = [*QKeySequence.keyBindings(QKeySequence.StandardKey.Redo), QKeySequence("Ctrl+Y")]
        self._redo.setShortcuts(list(dict.fromkeys(usual)))
        self._undo.setEnabled(False)
        self._redo.setEnabled(False)
        stack.canUndoChanged.connect(self._undo.setEnabled)
        stack.canRedoChanged.connect(self._redo.setEnabled)
        menu.aboutToShow.connect(self._name_edits)
        menu.addSeparator()
        add_action(menu, "Reset &transfer function", state.reset_transfer_function)

    def _name_edits(self) -> None:
        """Update the menu with the names of the edits to undo and redo."""
        stack = self._state.undo_stack
        self._undo.setText(f"&Undo {stack.undoText()}".rstrip())
        self._redo.setText(f"&Redo {stack.redoText()}".rstrip())

    def _build_view(self, menu: QMenu) -> None:
        latent, bar, panes = self._parts.latent, self._parts.bar, self._parts.panes
        browse = add_action(
            menu, "&Browse TFs", lambda: latent.choose(shown=not latent.choices.shown), "Ctrl+B"
        )
        browse.setCheckable(True)
        latent.choicesChanged.connect(lambda choices: browse.setChecked(choices.shown))
        decoded = add_action(menu, "Draw &decoded TFs on the map", self._toggle_decoded, "D")
        decoded.setCheckable(True)

        def show_decoded() -> None:
            pictures = self._parts.workspace.latent.pictures
            decoded.setEnabled(pictures.has_own_codes and latent.choices.shown)
            decoded.setChecked(latent.choices.drawn == "tf")

        latent.choicesChanged.connect(lambda _choices: show_decoded())
        self._parts.workspace.modelChanged.connect(show_decoded)
        show_decoded()
        menu.addSeparator()
        self._build_camera(menu)
        menu.addSeparator()
        bar.fill_light(menu.addMenu("&Light of the reference"))
        bar.fill_quality(menu.addMenu("&Quality of the reference"))
        bar.fill_drawing(menu.addMenu("Reference &drawn by"))
        menu.addSeparator()
        crop, overlays = self._parts.crop, self._parts.overlays
        cropping = add_action(
            menu, "&Crop box", lambda: crop.set_shown(not crop.is_shown), "Ctrl+K"
        )
        cropping.setCheckable(True)
        crop.shownChanged.connect(cropping.setChecked)
        workspace = self._parts.workspace
        missing = add_action(
            menu,
            "Draw &missing voxels",
            lambda: workspace.draw_missing(not workspace.draws_missing),
        )
        missing.setCheckable(True)

        def show_missing(*_: object) -> None:
            missing.setEnabled(workspace.has_missing)
            missing.setChecked(workspace.draws_missing)

        for changed in (workspace.volumeStarted, workspace.rangeChanged):
            changed.connect(show_missing)
        show_missing()
        cube = add_action(menu, "&Orientation cube", overlays.toggle_cube)
        legend = add_action(menu, "Colour l&egend", overlays.toggle_legend, "Ctrl+L")
        scale_bar = add_action(menu, "&Scale bar", overlays.toggle_scale_bar, "Ctrl+Shift+L")
        opacity = add_action(menu, "Opac&ity images", overlays.toggle_opacity, "O")
        through_code = add_action(
            menu, "TF &decoded from its code", overlays.toggle_decoded_tf, "T"
        )
        through_code.setToolTip(
            "What the model's codec makes of the TF, as the paper's networks do"
        )

        def show_overlays() -> None:
            cube.setChecked(overlays.has_cube)
            legend.setChecked(overlays.has_legend)
            scale_bar.setChecked(overlays.has_scale_bar)
            opacity.setChecked(overlays.has_opacity)
            through_code.setChecked(overlays.has_decoded_tf)
            through_code.setEnabled(self._parts.workspace.decoded.fits)

        for action in (cube, legend, scale_bar, opacity, through_code):
            action.setCheckable(True)
        self._parts.workspace.modelChanged.connect(show_overlays)
        overlays.changed.connect(show_overlays)
        show_overlays()
        menu.addSeparator()
        self._choices(menu.addMenu("&Images"), IMAGES, panes.show_images)
        editor = self._parts.editor
        # Not remembered: whoever misses it finds it again at the next start.
        editing = add_action(menu, "&TF editor", lambda: editor.setVisible(editor.isHidden()), "F9")
        editing.setCheckable(True)
        menu.aboutToShow.connect(lambda: editing.setChecked(not editor.isHidden()))
        add_action(menu, "S&wap the images", panes.swap, "Ctrl+Shift+X")
        full = add_action(menu, "&Full screen", self._toggle_full_screen, "F11")
        full.setCheckable(True)

    def _toggle_decoded(self) -> None:
        latent = self._parts.latent
        latent.choose(drawn="code" if latent.choices.drawn == "tf" else "tf")

    def _build_camera(self, menu: QMenu) -> None:
        state = self._state
        back = add_action(menu, "&Previous view", state.undo_view, "Alt+Left")
        forth = add_action(menu, "&Next view", state.redo_view, "Alt+Right")

        def show_history() -> None:
            back.setEnabled(state.can_undo_view)
            forth.setEnabled(state.can_redo_view)

        state.viewHistoryChanged.connect(show_history)
        show_history()
        add_action(menu, "&Reset view", state.reset_view, "Ctrl+0")
        add_action(menu, "See the w&hole volume", state.view_whole, "Ctrl+9")
        sides = menu.addMenu("Look &from")
        for number, name in enumerate(STANDARD_VIEWS, start=1):
            add_action(sides, name, partial(state.look_from, name), f"Ctrl+{number}")
        self._build_up_axes(menu.addMenu("&Up axis"))
        free = add_action(
            menu, "&Turn freely", lambda: state.set_trackball(not state.trackball), "Ctrl+Shift+T"
        )
        free.setCheckable(True)
        free.setChecked(state.trackball)
        state.navigationChanged.connect(lambda: free.setChecked(state.trackball))

    def _build_up_axes(self, menu: QMenu) -> None:
        state = self._state
        group = QActionGroup(self)
        actions = {}
        for axis in AXES:
            action = add_action(menu, axis.replace("-", "−"), partial(state.set_up_axis, axis))
            action.setCheckable(True)
            group.addAction(action)
            actions[axis] = action
        state.navigationChanged.connect(lambda: actions[state.up_axis].setChecked(True))
        actions[state.up_axis].setChecked(True)

    def _toggle_full_screen(self) -> None:
        window = self._window
        window.showNormal() if window.isFullScreen() else window.showFullScreen()

    def _build_sensitivity(self, menu: QMenu) -> None:
        sensitivity, view = self._parts.sensitivity, self._parts.view
        shown = add_action(
            menu,
            "&Show sensitivity",
            lambda: sensitivity.choose(shown=not sensitivity.choices.shown),
            "Ctrl+E",
        )
        shown.setCheckable(True)
        shown.setChecked(True)
        sensitivity.choicesChanged.connect(lambda choices: shown.setChecked(choices.shown))
        menu.addSeparator()
        add_action(menu, "Draw &rectangle", lambda: sensitivity.set_tool("rectangle"), "R")
        add_action(menu, "Draw &lasso", lambda: sensitivity.set_tool("lasso"), "L")
        add_action(menu, "R&emove region", sensitivity.remove_region, "Shift+Delete")
        add_action(menu, "&Whole image", lambda: sensitivity.activate(None))
        menu.addSeparator()
        add_action(menu, "&Pin the band of values", view.findings.field_bar.toggle_pin, "P")
        menu.addSeparator()
        add_action(
            menu, "Save &sensitivity as…", lambda: self._parts.files.save_sensitivity(view.result())
        )

    def _choices(
        self, menu: QMenu, choices: dict[str, Any], choose: Callable[[Any], object]
    ) -> None:
        """Add exclusive choices to a menu, with the first one checked."""
        group = QActionGroup(self)
        for number, (name, choice) in enumerate(choices.items()):
            action = add_action(menu, name, partial(choose, choice))
            action.setCheckable(True)
            action.setChecked(number == 0)
            group.addAction(action)

    def _build_help(self, menu: QMenu) -> None:
        add_action(menu, "&Gestures", lambda: self._show_text("Gestures", GESTURES), "F1")
        add_action(menu, "G&lossary", lambda: open_glossary(self._window))
        add_action(menu, "&About tfscope", lambda: self._show_text("About tfscope", ABOUT))

    def _show_text(self, title: str, text: str) -> None:
        box = QDialog(self._window)
        box.setWindowTitle(title)
        page = QTextBrowser()
        page.setHtml(text)
        page.setOpenExternalLinks(True)
        close = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        close.rejected.connect(box.reject)
        column = QVBoxLayout(box)
        column.addWidget(page)
        column.addWidget(close)
        # As high as its text, unless the window is lower: then it scrolls.
        page.document().setTextWidth(TEXT_WIDTH)
        height = round(page.document().size().height()) + 90
        box.resize(TEXT_WIDTH + 60, min(height, self._window.height()))
        box.finished.connect(box.deleteLater)
        box.open()
