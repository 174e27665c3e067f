"""Menus of what ships with tfscope: volumes, and models with theirs."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QMenu

from app.controls import add_action
from app.menu_tips import show_tips
from app.state.workspace import Workspace
from app.window.file_opening import FileOpening
from model.volume_files.shipped import shipped_volumes, title_of


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
        for path in shipped_volumes():
            action = add_action(samples, title_of(path), partial(self._opening.open_volume, path))
            action.setToolTip("Ships with tfscope, with a model that was trained on it")

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
