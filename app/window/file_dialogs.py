"""The file dialogs of the window and their actions."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from app.figures.sensitivity_figure import save_figure
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.window.file_opening import OPEN_FILTER, TF_SUFFIX, FileOpening
from model.errors import RenderError, TransferFunctionError
from model.sensitivity.result import NUMBER_SUFFIXES, SensitivityResult, save_numbers

TF_FILTER = "Transfer functions (*.json);;All files (*)"
SENSITIVITY_FILTER = "Figures (*.png);;Arrays (*.npz);;Tables (*.csv)"


class FileDialogs(QObject):
    """Asks for files and folders, which are then opened or saved.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.
    preferences : Preferences
        Dialogs begin in the folder of the last file.
    """

    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""

    def __init__(
        self,
        parent: QWidget,
        state: ViewerState,
        opening: FileOpening,
        preferences: Preferences,
    ) -> None:
        super().__init__(parent)
        self._parent = parent
        self._state = state
        self._opening = opening
        self._preferences = preferences
        self.volume_name = ""
        """Name of the open volume, from which names of new files are made."""

    def proposed_name(self, otherwise: str, suffix: str) -> str:
        """Return a new file's name: the volume's, or another where that gives none."""
        return f"{file_name(self.volume_name) or otherwise}{suffix}"

    def open_volume(self) -> None:
        """Ask for a file with a volume or a session and open it."""
        self._open_file("Open volume or session", OPEN_FILTER, self._opening.open)

    def open_dicom(self) -> None:
        """Ask for a folder with DICOM slices and open it."""
        self._open_folder("Open DICOM folder", self._opening.open_volume)

    def open_model(self) -> None:
        """Ask for a model's folder and open it."""
        self._open_folder("Open model", self._opening.open_model)

    def open_transfer_function(self) -> None:
        """Ask for a TF file and open it, as an edit that can be undone."""
        self._open_file("Open TF", TF_FILTER, self._opening.open_transfer_function)

    def save_transfer_function(self) -> None:
        """Ask for a file and write the TF to it."""
        name = self.proposed_name("tf", TF_SUFFIX)
        path = self.ask_for_place("Save TF", TF_FILTER, (TF_SUFFIX,), name)
        if path is None:
            return
        try:
            self._state.save_transfer_function(path)
        except TransferFunctionError as error:
            self.problem.emit(str(error))
        else:
            self._preferences.note_recent("transfer_functions", path)
            self.news.emit(f"Saved {path.name}.")

    def save_sensitivity(self, result: SensitivityResult | None) -> None:
        """Ask for a file and write a sensitivity to it: a figure, or all numbers."""
        if result is None:
            self.problem.emit("There is no sensitivity of this image to save yet.")
            return
        suffixes = (".png", *NUMBER_SUFFIXES)
        path = self.ask_for_place("Save sensitivity", SENSITIVITY_FILTER, suffixes)
        if path is None:
            return
        try:
            if path.suffix.lower() == ".png":
                save_figure(path, result)
            else:
                save_numbers(path, result)
        except RenderError as error:
            self.problem.emit(str(error))
        else:
            self.news.emit(f"Saved {path.name}.")

    def ask_for_place(
        self, title: str, filters: str, suffixes: tuple[str, ...], name: str = ""
    ) -> Path | None:
        """Ask for a file to write; None if the user does not want to.

        A name without one of the suffixes, which determine the format, gets the first of them.
        """
        start = str(Path(self._preferences.settings.last_folder) / name)
        chosen, _ = QFileDialog.getSaveFileName(self._parent, title, start, filters)
        if not chosen:
            return None
        path = Path(chosen)
        if path.suffix.lower() not in suffixes:
            # Qt's dialog has asked about the file without the suffix only.
            path = path.with_name(path.name + suffixes[0])
            if path.exists() and not self._may_replace(path):
                return None
        self._preferences.set(last_folder=str(path.absolute().parent))
        return path

    def _may_replace(self, path: Path) -> bool:
        text = f"{path.name} is there already. Replace it?"
        answer = QMessageBox.question(self._parent, "Replace", text)
        return answer == QMessageBox.StandardButton.Yes

    def _open_file(self, title: str, filters: str, open_it: Callable[[Path], object]) -> None:
        folder = self._preferences.settings.last_folder
        name, _ = QFileDialog.getOpenFileName(self._parent, title, folder, filters)
        self._take(name, open_it)

    def _open_folder(self, title: str, open_it: Callable[[Path], object]) -> None:
        folder = self._preferences.settings.last_folder
        self._take(QFileDialog.getExistingDirectory(self._parent, title, folder), open_it)

    def _take(self, name: str, open_it: Callable[[Path], object]) -> None:
        if name:
            path = Path(name)
            self._preferences.set(last_folder=str(path.absolute().parent))
            open_it(path)


def file_name(name: str) -> str:
    """Return a name without what file systems or their users would trip over."""
    return re.sub(r"[^\w.+=-]+", "_", name).strip("._")[:100]
