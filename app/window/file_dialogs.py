"""The file dialogs of the window and what follows them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject
from PySide6.QtGui import QImageWriter
from PySide6.QtWidgets import QFileDialog

from app.image_view.engine_pane import EnginePane
from model.errors import TransferFunctionError
from model.volume_files import SUFFIXES

if TYPE_CHECKING:
    from app.window.main_window import MainWindow

VOLUME_FILTER = f"Volumes ({' '.join(f'*{s}' for s in SUFFIXES)});;All files (*)"
TF_FILTER = "Transfer functions (*.json);;All files (*)"
IMAGE_FILTER = "PNG images (*.png)"


def image_formats() -> set[str]:
    """Endings of the image files that Qt can write."""
    return {bytes(ending.data()).decode() for ending in QImageWriter.supportedImageFormats()}


class FileDialogs(QObject):
    """Asks for files and hands them on; what goes wrong is told in the window."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window = window

    def open_volume(self) -> None:
        """Ask for a volume file and open it."""
        name, _ = QFileDialog.getOpenFileName(self._window, "Open volume", "", VOLUME_FILTER)
        if name:
            self._window.workspace.open_volume(Path(name))

    def open_dicom(self) -> None:
        """Ask for a folder with DICOM slices and open it."""
        name = QFileDialog.getExistingDirectory(self._window, "Open DICOM folder")
        if name:
            self._window.workspace.open_volume(Path(name))

    def open_model(self) -> None:
        """Ask for a model's folder and open it."""
        name = QFileDialog.getExistingDirectory(self._window, "Open model")
        if name:
            self._window.workspace.open_model(Path(name))

    def open_transfer_function(self) -> None:
        """Ask for a TF file and take it over; it can be undone."""
        name, _ = QFileDialog.getOpenFileName(self._window, "Open TF", "", TF_FILTER)
        if name:
            self.take_transfer_function(Path(name))

    def take_transfer_function(self, path: Path) -> None:
        """Take over a TF file."""
        try:
            same_range = self._window.state.open_transfer_function(path)
        except TransferFunctionError as error:
            self._window.notice.tell(str(error))
            return
        fitted = "" if same_range else "; it was made for another scalar range and fitted to this"
        self._window.statusBar().showMessage(f"Opened {path.name}{fitted}.")

    def save_transfer_function(self) -> None:
        """Ask for a place and write the TF there."""
        name, _ = QFileDialog.getSaveFileName(self._window, "Save TF", "tf.json", TF_FILTER)
        if not name:
            return
        path = Path(name)
        try:
            self._window.state.save_transfer_function(path)
        except TransferFunctionError as error:
            self._window.notice.tell(str(error))
        else:
            self._window.statusBar().showMessage(f"Saved {path.name}.")

    def save_image(self, pane: EnginePane) -> None:
        """Ask for a place and write a pane's image there, at its own size."""
        image = pane.canvas.image
        if image is None:
            self._window.notice.tell("There is no image to save yet.")
            return
        name, _ = QFileDialog.getSaveFileName(self._window, "Save image", "", IMAGE_FILTER)
        if not name:
            return
        path = Path(name)
        if path.suffix.lower().lstrip(".") not in image_formats():
            # Qt's dialog does not add the ending by itself, and the format follows it.
            path = path.with_name(path.name + ".png")
            if path.exists():
                self._window.notice.tell(
                    f"{path}: the file is there already; choose it itself to replace it, "
                    "or another name."
                )
                return
        if image.save(str(path)):
            self._window.statusBar().showMessage(f"Saved {path.name}.")
        else:
            self._window.notice.tell(f"{path}: the image cannot be written; choose another place.")
