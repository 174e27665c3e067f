"""Presets in the window: pictures of the open volume, and the user's own presets."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QInputDialog, QMessageBox

from app.controls import add_action
from app.engines.requests import Quality
from app.tf_editor.tf_menu import PICTURE, PresetMenu
from app.window.context import Context
from app.window.small_pictures import SmallPictures
from model.errors import TransferFunctionError, os_errors_as
from model.scene.ranges import fit_to_range, stretch_to_range
from model.scene.tf_presets import Preset
from model.scene.transfer_function import TransferFunction

SUFFIX = ".json"

KEY = "presets"  # of notices about presets


class Presets(QObject):
    """Draws the presets' pictures when their menu opens, and keeps the user's own presets."""

    def __init__(self, menu: PresetMenu, context: Context) -> None:
        super().__init__(menu)
        self._menu, self._context, self._state = menu, context, context.state
        folder = context.preferences.folder
        self._folder = None if folder is None else folder / "presets"
        self._pictures = SmallPictures("presets", Quality(PICTURE), context, menu.set_pictures)
        menu.own = self._own
        menu.picturesWanted.connect(self._ask)
        menu.aboutToHide.connect(self._pictures.stop_tracing)
        if self._folder is not None:
            menu.addSeparator()
            add_action(menu, "Save as preset…", self.ask_and_save)
            self._removal = menu.addMenu("Remove preset")
            menu.aboutToShow.connect(self._fill_removal)

    def ask_and_save(self) -> None:
        """Ask for a name, and save the present TF as a preset."""
        window = self._context.window
        text, is_given = QInputDialog.getText(window, "Save as preset", "Name of the preset")
        # A valid file name; empty if nothing is left of it.
        name, folder = re.sub(r"[^\w .+=()-]+", "_", text).strip(" ._")[:60], self._folder
        if not is_given or not name or folder is None:
            return
        own, buttons = own_presets(folder).keys(), QMessageBox.StandardButton
        if name in {each.name for each in self._menu.listed()} - own:
            # The volume's own one stays, and the menu has each name once.
            name = f"{name} 2"
        question = f"The preset {name} exists. Replace it?"
        if name in own and QMessageBox.question(window, "Replace", question) != buttons.Yes:
            return
        save = partial(save_own_preset, folder, name, self._state.transfer_function)
        self._context.done(KEY, save, f"Saved the preset {name}.")

    def remove(self, name: str) -> None:
        """Remove one of the user's presets."""
        if self._folder is not None:
            remove = partial(remove_own_preset, self._folder, name)
            self._context.done(KEY, remove, f"Removed the preset {name}.")

    def _own(self) -> list[Preset]:
        return [
            Preset(name, "Saved by you", self._fitted(tf))
            for name, tf in own_presets(self._folder).items()
        ]

    def _fitted(self, tf: TransferFunction) -> TransferFunction:
        scale, scalar_range = self._state.scale, self._state.scalar_range
        if tf.scale == scale or tf.is_relative:
            return fit_to_range(tf.on_scale(scale), scalar_range)
        # Its numbers are on another scale; its shape can be kept.
        return stretch_to_range(tf.on_scale(scale), scalar_range)

    def _fill_removal(self) -> None:
        self._removal.clear()
        for name in own_presets(self._folder):
            add_action(self._removal, name.replace("&", "&&"), partial(self.remove, name))
        self._removal.menuAction().setVisible(not self._removal.isEmpty())

    def _ask(self, listed: tuple[Preset, ...]) -> None:
        # The image may be wider than the pictures, and zoomed.
        shown = replace(self._state.inputs, view=self._state.for_picture(self._state.view))
        tfs = [preset.tf for preset in listed]
        self._pictures.ask([replace(shown, opacity_tf=t.opacity, color_tf=t.color) for t in tfs])


def own_presets(folder: Path | None) -> dict[str, TransferFunction]:
    """Return the TFs saved in a user's folder, by name, without damaged files."""
    found = {}
    for path in sorted(folder.glob(f"*{SUFFIX}")) if folder else ():
        try:
            found[path.stem] = TransferFunction.load(path)
        except TransferFunctionError:
            continue
    return found


def save_own_preset(folder: Path, name: str, tf: TransferFunction) -> None:
    """Save a TF; raise :class:`TransferFunctionError` if it cannot be written."""
    what = f"{folder}: the preset cannot be written"
    remedy = "make room there, or use File > Save TF"
    with os_errors_as(TransferFunctionError, what, remedy):
        folder.mkdir(parents=True, exist_ok=True)
    tf.save(folder / f"{name}{SUFFIX}", remedy)


def remove_own_preset(folder: Path, name: str) -> None:
    """Remove a saved TF if it exists; raise :class:`TransferFunctionError` if that fails."""
    path = folder / f"{name}{SUFFIX}"
    what = f"{path}: the preset cannot be removed"
    with os_errors_as(TransferFunctionError, what, "check your permissions"):
        path.unlink(missing_ok=True)
