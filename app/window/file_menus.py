"""Menus of recent files, of the models of the open volume, and of what ships with tfscope."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QMenu

from app.controls import add_action
from app.menu_tips import show_tips
from app.state.preferences import Preferences
from app.state.settings import RecentKind
from app.state.workspace import Workspace
from app.window.file_opening import FileOpening
from model.volume_files.shipped import picture_of, shipped_volumes, title_of

PICTURE = 64
"""Side of a sample's picture, in pixels."""


class SampleMenus(QObject):
    """Adds the menus of shipped volumes and models.

    Parameters
    ----------
    workspace : Workspace
        Its library knows the shipped models.
    """

    def __init__(self, opening: FileOpening, workspace: Workspace) -> None:
        super().__init__(opening)
        self._opening = opening
        self._workspace = workspace

    def add_volumes(self, menu: QMenu) -> None:
        """Add a menu of the shipped volumes."""
        samples = menu.addMenu("Sa&mple volumes")
        show_tips(samples)
        samples.setStyleSheet(f"QMenu {{ icon-size: {PICTURE}px; }}")
        for path in shipped_volumes():
            action = add_action(samples, title_of(path), partial(self._opening.open_volume, path))
            action.setIcon(QIcon(str(picture_of(path))))
            action.setIconVisibleInMenu(True)
            action.setToolTip("Ships with tfscope, with a transfer function, a view and a light")

    def add_models(self, menu: QMenu) -> None:
        """Add a menu of the shipped models, which are opened with their volumes."""
        models = menu.addMenu("Sample mo&dels")
        show_tips(models)
        models.aboutToShow.connect(partial(self._fill, models))

    def _fill(self, menu: QMenu) -> None:
        menu.clear()
        found = self._workspace.library.shipped()
        for model, volume in found:
            open_both = partial(self._opening.open_model_and_volume, model.folder, volume)
            action = add_action(menu, f"Paper's networks: {model.name}", open_both)
            action.setToolTip(model.worth or str(model.folder))
            action.setCheckable(True)
            action.setChecked(model.folder == self._workspace.model.folder)
        if not found:
            menu.addAction("None ship with this version").setEnabled(False)


TITLES: dict[RecentKind, str] = {
    "volumes": "&Recent volumes",
    "models": "Recent mode&ls",
    "transfer_functions": "Recent tra&nsfer functions",
    "sessions": "Recent s&essions",
}


class RecentMenus(QObject):
    """Fills its menus whenever they are opened."""

    def __init__(
        self, opening: FileOpening, workspace: Workspace, preferences: Preferences
    ) -> None:
        super().__init__(opening)
        self._opening = opening
        self._workspace = workspace
        self._preferences = preferences

    def add_recent(self, menu: QMenu, kind: RecentKind) -> None:
        """Add a menu of recent files to another one."""
        recent = menu.addMenu(TITLES[kind])
        show_tips(recent)
        recent.aboutToShow.connect(partial(self._fill_recent, recent, kind))

    def add_models(self, menu: QMenu) -> None:
        """Add a menu of the models that are known to be of the open volume."""
        models = menu.addMenu("Models of this volu&me")
        show_tips(models)
        models.aboutToShow.connect(partial(self._fill_models, models))

    def _fill_recent(self, menu: QMenu, kind: RecentKind) -> None:
        menu.clear()
        paths = self._preferences.recent(kind)
        for path, name in zip(paths, menu_names(paths), strict=True):
            action = add_action(menu, name, partial(self._opening.open_recent, kind, path))
            action.setToolTip(str(path))
            action.setEnabled(path.exists())
        if paths:
            menu.addSeparator()
            add_action(menu, "Forget them", partial(self._preferences.forget_recent, kind))
        else:
            menu.addAction("None yet").setEnabled(False)

    def _fill_models(self, menu: QMenu) -> None:
        menu.clear()
        opened = self._workspace.opened
        found = []
        if opened is not None:
            known = self._preferences.volume(opened.fingerprint).models
            found = self._workspace.library.models_of(opened.fingerprint, known)
        for model in found:
            action = add_action(menu, model.name, partial(self._opening.open_model, model.folder))
            action.setToolTip(model.worth or str(model.folder))
            action.setCheckable(True)
            action.setChecked(model.folder == self._workspace.model.folder)
        if not found:
            menu.addAction("None yet").setEnabled(False)
        menu.addSeparator()
        close = add_action(menu, "Close the model", partial(self._workspace.open_model, None))
        close.setEnabled(self._workspace.model.is_open)


def menu_names(paths: Sequence[Path]) -> list[str]:
    """Return names of files for a menu: with their folders where they are alike."""
    alike = Counter(path.name for path in paths)
    names = [p.name if alike[p.name] == 1 else f"{p.name}  ({p.parent.name})" for p in paths]
    # An ampersand would mark a key.
    return [name.replace("&", "&&") for name in names]
