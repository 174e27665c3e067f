"""Compact volumes from the window: asks how small, saves in the background, shows how far."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QDialog, QWidget

from app.state.compact_work import CompactWork
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.compact_dialog import CompactChoice, CompactDialog
from app.window.file_dialogs import FileDialogs
from app.window.save_progress import SaveProgress
from model.evaluation.compact_saving import CompactOrder, CompactResult
from model.scene.axes import DEFAULT_UP
from model.volume_files.compact import SUFFIX

COMPACT_FILTER = f"Compact volumes (*{SUFFIX})"
TITLE = "Save compact volume"
STEPS = 100


class CompactSaving(QObject):
    """Asks for size or error of a compact volume and for a place, and saves it.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.
    state : ViewerState
        Its TF and view are what is seen first of the file.

    Attributes
    ----------
    progress : SaveProgress or None
        What is seen of the work, with the button that ends it.
    """

    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""

    def __init__(
        self, parent: QWidget, state: ViewerState, workspace: Workspace, files: FileDialogs
    ) -> None:
        super().__init__(parent)
        self._parent = parent
        self._state = state
        self._workspace = workspace
        self._files = files
        self._place = Path()
        self.progress: SaveProgress | None = None
        self.work = CompactWork(self)
        self.work.progressed.connect(self._show)
        self.work.done.connect(self._saved)
        self.work.failed.connect(self._fail)

    @property
    def unfinished(self) -> str:
        """Work that closing the window would lose, in words; empty for none."""
        return f"{self._place.name} is being written" if self.work.is_running else ""

    def save(self) -> None:
        """Ask how small and where, and save the open volume."""
        opened = self._workspace.opened
        if opened is None:
            self.problem.emit("There is no volume to save yet; open one first.")
            return
        if self.work.is_running:
            self.problem.emit("Another compact volume is still saved; wait for it, or cancel it.")
            return
        voxels = opened.volume.linear.voxels
        dialog = CompactDialog(voxels.size, voxels.nbytes, self._parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        choice = dialog.choice()
        dialog.deleteLater()
        if not accepted:
            return
        name = self._files.proposed_name("volume", SUFFIX)
        place = self._files.ask_for_place(TITLE, COMPACT_FILTER, (SUFFIX,), name)
        if place is not None:
            self.write(choice, place)

    def write(self, choice: CompactChoice, place: Path) -> None:
        """Save the open volume."""
        opened, state = self._workspace.opened, self._state
        assert opened is not None
        self._place = place
        what = f"Compressing {opened.volume.name} …"
        self.progress = SaveProgress(TITLE, what, STEPS, self.cancel, self._parent)
        volume = opened.volume.linear
        # The usual axis may stand there because nobody has said anything.
        up = "" if state.up_axis == DEFAULT_UP else state.up_axis
        order = CompactOrder(
            place,
            choice.megabytes,
            choice.error,
            state.transfer_function,
            state.view,
            up,
        )
        # All of its values, over their own range: the TF has the range that is shown.
        self.work.start(volume.over(volume.data_range), order)

    def cancel(self) -> None:
        """Give it up."""
        if self.progress is not None:
            self.news.emit("Saving was cancelled.")
        self.work.cancel()
        self._close_progress()

    def join(self) -> None:
        """Wait until the thread has ended."""
        self.work.join()

    def _show(self, what: str, done: float) -> None:
        if self.progress is not None:
            self.progress.setLabelText(f"{self._place.name}: {what} …")
            self.progress.setValue(round(STEPS * done))

    def _saved(self, result: CompactResult) -> None:
        self._close_progress()
        self.news.emit(f"Saved {self._place.name}: {result.sentence}")

    def _fail(self, text: str) -> None:
        self._close_progress()
        self.problem.emit(text)

    def _close_progress(self) -> None:
        progress, self.progress = self.progress, None
        if progress is not None:
            progress.end()
