"""The file dialogs of the window and their actions."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QImageWriter
from PySide6.QtWidgets import QFileDialog, QWidget

from app.figures.sensitivity_figure import save_figure
from app.image_view.engine_pane import EnginePane
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from model.errors import RenderError, TransferFunctionError
from model.sensitivity.result import NUMBER_SUFFIXES, SensitivityResult, save_numbers
from model.volume_files import SUFFIXES

VOLUME_FILTER = f"Volumes ({' '.join(f'*{s}' for s in SUFFIXES)});;All files (*)"
TF_FILTER = "Transfer functions (*.json);;All files (*)"
SENSITIVITY_FILTER = "Figures (*.png);;Arrays (*.npz);;Tables (*.csv)"
IMAGE_FILTER = "PNG images (*.png)"


def image_formats() -> set[str]:
    """Return the suffixes of the image files that Qt can write."""
    return {bytes(ending.data()).decode() for ending in QImageWriter.supportedImageFormats()}


class FileDialogs(QObject):
    """Shows file dialogs and opens or saves the chosen files.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.
    state : ViewerState
    workspace : Workspace
    """

    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""

    def __init__(self, parent: QWidget, state: ViewerState, workspace: Workspace) -> None:
        super().__init__(parent)
        self._parent = parent
        self._state = state
        self._workspace = workspace

    def open_volume(self) -> None:
        """Ask for a volume file and open it."""
        name, _ = QFileDialog.getOpenFileName(self._parent, "Open volume", "", VOLUME_FILTER)
        if name:
            self._workspace.open_volume(Path(name))

    def open_dicom(self) -> None:
        """Ask for a folder with DICOM slices and open it."""
        name = QFileDialog.getExistingDirectory(self._parent, "Open DICOM folder")
        if name:
            self._workspace.open_volume(Path(name))

    def open_model(self) -> None:
        """Ask for a model's folder and open it."""
        name = QFileDialog.getExistingDirectory(self._parent, "Open model")
        if name:
            self._workspace.open_model(Path(name))

    def open_transfer_function(self) -> None:
        """Ask for a TF file and open it, as an edit that can be undone."""
        name, _ = QFileDialog.getOpenFileName(self._parent, "Open TF", "", TF_FILTER)
        if name:
            self.take_transfer_function(Path(name))

    def take_transfer_function(self, path: Path) -> None:
        """Open a TF file and report the outcome."""
        try:
            same_range = self._state.open_transfer_function(path)
        except TransferFunctionError as error:
            self.problem.emit(str(error))
            return
        fitted = "" if same_range else "; it was made for another scalar range and fitted to this"
        self.news.emit(f"Opened {path.name}{fitted}.")

    def save_transfer_function(self) -> None:
        """Ask for a file and write the TF to it."""
        name, _ = QFileDialog.getSaveFileName(self._parent, "Save TF", "tf.json", TF_FILTER)
        if not name:
            return
        path = Path(name)
        try:
            self._state.save_transfer_function(path)
        except TransferFunctionError as error:
            self.problem.emit(str(error))
        else:
            self.news.emit(f"Saved {path.name}.")

    def save_sensitivity(self, result: SensitivityResult | None) -> None:
        """Ask for a file and write a sensitivity to it: a figure, or all numbers."""
        if result is None:
            self.problem.emit("There is no sensitivity of this image to save yet.")
            return
        name, _ = QFileDialog.getSaveFileName(
            self._parent, "Save sensitivity", "", SENSITIVITY_FILTER
        )
        if not name:
            return
        path = Path(name)
        if path.suffix.lower() not in (".png", *NUMBER_SUFFIXES):
            # Qt's dialog does not add the suffix, which determines the format.
            path = path.with_name(path.name + ".png")
        try:
            if path.suffix.lower() == ".png":
                save_figure(path, result)
            else:
                save_numbers(path, result)
        except RenderError as error:
            self.problem.emit(str(error))
        else:
            self.news.emit(f"Saved {path.name}.")

    def save_image(self, pane: EnginePane) -> None:
        """Ask for a file and write a pane's image to it, in its original size."""
        image = pane.canvas.image
        if image is None:
            self.problem.emit("There is no image to save yet.")
            return
        name, _ = QFileDialog.getSaveFileName(self._parent, "Save image", "", IMAGE_FILTER)
        if not name:
            return
        path = Path(name)
        if path.suffix.lower().lstrip(".") not in image_formats():
            # Qt's dialog does not add the suffix, which determines the format.
            path = path.with_name(path.name + ".png")
            if path.exists():
                self.problem.emit(
                    f"{path}: the file is there already; choose it itself to replace it, "
                    "or another name."
                )
                return
        if image.save(str(path)):
            self.news.emit(f"Saved {path.name}.")
        else:
            self.problem.emit(f"{path}: the image cannot be written; choose another place.")
