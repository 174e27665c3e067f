"""Pictures of the reference and the generator, of any size, for files and the clipboard."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QGuiApplication, QImage, QImageWriter
from PySide6.QtWidgets import QDialog, QWidget

from app.engines.messages import PictureRequest, Quality, Result
from app.figures.picture import save_image
from app.image_view.engine_pane import EnginePane
from app.image_view.picture import compose
from app.state.brightness import Brightness
from app.state.engine_chooser import EngineName
from app.state.viewer_state import ViewerState
from app.window.file_dialogs import FileDialogs
from app.window.legend import legend_painter
from app.window.picture_dialog import PictureChoice, PictureDialog
from model.errors import RenderError
from model.rendering.raster import Raster

PICTURE_FILTER = "PNG images (*.png);;JPEG images (*.jpg *.jpeg);;TIFF images (*.tif *.tiff)"


class PictureSaving(QObject):
    """Asks how a picture shall be, has it drawn, and saves or copies it.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.
    state : ViewerState
    files : FileDialogs
    brightness : Brightness
    """

    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""

    def __init__(
        self, parent: QWidget, state: ViewerState, files: FileDialogs, brightness: Brightness
    ) -> None:
        super().__init__(parent)
        self._brightness = brightness
        self._parent = parent
        self._state = state
        self._files = files
        self.units = ""
        """Unit of the volume's scalars, for the legend."""
        self._last: PictureChoice | None = None
        self._sequence = 0
        self._wanted: tuple[int, PictureChoice, Path | None, EngineName] | None = None
        self._followed: set[EnginePane] = set()

    def save(self, pane: EnginePane) -> None:
        """Ask for size, background and file, and save a pane's picture."""
        choice = self._ask(pane, "Save…")
        if choice is None:
            return
        name = self._files.proposed_name("picture", ".png")
        place = self._files.ask_for_place("Save picture", PICTURE_FILTER, _suffixes(), name)
        if place is not None:
            self.draw(pane, choice, place)

    def copy(self, pane: EnginePane) -> None:
        """Ask for size and background, and copy a pane's picture to the clipboard."""
        choice = self._ask(pane, "Copy")
        if choice is not None:
            self.draw(pane, choice, None)

    def _ask(self, pane: EnginePane, button: str) -> PictureChoice | None:
        image = pane.canvas.image
        if image is None or not pane.client.is_ready:
            self.problem.emit("There is no image to save yet; wait until one is shown.")
            return None
        size = image.width(), image.height()
        if pane.engine == "exact":
            # An image that is still refined has fewer pixels than it will have.
            whole = pane.canvas.picture_rect.size() * pane.canvas.devicePixelRatioF()
            size = max(size, (whole.width(), whole.height()))
        dialog = PictureDialog(size, self._last, button, self._parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        choice = dialog.choice() if accepted else None
        dialog.deleteLater()
        return choice

    def draw(self, pane: EnginePane, choice: PictureChoice, place: Path | None) -> None:
        """Have a picture drawn, and save it to a file; without one, copy it to the clipboard."""
        self._last = choice
        self._sequence += 1
        self._wanted = self._sequence, choice, place, pane.engine
        if pane not in self._followed:
            self._followed.add(pane)
            pane.client.resultReady.connect(self._take)
        raster = Raster(choice.width, choice.height)
        quality = Quality(raster.shorter, raster=raster)
        pane.client.submit(PictureRequest(self._sequence, self._state.inputs, quality))
        self.news.emit(f"Drawing {choice.width} × {choice.height} pixels …")

    def _take(self, result: Result) -> None:
        if not isinstance(result.request, PictureRequest) or self._wanted is None:
            return
        sequence, choice, place, engine = self._wanted
        if result.request.sequence != sequence:
            return
        self._wanted = None
        if result.value is None:
            self.problem.emit(result.error or "The picture could not be drawn; try a smaller one.")
            return
        paint = None
        if choice.legend:
            tf = result.request.inputs.transfer_function
            paint = legend_painter(tf, self.units, background=choice.background)
        try:
            brightness = self._brightness.of(engine)
            image = compose(result.value, choice.background, paint, brightness)
        except RenderError as error:
            self.problem.emit(str(error))
            return
        self._deliver(_enlarged(image, choice), place)

    def _deliver(self, image: QImage, place: Path | None) -> None:
        if place is None:
            QGuiApplication.clipboard().setImage(image)
            self.news.emit("Copied.")
            return
        try:
            save_image(place, image)
        except RenderError as error:
            self.problem.emit(str(error))
        else:
            self.news.emit(f"Saved {place.name}.")


def _enlarged(image: QImage, choice: PictureChoice) -> QImage:
    """Bring a picture to the size asked for, where its engine, a generator, has but one."""
    if (image.width(), image.height()) == (choice.width, choice.height):
        return image
    return image.scaled(
        choice.width,
        choice.height,
        Qt.AspectRatioMode.KeepAspectRatio,
        Qt.TransformationMode.SmoothTransformation,
    )


def _suffixes() -> tuple[str, ...]:
    """Suffixes of the image files that Qt can write, PNG first."""
    endings = {bytes(e.data()).decode() for e in QImageWriter.supportedImageFormats()} - {"png"}
    return ".png", *sorted(f".{ending}" for ending in endings)
