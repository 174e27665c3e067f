"""Saving and opening of sessions from the window: dialogs, notices, panes and title."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog, QWidget

from app.controls import Action
from app.state.preferences import Preferences
from app.state.session import SUFFIX, Session
from app.state.session_work import SessionWork
from app.window.file_dialogs import FileDialogs
from app.window.file_opening import VOLUME_FILTER, FileOpening
from app.window.notices import Notices
from app.window.overlays import Overlays
from app.window.pane_layout import PaneLayout
from app.window.window_memory import WindowMemory

SESSION_FILTER = f"Sessions (*{SUFFIX});;All files (*)"

MISSED = "volume of the session"
"""Key of the notice about a session's volume that is nowhere."""


class SessionFiles(QObject):
    """Asks for the files of sessions, and brings the window's own parts back.

    Parameters
    ----------
    window : QWidget
        Parent of the dialogs; its title has the session's name.
    """

    def __init__(
        self,
        window: QWidget,
        work: SessionWork,
        files: FileDialogs,
        opening: FileOpening,
        overlays: Overlays,
        panes: PaneLayout,
        memory: WindowMemory,
        preferences: Preferences,
        notice: Notices,
    ) -> None:
        super().__init__(window)
        self._window, self._work = window, work
        self._files = files
        self._overlays, self._panes, self._memory = overlays, panes, memory
        self._preferences, self._notice = preferences, notice
        opening.sessionFound.connect(work.open)
        work.shown.connect(self._show)
        work.volumeMissed.connect(self._ask_for_volume)
        work.told.connect(self._tell)

    def save(self) -> None:
        """Ask for a file and write what is shown to it."""
        name = self._files.proposed_name("session", SUFFIX)
        path = self._files.ask_for_place("Save session", SESSION_FILTER, (SUFFIX,), name)
        if path is not None:
            self._memory.note()
            self._work.save(path)

    def _show(self, session: Session | None, name: str) -> None:
        """Bring back what belongs to the window, and name the session in its title."""
        title = self._window.windowTitle().rpartition(" | ")[2]
        self._window.setWindowTitle(f"{name} | {title}" if name else title)
        if session is None:
            return
        self._overlays.refresh()
        self._memory.restore_panes()

    def _ask_for_volume(self, path: Path, session: Session) -> None:
        self._notice.tell(
            f"{path.name} shows {session.volume.name}, which is neither in "
            f"{session.volume.parent} nor beside it.",
            Action("Locate it…", partial(self._locate, path, session.volume.name)),
            key=MISSED,
            tone="error",
        )

    def _locate(self, path: Path, name: str) -> None:
        folder = self._preferences.settings.last_folder
        found, _ = QFileDialog.getOpenFileName(
            self._window, f"Locate '{name}'", folder, VOLUME_FILTER
        )
        if found:
            self._work.open(path, Path(found))

    def _tell(self, text: str, before: Path | None) -> None:
        back = [] if before is None else [Action("Go back", partial(self._work.open, before))]
        self._notice.tell(text, *back)
