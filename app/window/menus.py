"""The menus, and the actions of the buttons in the top bar."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QIcon, QKeySequence
from PySide6.QtWidgets import QMenu, QWidget

from app.caption_button import CaptionButton
from app.controls import RightClick, add_action, add_choices, show_tips
from app.engines.requests import Drawing
from app.glosses import open_glossary, open_page
from app.icons import IconButton
from app.image_view.reference_controls import DRAWINGS
from app.state.library import KnownModel
from app.state.opened_volume import OpenedVolume
from app.state.settings import RecentKind, Shown
from app.window.context import VOLUME_FILTER, menu_names
from app.window.files import TF_FILTER
from app.window.help_pages import ABOUT, help_text
from app.window.overlays import BACKGROUNDS, Overlay
from app.window.settings_dialog import SettingsDialog, apply_single_keys
from app.window.window_parts import WindowParts
from model.scene.orientation import STANDARD_VIEWS
from model.scene.view import AXES
from model.volume_files.shipped import picture_of, shipped_volumes, title_of

PICTURE = 64  # side of a sample's picture, in pixels

OVERLAYS: tuple[tuple[Overlay, str, str], ...] = (
    ("legend", "Colour l&egend", "Ctrl+L"),
    ("scale_bar", "&Scale bar", "Ctrl+Shift+L"),
    ("opacity_images", "Opac&ity image", "Shift+O"),
)

Slot = Callable[[], object]
Test = Callable[[], bool]


class Menus:
    """Fills the menu bar, and connects the top bar's buttons."""

    def __init__(self, window: WindowParts) -> None:
        self._window, self._refreshes = window, list[Slot]()
        self._of_b = self._fill_of_b()
        self._fill_bar()
        for title, fill in (
            ("&File", self._fill_file), ("&Edit", self._fill_edit), ("&View", self._fill_view),
            ("&Region", self._fill_region), ("&Help", self._fill_help),
        ):  # fmt: skip
            menu = window.top_bar.menu_bar.addMenu(title)
            show_tips(menu)
            menu.aboutToShow.connect(self.refresh)
            fill(menu)
        window.top_bar.menus.addActions(window.top_bar.menu_bar.actions())
        for caption in (window.pane_b.caption, window.editor.pane_button):
            caption.set_menu(self._of_b)
        menu = self._add_alone(window.generator.caption, "generator")
        add_action(menu, "What is the error (RMSE)?", lambda: open_glossary(window, "RMSE"))
        self._add_alone(window.reference.caption, "reference")
        apply_single_keys(window, window.preferences.settings.single_keys)
        self.refresh()

    def refresh(self) -> None:
        """Update all entries and buttons: checked, enabled, named and shown."""
        for refresh in self._refreshes:
            refresh()

    def _if_opened(self, test: Callable[[OpenedVolume], object] = lambda _: True) -> Test:
        """Return a condition that also needs a volume."""
        workspace = self._window.workspace
        return lambda: workspace.opened is not None and bool(test(workspace.opened))

    def _on_volume(self, slot: Slot) -> Slot:
        """Return a slot that without a volume only says that one is needed."""
        workspace, say = self._window.workspace, self._window.status.say
        return lambda: say("Open a volume first.") if workspace.opened is None else slot()

    def _has_mask(self) -> bool:
        return self._window.state.mask_input.value is not None

    def _add(
        self,
        menu: QMenu,
        text: str,
        slot: Slot,
        keys: QKeySequence.StandardKey | str | None = None,
        *,
        is_on: Test | None = None,
        is_there: Test | None = None,
        of: QWidget | None = None,
    ) -> None:
        """Add an entry; its keys work in the whole window, or only in the focused widget `of`."""

        def act() -> None:
            slot()
            refresh()

        def refresh() -> None:
            if is_on is not None:
                action.setChecked(is_on())
            if is_there is not None:
                action.setVisible(is_there())

        action = add_action(menu, text, act, keys)
        action.setCheckable(is_on is not None)
        if of is not None:
            of.addAction(action)
            action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        if is_on is not None or is_there is not None:
            self._refreshes.append(refresh)

    def _add_choices(
        self, menu: QMenu, texts: dict[Any, str], present: Slot, choose: Callable[[Any], object]
    ) -> None:
        actions = add_choices(menu, {each: (text, "") for each, text in texts.items()}, choose)
        self._refreshes.append(lambda: actions[present()].setChecked(True))

    def _add_alone(self, caption: CaptionButton, shown: Shown) -> QMenu:
        """Add an entry that shows one image alone, or both."""
        menu, panes = caption.add_menu(), self._window.panes

        def is_alone() -> bool:
            return panes.shown == shown

        self._add(menu, "Show alone", partial(panes.toggle_both, shown), is_on=is_alone)

        def offer() -> None:
            # With a single image there is nothing to choose.
            two = panes.can_compare and (panes.shown != "both" or len(panes.images) > 1)
            caption.set_menu(menu if two else self._of_b if panes.compares else None)

        self._refreshes.append(offer)
        return menu

    def _fill_bar(self) -> None:
        """Connect each of the bar's buttons to its action, whose keys work everywhere."""
        window = self._window
        bar, panes, crop = window.top_bar, window.panes, window.crop_card
        latent, error = window.latent_state, window.image_error
        tf_input, model = window.state.tf_input, window.workspace.model

        def has_only_b() -> bool:
            has_other = panes.has_model or model.awaits_path or panes.is_browsing
            return tf_input.compares or not has_other

        def compare_images() -> None:
            if has_only_b():
                self._toggle_b()
            elif self._two_follow():
                panes.toggle_both()
            refresh()

        def show_difference() -> None:
            wanted = difference.isChecked()
            if wanted and has_only_b() and not tf_input.compares:
                self._toggle_b()
            wanted = wanted and (tf_input.compares or self._two_follow())
            if wanted and not tf_input.compares and len(panes.images) < 2:
                panes.toggle_both()
            difference.setChecked(wanted)
            error.is_wanted = wanted

        def show_crop() -> None:
            self._on_volume(lambda: crop.set_shown(not crop.is_shown))()
            refresh()

        compare = self._act(bar.compare, compare_images, "C")
        difference = self._act(bar.difference, show_difference, "D")
        browse = lambda: latent.choose(shown=not latent.choices.shown)  # noqa: E731
        browsing = self._act(bar.browse, browse, "B", "Ctrl+B")
        self._saving = self._act(bar.save, window.saving.ask, "Ctrl+Shift+S")
        self._cropping = self._act(window.tools.crop, show_crop, "K", "Ctrl+K")

        def refresh() -> None:
            are_two = len(panes.images) > 1 or panes.wipes
            compare.setChecked(are_two)
            difference.setChecked(are_two and error.is_wanted)
            browsing.setChecked(latent.choices.shown)
            self._cropping.setChecked(crop.is_shown)

        self._refreshes.append(refresh)

    def _two_follow(self) -> bool:
        """Whether there are two images, or will be; if not, report why."""
        window = self._window
        panes, model, say = window.panes, window.workspace.model, window.status.say
        if panes.is_browsing:
            say("The map of TFs is in the place of the second image. B closes it.")
        elif model.awaits_path:
            say("Two images follow once path-traced light is compiled.")
        return panes.can_compare or model.awaits_path

    def _act(self, button: IconButton, slot: Slot, *keys: str) -> QAction:
        """Return an action for a button, which follows its state."""
        action = QAction(button.accessibleName(), self._window)
        action.setCheckable(button.isCheckable())
        action.setShortcuts([QKeySequence(key) for key in keys])
        action.triggered.connect(lambda _checked=False: slot())
        self._window.addAction(action)

        def follow() -> None:
            button.setChecked(action.isChecked())
            button.setEnabled(action.isEnabled())

        def press(_checked: bool = False) -> None:
            action.trigger()
            # If the action changes nothing, the button stays as it was.
            follow()

        button.clicked.connect(press)
        action.changed.connect(follow)
        follow()
        return action

    def _fill_file(self, menu: QMenu) -> None:
        window, files = self._window, self._window.files
        keys = QKeySequence.StandardKey

        self._add(menu, "&Open…", files.ask_and_open, keys.Open)
        open_folder = partial(files.ask, "Open DICOM folder", "", files.open_volume)
        self._add(menu, "Open &DICOM folder…", open_folder)
        samples = menu.addMenu("Sa&mple volumes")
        samples.setStyleSheet(f"QMenu {{ icon-size: {PICTURE}px; }}")
        for path in shipped_volumes():
            action = add_action(samples, title_of(path), partial(files.open_volume, path))
            action.setIcon(QIcon(str(picture_of(path))))
            action.setIconVisibleInMenu(True)
        self._add_recent(menu, "volumes", "&Recent volumes")
        contents = "Other &volumes in this file…"
        has_others = self._if_opened(lambda opened: opened.volume.file.contents)
        self._add(menu, contents, files.ask_for_content, is_there=has_others)
        self._add(menu, "&Properties…", files.show_properties, "Ctrl+I", is_there=self._if_opened())
        menu.addSeparator()
        open_tf = partial(files.ask, "Open TF", TF_FILTER, files.open_transfer_function)
        self._add(menu, "Open &TF…", open_tf, "Ctrl+T")
        self._add(menu, "&Save TF…", files.save_transfer_function, keys.Save)
        self._add_recent(menu, "transfer_functions", "Rece&nt TFs")
        menu.addSeparator()
        self._fill_models(menu.addMenu("Mode&ls"))
        open_mask = partial(files.ask, "Open mask or labels", VOLUME_FILTER, files.open_mask)
        self._add(menu, "Open mas&k…", open_mask, is_there=self._if_opened())
        self._add(menu, "Save mask…", files.save_mask, is_there=self._has_mask)
        menu.addSeparator()
        self._saving.setText("Save fi&gure…")
        menu.addAction(self._saving)
        self._add(menu, "Save sess&ion…", window.sessions.ask_and_save, "Ctrl+Alt+S")
        self._add_recent(menu, "sessions", "Recent s&essions")
        menu.addSeparator()
        self._add(menu, "&Quit", window.close, "Ctrl+Q")

    def _fill_edit(self, menu: QMenu) -> None:
        window = self._window
        self._add_undo(menu)
        menu.addSeparator()
        self._add(menu, "&Copy image", partial(window.saving.ask, copies=True), "Ctrl+Shift+C")
        menu.addSeparator()
        isolate, cut = (partial(window.slices.take_piece, alone) for alone in (True, False))
        self._add(menu, "&Isolate connected voxels", isolate, "I", of=window.images_and_slices)
        self._add(menu, "Cut connected voxels &away", cut, "X", of=window.images_and_slices)
        self._add(menu, "Show all &voxels", window.state.show_all_voxels, is_there=self._has_mask)
        menu.addSeparator()
        self._add(menu, "&Settings…", self._show_settings, "Ctrl+,")
        for pane in window.context.panes:
            RightClick(pane.canvas, menu)

    def _show_settings(self) -> None:
        window = self._window
        actions = window.top_bar.menu_bar.actions()
        SettingsDialog(window.context, window.overlays, actions).open()

    def _fill_view(self, menu: QMenu) -> None:
        window, state, panes = self._window, self._window.state, self._window.panes
        workspace, overlays, editor = window.workspace, window.overlays, window.editor

        draws_missing = self._if_opened(lambda opened: opened.volume.draws_missing)
        has_missing = self._if_opened(lambda opened: opened.volume.missing is not None)

        def toggle_full() -> None:
            window.showNormal() if window.isFullScreen() else window.showFullScreen()

        def face_clip() -> None:
            state.face_clip()
            window.crop_card.set_shown(True)  # with the keys that move the plane

        self._add(menu, "&Reset view", state.reset_view, "Ctrl+0")
        self._add(menu, "&Zoom to fit", window.slices.fit, "F")
        sides = menu.addMenu("Fr&om")
        for number, name in enumerate(STANDARD_VIEWS, start=1):
            self._add(sides, name, partial(state.look_from, name), f"Ctrl+{number}")
        axes = {axis: axis.replace("-", "−") for axis in AXES}
        up = menu.addMenu("U&p")
        self._add_choices(up, axes, lambda: state.up_axis, state.set_up_axis)
        up.addSeparator()
        self._add(up, "By &pictures…", window.up_axis_card.ask, is_there=self._if_opened())
        self._add(
            menu, "&Free rotation", lambda: state.set_trackball(not state.trackball),
            "Ctrl+Shift+T", is_on=lambda: state.trackball,
        )  # fmt: skip
        self._add(
            menu, "Ort&hographic",
            lambda: state.set_orthographic(not state.view.is_orthographic),
            "O", is_on=lambda: state.view.is_orthographic,
        )  # fmt: skip
        self._cropping.setText("Crop bo&x")
        menu.addAction(self._cropping)
        plane = menu.addMenu("Clipping p&lane")
        self._add(plane, "&Face the viewer", self._on_volume(face_clip), "Shift+K")
        self._add(plane, "F&lip", state.flip_clip)
        self._add(plane, "&Remove", partial(state.clip_input.set, None))
        self._add(
            menu, "&Measure a distance", window.ruler.toggle, "M", is_on=lambda: window.ruler.is_on
        )
        menu.addSeparator()
        self._add(
            menu, "Compare with &B", self._toggle_b, "A", is_on=lambda: state.tf_input.compares
        )
        menu.addMenu(self._of_b)
        self._refreshes.append(lambda: self._of_b.menuAction().setVisible(panes.compares))
        self._add(
            menu, "S&wap sides", panes.swap, "Ctrl+Shift+X", is_there=lambda: panes.can_compare
        )
        self._add(
            menu, "I&nterpolate between voxels",
            lambda: state.set_interpolates(not state.interpolates),
            is_on=lambda: state.interpolates,
        )  # fmt: skip
        self._add(
            menu, "&Draw missing voxels",
            lambda: workspace.opening.draw_missing(not draws_missing()),
            is_on=draws_missing, is_there=has_missing,
        )  # fmt: skip
        self._add(menu, "Sli&ces", window.slices.toggle, "S", is_on=lambda: window.slices.is_shown)
        for overlay, text, keys in OVERLAYS:
            toggle, has = partial(overlays.toggle, overlay), partial(overlays.has, overlay)
            self._add(menu, text, toggle, keys, is_on=has)
        self._add_choices(
            menu.addMenu("Back&ground"),
            {choice: choice.capitalize() for choice in BACKGROUNDS},
            lambda: window.preferences.settings.background,
            overlays.choose_background,
        )
        menu.addSeparator()
        # Not remembered: the editor is shown at the next start.
        self._add(
            menu, "&TF editor", lambda: editor.set_folded(not editor.is_folded), "F9",
            is_on=lambda: not editor.is_folded,
        )  # fmt: skip
        self._add(menu, "F&ull screen", toggle_full, "F11", is_on=window.isFullScreen)

    def _fill_of_b(self) -> QMenu:
        """Return the menu of A and B, shared by both captions and the editor."""
        window, panes, tf_input = self._window, self._window.panes, self._window.state.tf_input
        work = window.workspace.reference
        menu = QMenu("&A and B", window)
        self._add(menu, "&Copy A to B", partial(work.copy, "A"))
        self._add(menu, "Copy &B to A", partial(work.copy, "B"))
        self._add(menu, "&Swap A and B", work.swap, "Ctrl+Shift+B")
        self._add(menu, "&Edit the other image", tf_input.focus_other, "Shift+A")
        self._add_choices(
            menu.addMenu("&Renderer of B"),
            {None: "That of A", **DRAWINGS},
            lambda: tf_input.look.drawing,
            self._choose_renderer_of_b,
        )
        self._add(
            menu, "&Wipe: both in one image", self._toggle_wipe, "Ctrl+Shift+W",
            is_on=lambda: panes.wipes,
        )  # fmt: skip
        menu.addSeparator()
        self._add(menu, "C&lose B", partial(tf_input.compare, False))
        return menu

    def _choose_renderer_of_b(self, name: Drawing | None) -> None:
        self._window.state.tf_input.focus("B")
        self._window.workspace.reference.choose_look(drawing=name)

    def _toggle_b(self) -> None:
        tf_input = self._window.state.tf_input
        self._on_volume(lambda: tf_input.compare(not tf_input.compares))()

    def _toggle_wipe(self) -> None:
        if self._window.state.tf_input.compares:
            self._window.panes.show_b(True, not self._window.panes.wipes)

    def _add_undo(self, menu: QMenu) -> None:
        edits, stack = self._window.state.edits, self._window.state.edits.stack
        keys = QKeySequence.StandardKey
        undo = add_action(menu, "&Undo", edits.undo, keys.Undo)
        redo = add_action(menu, "Redo", edits.redo)
        usual = [*QKeySequence.keyBindings(keys.Redo), QKeySequence("Ctrl+Y")]
        redo.setShortcuts(list(dict.fromkeys(usual)))  # both, whatever the system's own is
        for action, changed in ((undo, stack.canUndoChanged), (redo, stack.canRedoChanged)):
            action.setEnabled(False)
            changed.connect(action.setEnabled)
        self._refreshes += [
            lambda: undo.setText(f"&Undo {stack.undoText()}".rstrip()),
            lambda: redo.setText(f"Redo {stack.redoText()}".rstrip()),
        ]

    def _fill_region(self, menu: QMenu) -> None:
        regions, view = self._window.sensitivity_state, self._window.sensitivity
        save = self._window.files.save_sensitivity
        draw = regions.set_tool
        self._add(menu, "&Rectangle", self._on_volume(lambda: draw("rectangle")), "R")
        self._add(menu, "&Lasso", self._on_volume(lambda: draw("lasso")), "L")
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
        self._add(
            menu, "Show &sensitivity", lambda: regions.choose(shown=not regions.choices.shown),
            "Ctrl+E", is_on=lambda: regions.choices.shown,
        )  # fmt: skip
        keep = add_action(menu, "&Keep the values under the mouse", view.toggle_kept)
        # Ctrl is held while the mouse asks what an edit changes.
        keep.setShortcuts([QKeySequence("P"), QKeySequence("Ctrl+P")])
        self._add(menu, "Sa&ve sensitivity as…", lambda: save(view.result()))

    def _fill_help(self, menu: QMenu) -> None:
        show = partial(open_page, self._window)
        keys = "Keys and gestures", help_text(), "Search keys and gestures", help_text
        self._add(menu, "&Keys and gestures", partial(show, *keys), "F1")
        self._add(menu, "G&lossary", partial(open_glossary, self._window))
        self._add(menu, "&About tfscope", partial(show, "About tfscope", ABOUT))

    def _fill_models(self, menu: QMenu) -> None:
        """Add the shipped models, those of the open volume, and entries for others."""
        show_tips(menu)
        files, workspace = self._window.files, self._window.workspace
        listed: list[QAction] = []
        open_model = partial(files.ask, "Open model", "", files.open_model)
        first = add_action(menu, "Open &model…", open_model, "Ctrl+M")
        close = add_action(menu, "&Close the model", partial(workspace.open_model, None))
        self._add_recent(menu, "models", "&Recent models")

        def fill() -> None:
            for action in listed:
                menu.removeAction(action)
            library, opened = workspace.library, workspace.opened
            entries: list[tuple[KnownModel, Path | None]] = [*library.shipped()]
            if opened is not None:
                known = self._window.preferences.volume(opened.fingerprint).models
                shipped = {model.folder for model, _volume in entries}
                found = library.models_of(opened.fingerprint, known)
                entries += [(model, None) for model in found if model.folder not in shipped]
            listed.clear()
            for model, volume in entries:
                open_it = partial(files.open_model, model.folder, volume)
                action = add_action(menu, model.name, open_it)
                action.setToolTip(model.errors or str(model.folder))
                action.setCheckable(True)
                action.setChecked(model.folder == workspace.model.folder)
                listed.append(action)
            if entries:
                listed.append(menu.insertSeparator(first))
            menu.insertActions(first, listed)
            close.setVisible(workspace.model.folder is not None)

        menu.aboutToShow.connect(fill)

    def _add_recent(self, menu: QMenu, kind: RecentKind, text: str) -> None:
        """Add a menu of recent files, hidden without any."""
        recent, window = menu.addMenu(text), self._window
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
