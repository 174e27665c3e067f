"""Figures of the reference and the generator, of any size, for files and the clipboard."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QGuiApplication, QImage, QImageWriter
from PySide6.QtWidgets import QDialog, QWidget

from app.engines.messages import PictureRequest, Quality, Result
from app.figures.picture import save_image
from app.state.viewer_state import ViewerState
from app.window.figure import TITLES, Rgba, Subject, figure, panels
from app.window.file_dialogs import FileDialogs
from app.window.picture_dialog import PictureChoice, PictureDialog
from app.window.shown_images import ShownImages
from model.errors import RenderError
from model.rendering.raster import Raster
from model.rendering.scale_bar import DEPTH_TEXT

PICTURE_FILTER = "PNG images (*.png);;JPEG images (*.jpg *.jpeg);;TIFF images (*.tif *.tiff)"


@dataclass
class _Drawing:
    """A figure whose images are being drawn."""

    sequence: int
    choice: PictureChoice
    place: Path | None
    subject: Subject
    images: dict[str, tuple[Rgba, float]] = field(default_factory=dict)


class PictureSaving(QObject):
    """Asks how a figure shall be, has its images drawn, and saves or copies it.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.
    state : ViewerState
    files : FileDialogs
    shown : ShownImages
    """

    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""

    def __init__(
        self, parent: QWidget, state: ViewerState, files: FileDialogs, shown: ShownImages
    ) -> None:
        super().__init__(parent)
        self._parent = parent
        self._state = state
        self._files = files
        self._shown = shown
        self._last: PictureChoice | None = None
        self._sequence = 0
        self._wanted: _Drawing | None = None
        for name, pane in shown.panes.items():
            pane.client.resultReady.connect(partial(self._take, name))

    def save(self) -> None:
        """Ask what to show, how and where, and save the figure."""
        choice = self._ask("Save…")
        if choice is None:
            return
        name = self._files.proposed_name("figure", ".png")
        place = self._files.ask_for_place("Save figure", PICTURE_FILTER, _suffixes(), name)
        if place is not None:
            self.draw(choice, place)

    def copy(self) -> None:
        """Ask what to show and how, and copy the figure to the clipboard."""
        choice = self._ask("Copy")
        if choice is not None:
            self.draw(choice, None)

    def _ask(self, button: str) -> PictureChoice | None:
        sizes = self._shown.sizes()
        if not sizes:
            self.problem.emit("There is no image to save yet; wait until one is shown.")
            return None
        dialog = PictureDialog(sizes, self.first_choice(), button, self._parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        choice = dialog.choice() if accepted else None
        dialog.deleteLater()
        return choice

    def first_choice(self) -> PictureChoice:
        """The choice that the dialog begins with: the screen's, on the last background."""
        shown = self._shown
        choice = PictureChoice(0, 0, legend=shown.legend, scale_bar=shown.scale_bar)
        if self._last is not None:
            choice = replace(choice, background=self._last.background)
        return replace(choice, which=shown.which())

    def draw(self, choice: PictureChoice, place: Path | None) -> None:
        """Have a figure drawn, and save it to a file; without one, copy it to the clipboard."""
        self._last = choice
        self._sequence += 1
        self._wanted = _Drawing(self._sequence, choice, place, self._shown.subject)
        for name in self._names(choice):
            pane = self._shown.panes[name]
            raster = self._raster(name, choice)
            quality = Quality(raster.shorter, raster=raster)
            pane.client.submit(PictureRequest(self._sequence, self._state.inputs, quality))
        self.news.emit(f"Drawing {choice.width} × {choice.height} pixels …")

    def _names(self, choice: PictureChoice) -> list[str]:
        """The images that a figure needs."""
        return [*TITLES] if choice.which in ("both", "difference") else [choice.which]

    def _raster(self, name: str, choice: PictureChoice) -> Raster:
        """Pixels of an image in a figure; a generator has its own."""
        if choice.which == "difference":
            # The reference's at the generator's pixels.
            image = self._shown.panes["generator"].canvas.image
            side = min(choice.width, choice.height) if image is None else image.width()
            return Raster(side, side)
        place = panels(choice, choice.which)[-1]
        return Raster(place.width(), place.height())

    def _take(self, name: str, result: Result) -> None:
        wanted = self._wanted
        if type(result.request) is not PictureRequest or wanted is None:
            return
        if result.request.sequence != wanted.sequence:
            return
        if result.value is None:
            self._wanted = None
            self.problem.emit(result.error or "The figure could not be drawn; try a smaller one.")
            return
        wanted.images[name] = result.value, self._shown.brightness(name)
        if len(wanted.images) < len(self._names(wanted.choice)):
            return
        self._wanted = None
        choice, inputs = wanted.choice, result.request.inputs
        try:
            image = figure(choice, wanted.images, choice.which, inputs, wanted.subject)
        except RenderError as error:
            self.problem.emit(str(error))
            return
        if choice.scale_bar:
            image.setText("Scale bar", f"Holds {DEPTH_TEXT}")
        self._deliver(image, wanted.place)

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


def _suffixes() -> tuple[str, ...]:
    """Suffixes of the image files that Qt can write, PNG first."""
    endings = {bytes(e.data()).decode() for e in QImageWriter.supportedImageFormats()} - {"png"}
    return ".png", *sorted(f".{ending}" for ending in endings)
