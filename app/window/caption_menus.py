"""Menus behind the names of the volume, the generator and the ground truth."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QMenu

from app.caption_button import CaptionButton
from app.controls import add_action
from app.glosses import open_glossary
from app.image_view.reference_controls import ReferenceControls
from app.state.preferences import Preferences
from app.state.workspace import Workspace
from app.window.file_dialogs import FileDialogs
from app.window.file_opening import FileOpening
from app.window.pane_layout import PaneLayout, Shown
from app.window.recent_menu import RecentMenus
from app.window.sample_menus import SampleMenus


class CaptionMenus(QObject):
    """Fills the menus of the captions with what can be done with what they name."""

    def __init__(
        self,
        volume: CaptionButton,
        generator: CaptionButton,
        reference: CaptionButton,
        opening: FileOpening,
        files: FileDialogs,
        workspace: Workspace,
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._volume, self._generator, self._reference = volume, generator, reference
        self._opening, self._files, self._workspace = opening, files, workspace
        self._samples = SampleMenus(opening, workspace)
        self._recent = RecentMenus(opening, workspace, preferences)

    def fill_volume(self, recent: QMenu, samples: QMenu, up_axes: QMenu) -> None:
        """Offer other volumes, which way is up, and what is known of this one."""
        menu = self._volume.menu()
        add_action(menu, "Open another volume…", self._files.open_volume)
        for other in (recent, samples):
            menu.addMenu(other)
        menu.addSeparator()
        menu.addMenu(up_axes)
        others = add_action(menu, "Others in this file…", self._opening.ask_for_content)
        facts = add_action(menu, "Properties…", self._opening.show_properties)

        def enable() -> None:
            opened = self._workspace.opened
            facts.setEnabled(opened is not None)
            others.setEnabled(opened is not None and bool(opened.volume.file.contents))

        menu.aboutToShow.connect(enable)

    def fill_generator(self, panes: PaneLayout) -> None:
        """Offer other models, to see this one's image alone, and what its error means."""
        menu = self._generator.add_menu()
        self._recent.add_models(menu)
        add_action(menu, "Open another model…", self._files.open_model)
        self._samples.add_models(menu)
        menu.addSeparator()
        _add_alone(menu, panes, "generator")
        window = self._generator.window
        add_action(menu, "What is the error (RMSE)?", lambda: open_glossary(window(), "RMSE"))

    def fill_reference(self, controls: ReferenceControls, panes: PaneLayout) -> None:
        """Offer size and renderer; without a model, one beside it; and to see it alone."""
        menu = self._reference.add_menu()
        controls.fill_size(menu.addMenu("&Size"))
        controls.fill_drawing(menu.addMenu("&Renderer"))
        menu.addSeparator()
        find = add_action(menu, "Open a model beside it…", self._files.open_model)
        menu.addSeparator()
        _add_alone(menu, panes, "reference")
        menu.aboutToShow.connect(lambda: find.setVisible(not self._workspace.model.is_open))


def _add_alone(menu: QMenu, panes: PaneLayout, shown: Shown) -> None:
    """Add an entry that shows one image alone, or both again."""
    alone = add_action(
        menu,
        "Show alone",
        partial(_show_alone, panes, shown),
    )
    alone.setCheckable(True)

    def show_state() -> None:
        alone.setEnabled(panes.can_compare)
        alone.setChecked(panes.can_compare and panes.shown == shown)

    menu.aboutToShow.connect(show_state)


def _show_alone(panes: PaneLayout, shown: Shown) -> None:
    panes.show_images("both" if panes.shown == shown else shown)
