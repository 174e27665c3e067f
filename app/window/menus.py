"""The menus, and the actions of the buttons in the top bar."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtGui import QAction, QActionGroup, QIcon, QKeySequence
from PySide6.QtWidgets import QMenu

from app.caption_button import CaptionButton
from app.controls import add_action
from app.glosses import open_glossary
from app.icons import IconButton
from app.menu_tips import show_tips
from app.state.library import KnownModel
from app.state.settings import RecentKind
from app.window.help_pages import show_about, show_gestures
from app.window.overlays import BACKGROUNDS, Overlay
from app.window.pane_layout import PaneLayout, Shown
from app.window.settings_dialog import SettingsDialog, apply_single_keys
from app.window.window_parts import WindowParts
from model.scene.orientation import STANDARD_VIEWS
from model.scene.view import AXES
from model.volume_files.shipped import picture_of, shipped_volumes, title_of

PICTURE = 64
"""Side of a sample's picture, in pixels."""

RECENT: dict[RecentKind, str] = {
    "volumes": "&Recent volumes",
    "models": "&Recent networks",
    "transfer_functions": "Recent tra&nsfer functions",
    "sessions": "Recent s&essions",
}

OVERLAYS: tuple[tuple[Overlay, str, str], ...] = (
    ("legend", "Colour l&egend", "Ctrl+L"),
    ("scale_bar", "&Scale bar", "Ctrl+Shift+L"),
    ("opacity_images", "Opac&ity images", "O"),
)


NO_MODEL = (
    "To compare, open a model of this volume: Help > The paper's networks lists models; the "
    "command train makes one."
)


def build_menus(window: WindowParts) -> None:
    """Fill the menu bar, and have the buttons of the top bar act."""
    for title, fill in (
        ("&File", _fill_file), ("&View", _fill_view), ("&Region", _fill_region),
        ("&Help", _fill_help),
    ):  # fmt: skip
        menu = window.top_bar.menu_bar.addMenu(title)
        show_tips(menu)
        fill(window, menu)
    window.top_bar.take_menus()
    _connect_bar(window)
    menu = _add_alone(window.generator.caption, window.panes, "generator")
    add_action(menu, "What is the error (RMSE)?", lambda: open_glossary(window, "RMSE"))
    _add_alone(window.reference.caption, window.panes, "reference")
    apply_single_keys(window, window.preferences.settings.single_keys)


def _connect_bar(window: WindowParts) -> None:
    """Have each button of the bar do what its action does, whose keys work everywhere."""
    bar, panes, crop = window.top_bar, window.panes, window.crop_card
    latent, error, model = window.latent_state, window.image_error, window.workspace.model

    def act(button: IconButton, slot: Callable[[], object], *keys: str) -> QAction:
        action = QAction(button.accessibleName(), window)
        action.setCheckable(button.isCheckable())
        action.setShortcuts([QKeySequence(key) for key in keys])
        action.triggered.connect(lambda _checked=False: slot())
        window.addAction(action)
        _show_action(button, action)
        return action

    def follows() -> bool:
        """Whether there are two images, or will be; say what is in the way."""
        if panes.is_browsing:
            window.status.say("The map of TFs is in the place of the second image. B closes it.")
        elif model.awaits_path:
            window.status.say(f"Two images follow. {window.workspace.reference.preparation.text}")
        elif not model.is_open:
            window.status.say(NO_MODEL)
        return panes.can_compare or model.awaits_path

    def compare_images() -> None:
        if follows():
            panes.toggle_compare() if panes.can_compare else panes.show_images("both")
        show_images()

    def show_difference() -> None:
        wanted = difference.isChecked() and follows()
        if wanted and len(panes.images) < 2:
            panes.show_images("both")
        difference.setChecked(wanted)
        error.set_wanted(wanted)

    compare = act(bar.compare, compare_images, "C")
    difference = act(bar.difference, show_difference, "D")
    browse = act(bar.browse, lambda: latent.choose(shown=not latent.choices.shown), "B", "Ctrl+B")
    act(bar.save, window.saving.ask, "Ctrl+Shift+S", "Ctrl+Shift+C")
    cropping = act(window.tools.crop, lambda: crop.set_shown(not crop.is_shown), "K", "Ctrl+K")
    crop.shownChanged.connect(cropping.setChecked)

    def show_images() -> None:
        bar.show_comparison(panes.can_compare)
        compare.setChecked(len(panes.images) > 1)

    panes.arranged.connect(show_images)
    latent.choicesChanged.connect(lambda choices: browse.setChecked(choices.shown))
    show_images()


def _show_action(button: IconButton, action: QAction) -> None:
    """Have a button do what an action does, and look as it does."""

    def follow(_checked: bool = False) -> None:
        button.setChecked(action.isChecked())
        button.setEnabled(action.isEnabled())

    button.clicked.connect(lambda _checked=False: action.trigger())
    # Where the action changes nothing, the button stays as it was.
    button.clicked.connect(follow)
    action.changed.connect(follow)
    follow()


def _add_alone(caption: CaptionButton, panes: PaneLayout, shown: Shown) -> QMenu:
    """Add an entry that shows one image alone, or both again."""
    menu = caption.add_menu()
    alone = _add_switch(
        menu,
        "Show alone",
        lambda: panes.shown == shown,
        lambda: panes.show_images("both" if panes.shown == shown else shown),
    )

    def show_state() -> None:
        # With a single image there is nothing to choose.
        caption.set_menu(menu if panes.can_compare else None)
        alone.setChecked(panes.shown == shown)

    panes.arranged.connect(show_state)
    show_state()
    return menu


def _fill_file(window: WindowParts, menu: QMenu) -> None:
    files, workspace = window.files, window.workspace
    keys = QKeySequence.StandardKey
    add_action(menu, "&Open…", files.ask_and_open, keys.Open)
    add_action(menu, "Open &DICOM folder…", files.ask_for_dicom)
    samples = menu.addMenu("Sa&mple volumes")
    samples.setStyleSheet(f"QMenu {{ icon-size: {PICTURE}px; }}")
    for path in shipped_volumes():
        action = add_action(samples, title_of(path), partial(files.open_volume, path))
        action.setIcon(QIcon(str(picture_of(path))))
        action.setIconVisibleInMenu(True)
    _add_recent(window, menu, "volumes")
    contents = add_action(menu, "Other &volumes in this file…", files.ask_for_content)
    about = add_action(menu, "P&roperties…", files.show_properties, "Ctrl+I")
    menu.addSeparator()
    add_action(menu, "Open &TF…", files.ask_for_transfer_function, "Ctrl+T")
    add_action(menu, "&Save TF…", files.save_transfer_function, keys.Save)
    _add_recent(window, menu, "transfer_functions")
    menu.addSeparator()
    add_action(menu, "Save sess&ion…", window.sessions.ask_and_save, "Ctrl+Alt+S")
    _add_recent(window, menu, "sessions")
    menu.addSeparator()
    settings = partial(_show_settings, window)
    add_action(menu, "Se&ttings…", settings, "Ctrl+,")
    add_action(menu, "&Quit", window.close, "Ctrl+Q")

    def offer() -> None:
        opened = workspace.opened
        about.setVisible(opened is not None)
        contents.setVisible(opened is not None and bool(opened.volume.file.contents))

    workspace.volumeStarted.connect(offer)
    offer()


def _show_settings(window: WindowParts) -> None:
    SettingsDialog(window.context, window.overlays).open()


def _fill_view(window: WindowParts, menu: QMenu) -> None:
    state, panes, workspace = window.state, window.panes, window.workspace
    overlays, editor = window.overlays, window.editor

    def draws_missing() -> bool:
        return workspace.opened is not None and workspace.opened.volume.draws_missing

    _add_undo(window, menu)
    menu.addSeparator()
    add_action(menu, "&Reset view", state.reset_view, "Ctrl+0")
    add_action(menu, "Zoom to f&it", state.view_whole, "Ctrl+9")
    sides = menu.addMenu("Fr&om")
    for number, name in enumerate(STANDARD_VIEWS, start=1):
        add_action(sides, name, partial(state.look_from, name), f"Ctrl+{number}")
    axes = {axis: axis.replace("-", "−") for axis in AXES}
    _add_choices(menu.addMenu("U&p"), axes, lambda: state.up_axis, state.set_up_axis)
    _add_switch(
        menu,
        "&Free rotation",
        lambda: state.trackball,
        lambda: state.set_trackball(not state.trackball),
        "Ctrl+Shift+T",
    )
    menu.addSeparator()
    swap = add_action(menu, "S&wap sides", panes.swap, "Ctrl+Shift+X")
    missing = _add_switch(
        menu,
        "Draw &missing voxels",
        draws_missing,
        lambda: workspace.opening.draw_missing(not draws_missing()),
    )
    for name, text, keys in OVERLAYS:
        has, toggle = partial(overlays.has, name), partial(overlays.toggle, name)
        _add_switch(menu, text, has, toggle, keys)
    _add_choices(
        menu.addMenu("Back&ground"),
        {choice: choice.capitalize() for choice in BACKGROUNDS},
        lambda: window.preferences.settings.background,
        overlays.choose_background,
    )
    menu.addSeparator()
    # Not remembered: at the next start the editor is there again.
    _add_switch(
        menu,
        "&TF editor",
        lambda: not editor.is_folded,
        lambda: editor.set_folded(not editor.is_folded),
        "F9",
    )
    _add_switch(menu, "F&ull screen", window.isFullScreen, partial(_toggle_full, window), "F11")

    def offer() -> None:
        swap.setVisible(panes.can_compare)
        missing.setVisible(workspace.opened is not None and workspace.opened.has_missing)

    menu.aboutToShow.connect(offer)
    workspace.rangeChanged.connect(lambda _opened: offer())
    panes.arranged.connect(offer)
    offer()


def _toggle_full(window: WindowParts) -> None:
    window.showNormal() if window.isFullScreen() else window.showFullScreen()


def _add_undo(window: WindowParts, menu: QMenu) -> None:
    edits = window.state.edits
    stack, keys = edits.stack, QKeySequence.StandardKey
    undo = add_action(menu, "&Undo", edits.undo, keys.Undo)
    redo = add_action(menu, "Redo", edits.redo)
    # Both of the usual keys, whatever the system's own is.
    usual = [*QKeySequence.keyBindings(keys.Redo), QKeySequence("Ctrl+Y")]
    redo.setShortcuts(list(dict.fromkeys(usual)))
    for action, changed in ((undo, stack.canUndoChanged), (redo, stack.canRedoChanged)):
        action.setEnabled(False)
        changed.connect(action.setEnabled)

    def name_edits() -> None:
        undo.setText(f"&Undo {stack.undoText()}".rstrip())
        redo.setText(f"Redo {stack.redoText()}".rstrip())

    menu.aboutToShow.connect(name_edits)


def _fill_region(window: WindowParts, menu: QMenu) -> None:
    regions, view = window.sensitivity_state, window.sensitivity
    add_action(menu, "&Rectangle", lambda: regions.set_tool("rectangle"), "R")
    add_action(menu, "&Lasso", lambda: regions.set_tool("lasso"), "L")
    of_region = (
        add_action(menu, "R&emove region", regions.remove_region, "Shift+Delete"),
        add_action(menu, "&Whole image", lambda: regions.activate(None)),
    )

    def offer(_what: str = "") -> None:
        for action in of_region:
            action.setEnabled(regions.active is not None)

    regions.changed.connect(offer)
    offer()
    menu.addSeparator()
    _add_switch(
        menu,
        "Show &sensitivity",
        lambda: regions.choices.shown,
        lambda: regions.choose(shown=not regions.choices.shown),
        "Ctrl+E",
    )
    add_action(menu, "&Keep the values under the mouse", view.toggle_kept, "P")
    save = window.files.save_sensitivity
    add_action(menu, "Sa&ve sensitivity as…", lambda: save(view.result()))


def _fill_help(window: WindowParts, menu: QMenu) -> None:
    add_action(menu, "&Keys and gestures", partial(show_gestures, window), "F1")
    add_action(menu, "G&lossary", partial(open_glossary, window))
    _add_networks(window, menu.addMenu("The paper's &networks"))
    add_action(menu, "&About tfscope", partial(show_about, window))


def _add_networks(window: WindowParts, menu: QMenu) -> None:
    """Add the shipped networks, those of the open volume, and what opens and closes others."""
    show_tips(menu)
    files, workspace = window.files, window.workspace
    listed: list[QAction] = []
    first = add_action(menu, "Open &model…", files.ask_for_model, "Ctrl+M")
    close = add_action(menu, "&Close the model", partial(workspace.open_model, None))
    _add_recent(window, menu, "models")

    def fill() -> None:
        for action in listed:
            menu.removeAction(action)
        listed.clear()
        library, opened = workspace.library, workspace.opened
        shipped = library.shipped()
        entries = [
            (model, partial(files.open_model_and_volume, model.folder, volume))
            for model, volume in shipped
        ]
        folders = {model.folder for model, _ in shipped}
        others = []
        if opened is not None:
            known = window.preferences.volume(opened.fingerprint).models
            others = library.models_of(opened.fingerprint, known)
        entries += [
            (model, partial(files.open_model, model.folder))
            for model in others
            if model.folder not in folders
        ]
        for model, open_it in entries:
            listed.append(_network_action(menu, model, open_it))
            listed[-1].setChecked(model.folder == workspace.model.folder)
        if entries:
            listed.append(menu.insertSeparator(first))
        menu.insertActions(first, listed)
        close.setVisible(workspace.model.is_open)

    menu.aboutToShow.connect(fill)


def _network_action(menu: QMenu, model: KnownModel, open_it: Callable[[], object]) -> QAction:
    action = QAction(model.name, menu)
    action.triggered.connect(lambda _checked=False: open_it())
    action.setToolTip(model.errors or str(model.folder))
    action.setCheckable(True)
    return action


def _add_recent(window: WindowParts, menu: QMenu, kind: RecentKind) -> None:
    """Add a menu of recent files, which is there once there are any."""
    recent = menu.addMenu(RECENT[kind])
    show_tips(recent)

    def fill() -> None:
        recent.clear()
        paths = [path for path in window.preferences.recent(kind) if path.exists()]
        for path, name in zip(paths, menu_names(paths), strict=True):
            action = add_action(recent, name, partial(window.files.open_recent, kind, path))
            action.setToolTip(str(path))
        recent.menuAction().setVisible(bool(paths))

    menu.aboutToShow.connect(fill)
    fill()


def menu_names(paths: Sequence[Path]) -> list[str]:
    """Return names of files for a menu: with their folders where they are alike."""
    alike = Counter(path.name for path in paths)
    names = [p.name if alike[p.name] == 1 else f"{p.name}  ({p.parent.name})" for p in paths]
    # An ampersand would mark a key.
    return [name.replace("&", "&&") for name in names]


def _add_switch(
    menu: QMenu, text: str, is_on: Callable[[], bool], toggle: Callable[[], object], keys: str = ""
) -> QAction:
    """Add an entry that is checked, whenever the menu opens, where something is on."""
    action = add_action(menu, text, toggle, keys or None)
    action.setCheckable(True)

    def refresh() -> None:
        action.setChecked(is_on())

    menu.aboutToShow.connect(refresh)
    action.triggered.connect(lambda _checked=False: refresh())
    refresh()
    return action


def _add_choices(
    menu: QMenu, texts: dict[Any, str], present: Callable[[], Any], choose: Callable[[Any], object]
) -> None:
    """Add entries of which one is checked."""
    group = QActionGroup(menu)
    actions = {}
    for choice, text in texts.items():
        actions[choice] = add_action(menu, text, partial(choose, choice))
        actions[choice].setCheckable(True)
        group.addAction(actions[choice])
    menu.aboutToShow.connect(lambda: actions[present()].setChecked(True))
    actions[present()].setChecked(True)
