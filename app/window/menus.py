"""The menu bar of the window."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from PySide6.QtCore import QObject
from PySide6.QtGui import QAction, QActionGroup, QKeySequence
from PySide6.QtWidgets import QApplication, QMainWindow, QMenu

from app.caption_button import CaptionButton
from app.controls import add_action
from app.glosses import open_glossary
from app.image_view.engine_pane import EnginePane
from app.image_view.reference_controls import ReferenceControls
from app.menu_tips import show_tips
from app.sensitivity_view.sensitivity_view import SensitivityView
from app.state.latent_state import LatentState
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.settings import BackgroundChoice, ThemeChoice
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.tf_editor.editor import TransferFunctionEditor
from app.theme import apply_theme
from app.window.crop_card import CropCard
from app.window.file_dialogs import FileDialogs
from app.window.file_menus import RecentMenus, SampleMenus
from app.window.file_opening import FileOpening
from app.window.help_pages import show_gestures, show_page
from app.window.image_error import ImageError
from app.window.movie_saving import MovieSaving
from app.window.overlays import BACKGROUNDS, Overlays
from app.window.pane_layout import PaneLayout, Shown
from app.window.picture_saving import PictureSaving
from app.window.sessions import Sessions
from app.window.top_bar import TopBar, show_action
from model.scene.axes import AXES
from model.scene.orientation import STANDARD_VIEWS


@dataclass(frozen=True)
class WindowParts:
    """Parts of the window that menus act on."""

    opening: FileOpening
    files: FileDialogs
    pictures: PictureSaving
    movies: MovieSaving
    sessions: Sessions
    state: ViewerState
    workspace: Workspace
    preferences: Preferences
    generator: EnginePane
    reference: EnginePane
    bar: TopBar
    controls: ReferenceControls
    error: ImageError
    panes: PaneLayout
    overlays: Overlays
    crop: CropCard
    editor: TransferFunctionEditor
    sensitivity: SensitivityState
    view: SensitivityView
    latent: LatentState


class SingleKeys(QObject):
    """Takes the keys that are letters alone from all entries of menus, or gives them back.

    Parameters
    ----------
    window : QObject
        Has the entries.
    """

    def __init__(self, window: QObject, preferences: Preferences) -> None:
        super().__init__(window)
        self._window = window
        self._preferences = preferences
        self._all: dict[QAction, list[QKeySequence]] = {}

    @property
    def are_on(self) -> bool:
        """Whether letters alone are keys."""
        return self._preferences.settings.single_keys

    def toggle(self) -> None:
        """Switch them off, or on again, and remember that."""
        self._preferences.set(single_keys=not self.are_on)
        self.keep()

    def keep(self) -> None:
        """Have all entries that there are keep to the choice."""
        for action in self._window.findChildren(QAction):
            keys = self._all.setdefault(action, action.shortcuts())
            if any(_is_letter(key) for key in keys):
                action.setShortcuts([key for key in keys if self.are_on or not _is_letter(key)])


def _is_letter(keys: QKeySequence) -> bool:
    """Whether a shortcut is a letter alone."""
    return len(keys.toString()) == 1


def fill_captions(generator: CaptionButton, reference: CaptionButton, panes: PaneLayout) -> None:
    """Offer to see one of the images alone, and what the generator's error means."""
    menu = _add_alone(generator, panes, "generator")
    _add_alone(reference, panes, "reference")
    explain = partial(open_glossary, generator.window(), "RMSE")
    add_action(menu, "What is the error (RMSE)?", explain)


def _add_alone(caption: CaptionButton, panes: PaneLayout, shown: Shown) -> QMenu:
    """Add an entry that shows one image alone, or both again."""
    menu = caption.add_menu()
    alone = add_action(
        menu,
        "Show alone",
        lambda: panes.show_images("both" if panes.shown == shown else shown),
    )
    alone.setCheckable(True)

    def show_state() -> None:
        # Of one image, there is nothing to choose.
        caption.set_menu(menu if panes.can_compare else None)
        alone.setChecked(panes.can_compare and panes.shown == shown)

    panes.arranged.connect(show_state)
    show_state()
    return menu


THEMES: dict[ThemeChoice, str] = {"system": "As the s&ystem", "dark": "&Dark", "light": "&Light"}
"""Colours of the window, by their menu entries."""

ABOUT = """<h3>tfscope</h3>
<p>Volume rendering with transfer functions, next to a generative model of the
renderings.</p>
<p>After M. Berger, J. Li and J. A. Levine, <i>A Generative Model for Volume
Rendering</i>, IEEE TVCG 2018. The ground truth is rendered by VTK or by
 tfscope's own ray caster.</p>
<p>BSD 3-Clause licence.</p>"""


class Menus(QObject):
    """Builds the menus and performs their actions.

    Parameters
    ----------
    window : QMainWindow
        The window of the menu bar.
    """

    def __init__(self, window: QMainWindow, parts: WindowParts) -> None:
        super().__init__(window)
        self._window = window
        self._parts = parts
        self._state = parts.state
        self._single_keys = SingleKeys(window, parts.preferences)
        self._recent = RecentMenus(parts.opening, parts.workspace, parts.preferences)
        self._build_file(self._menu("&File"))
        self._build_edit(self._menu("&Edit"))
        self._build_view(self._menu("&View"))
        self._build_region(self._menu("&Region"))
        self._build_help(self._menu("&Help"))
        fill_captions(parts.generator.caption, parts.reference.caption, parts.panes)
        self._single_keys.keep()

    def _menu(self, title: str) -> QMenu:
        menu = self._parts.bar.menu_bar.addMenu(title)
        show_tips(menu)
        return menu

    def _build_file(self, menu: QMenu) -> None:
        files, recent = self._parts.files, self._recent
        samples = SampleMenus(self._parts.opening, self._parts.workspace)
        keys = QKeySequence.StandardKey
        add_action(menu, "&Open…", files.open_volume, keys.Open)
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
        add_action(menu, "Open &TF…", files.open_transfer_function, "Ctrl+T")
        add_action(menu, "&Save TF…", files.save_transfer_function, keys.Save)
        recent.add_recent(menu, "transfer_functions")
        menu.addSeparator()
        add_action(menu, "Save sess&ion…", self._parts.sessions.ask_and_save, "Ctrl+Alt+S")
        recent.add_recent(menu, "sessions")
        menu.addSeparator()
        self._add_pictures(menu)
        menu.addSeparator()
        add_action(menu, "&Quit", self._window.close, "Ctrl+Q")

    def _add_volume(self, menu: QMenu) -> None:
        """Add what there is to know of the open volume and its file."""
        opening, workspace = self._parts.opening, self._parts.workspace
        others = add_action(menu, "Other &volumes in this file…", opening.ask_for_content)
        about = add_action(menu, "P&roperties…", opening.show_properties, "Ctrl+I")

        def enable() -> None:
            opened = workspace.opened
            about.setEnabled(opened is not None)
            others.setEnabled(opened is not None and bool(opened.volume.file.contents))

        workspace.volumeStarted.connect(enable)
        enable()

    def _add_pictures(self, menu: QMenu) -> None:
        pictures, movies = self._parts.pictures, self._parts.movies
        save = add_action(menu, "Save &figure…", pictures.save, "Ctrl+Shift+S")
        self._parts.bar.save.clicked.connect(lambda _checked=False: save.trigger())
        add_action(menu, "&Copy figure…", pictures.copy, "Ctrl+Shift+C")
        add_action(menu, "Save mo&vie…", movies.save)

    def _build_edit(self, menu: QMenu) -> None:
        state = self._state
        stack = state.edits.stack
        self._undo = add_action(menu, "&Undo", state.edits.undo, QKeySequence.StandardKey.Undo)
        self._redo = add_action(menu, "&Redo", state.edits.redo, QKeySequence.StandardKey.Redo)
        # Both of the usual keys, whatever the system's own is.
        usual = [*QKeySequence.keyBindings(QKeySequence.StandardKey.Redo), QKeySequence("Ctrl+Y")]
        self._redo.setShortcuts(list(dict.fromkeys(usual)))
        self._undo.setEnabled(False)
        self._redo.setEnabled(False)
        stack.canUndoChanged.connect(self._undo.setEnabled)
        stack.canRedoChanged.connect(self._redo.setEnabled)
        menu.aboutToShow.connect(self._name_edits)

    def _name_edits(self) -> None:
        """Update the menu with the names of the edits to undo and redo."""
        stack = self._state.edits.stack
        self._undo.setText(f"&Undo {stack.undoText()}".rstrip())
        self._redo.setText(f"&Redo {stack.redoText()}".rstrip())

    def _build_view(self, menu: QMenu) -> None:
        controls = self._parts.controls
        self._build_comparison(menu)
        self._add_browsing(menu)
        menu.addSeparator()
        self._build_camera(menu)
        menu.addSeparator()
        controls.fill_size(menu.addMenu("&Size of the ground truth"))
        controls.fill_drawing(menu.addMenu("Ren&derer of the ground truth"))
        menu.addSeparator()
        self._add_contents(menu)
        self._add_overlays(menu)
        menu.addSeparator()
        editor = self._parts.editor
        # Not remembered: whoever misses it finds it again at the next start.
        editing = add_action(menu, "&TF editor", lambda: editor.setVisible(editor.isHidden()), "F9")
        editing.setCheckable(True)
        menu.aboutToShow.connect(lambda: editing.setChecked(not editor.isHidden()))
        full = add_action(menu, "&Full screen", self._toggle_full_screen, "F11")
        full.setCheckable(True)
        menu.addSeparator()
        self._build_backgrounds(menu.addMenu("Back&ground"))
        self._build_themes(menu.addMenu("&Theme"))
        single = add_action(menu, "Single-&key shortcuts", self._single_keys.toggle)
        single.setCheckable(True)
        single.setChecked(self._single_keys.are_on)

    def _add_browsing(self, menu: QMenu) -> None:
        latent = self._parts.latent
        browse = add_action(
            menu, "&Browse TFs", lambda: latent.choose(shown=not latent.choices.shown)
        )
        browse.setShortcuts([QKeySequence("B"), QKeySequence("Ctrl+B")])
        browse.setCheckable(True)
        latent.choicesChanged.connect(lambda choices: browse.setChecked(choices.shown))
        show_action(self._parts.bar.browse, browse)

    def _add_contents(self, menu: QMenu) -> None:
        """Add what of the volume is shown: a part of it, and missing voxels."""
        crop = self._parts.crop
        cropping = add_action(menu, "&Crop", lambda: crop.set_shown(not crop.is_shown))
        cropping.setShortcuts([QKeySequence("K"), QKeySequence("Ctrl+K")])
        cropping.setCheckable(True)
        crop.shownChanged.connect(cropping.setChecked)
        workspace = self._parts.workspace
        missing = add_action(
            menu,
            "Draw &missing voxels",
            lambda: workspace.opening.draw_missing(not missing_are_drawn()),
        )
        missing.setCheckable(True)

        def missing_are_drawn() -> bool:
            return workspace.opened is not None and workspace.opened.volume.draws_missing

        def show_missing(*_: object) -> None:
            missing.setEnabled(workspace.opened is not None and workspace.opened.has_missing)
            missing.setChecked(missing_are_drawn())

        for changed in (workspace.volumeStarted, workspace.rangeChanged):
            changed.connect(show_missing)
        show_missing()

    def _add_overlays(self, menu: QMenu) -> None:
        overlays = self._parts.overlays
        cube = add_action(menu, "&Orientation cube", overlays.toggle_cube)
        legend = add_action(menu, "Colour l&egend", overlays.toggle_legend, "Ctrl+L")
        scale_bar = add_action(menu, "&Scale bar", overlays.toggle_scale_bar, "Ctrl+Shift+L")
        opacity = add_action(menu, "Opac&ity images", overlays.toggle_opacity, "O")

        def show_overlays() -> None:
            cube.setChecked(overlays.has_cube)
            legend.setChecked(overlays.has_legend)
            scale_bar.setChecked(overlays.has_scale_bar)
            opacity.setChecked(overlays.has_opacity)

        for action in (cube, legend, scale_bar, opacity):
            action.setCheckable(True)
        overlays.changed.connect(show_overlays)
        show_overlays()

    def _build_backgrounds(self, menu: QMenu) -> None:
        overlays, group = self._parts.overlays, QActionGroup(self)
        actions: dict[BackgroundChoice, QAction] = {}
        for choice in BACKGROUNDS:
            choose = partial(overlays.choose_background, choice)
            actions[choice] = add_action(menu, f"&{choice.capitalize()}", choose)
            actions[choice].setCheckable(True)
            group.addAction(actions[choice])

        def show() -> None:
            actions[self._parts.preferences.settings.background].setChecked(True)

        overlays.changed.connect(show)
        show()

    def _build_comparison(self, menu: QMenu) -> None:
        """Add what is shown of the two images."""
        panes, error, bar = self._parts.panes, self._parts.error, self._parts.bar
        compare = add_action(menu, "&Compare", panes.toggle_compare, "C")
        difference = add_action(
            menu, "D&ifference", lambda: error.set_wanted(difference.isChecked()), "D"
        )

        def show_images() -> None:
            for action in (compare, difference, swap):
                action.setVisible(panes.can_compare)
            bar.show_comparison(panes.can_compare)
            compare.setEnabled(panes.can_compare)
            compare.setChecked(len(panes.images) > 1)
            difference.setEnabled(len(panes.images) > 1)
            swap.setEnabled(len(panes.images) > 1)

        swap = add_action(menu, "S&wap sides", panes.swap, "Ctrl+Shift+X")
        for action in (compare, difference):
            action.setCheckable(True)
        panes.arranged.connect(show_images)
        show_images()
        show_action(bar.compare, compare)
        show_action(bar.difference, difference)
        menu.addSeparator()

    def _build_themes(self, menu: QMenu) -> None:
        preferences, group = self._parts.preferences, QActionGroup(self)

        def choose(theme: ThemeChoice) -> None:
            preferences.set(theme=theme)
            application = QApplication.instance()
            assert isinstance(application, QApplication)
            apply_theme(application, theme)

        for theme, text in THEMES.items():
            action = add_action(menu, text, partial(choose, theme))
            action.setCheckable(True)
            action.setChecked(theme == preferences.settings.theme)
            group.addAction(action)

    def _build_camera(self, menu: QMenu) -> None:
        state = self._state
        add_action(menu, "&Reset view", state.reset_view, "Ctrl+0")
        add_action(menu, "Zoom to f&it", state.view_whole, "Ctrl+9")
        sides = menu.addMenu("&From")
        for number, name in enumerate(STANDARD_VIEWS, start=1):
            add_action(sides, name, partial(state.look_from, name), f"Ctrl+{number}")
        self._build_up_axes(menu.addMenu("&Up"))
        free = add_action(
            menu, "&Free rotation", lambda: state.set_trackball(not state.trackball), "Ctrl+Shift+T"
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

    def _build_region(self, menu: QMenu) -> None:
        sensitivity, view = self._parts.sensitivity, self._parts.view
        shown = add_action(
            menu,
            "&Guidance",
            lambda: sensitivity.choose(shown=not sensitivity.choices.shown),
            "Ctrl+E",
        )
        shown.setCheckable(True)
        shown.setChecked(True)
        sensitivity.changed.connect(lambda _what: shown.setChecked(sensitivity.choices.shown))
        menu.addSeparator()
        add_action(menu, "&Rectangle", lambda: sensitivity.set_tool("rectangle"), "R")
        add_action(menu, "&Lasso", lambda: sensitivity.set_tool("lasso"), "L")
        add_action(menu, "R&emove region", sensitivity.remove_region, "Shift+Delete")
        add_action(menu, "&Whole image", lambda: sensitivity.activate(None))
        menu.addSeparator()
        add_action(menu, "&Pin the band of values", view.toggle_pin, "P")
        menu.addSeparator()
        add_action(
            menu, "Save &sensitivity as…", lambda: self._parts.files.save_sensitivity(view.result())
        )

    def _build_help(self, menu: QMenu) -> None:
        window = self._window
        add_action(menu, "&Keys and gestures", partial(show_gestures, window), "F1")
        add_action(menu, "G&lossary", lambda: open_glossary(window))
        add_action(menu, "&About tfscope", partial(show_page, window, "About tfscope", ABOUT))
