"""Figures of the reference and the generator, of any size, for files and the clipboard."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QGuiApplication, QImage, QImageWriter
from PySide6.QtWidgets import QDialog, QWidget

from app.engines.channels import Channels
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import PictureRequest
from app.figures.picture import save_image
from app.state.at_work import AtWork
from app.state.viewer_state import ViewerState
from app.window.figure import TITLES, Rgba, Subject, figure, panels
from app.window.file_dialogs import FileDialogs
from app.window.picture_dialog import PICTURE_SAMPLES, PictureChoice, PictureDialog
from app.window.save_progress import SaveProgress
from app.window.shown_images import ShownImages
from model.errors import RenderError
from model.rendering.raster import Raster
from model.rendering.scale_bar import DEPTH_TEXT
from model.scene.inputs import SceneInputs

PICTURE_FILTER = "PNG images (*.png);;JPEG images (*.jpg *.jpeg);;TIFF images (*.tif *.tiff)"


@dataclass
class _Drawing:
    """A figure whose images are being drawn."""

    choice: PictureChoice
    place: Path | None
    subject: Subject
    inputs: SceneInputs
    images: dict[str, tuple[Rgba, float]] = field(default_factory=dict)
    error: float | None = None
    """Estimated error of the reference's image; None without an estimate."""


STEPS = 1000
"""Of a figure's progress."""

CHANGED = "The figure was cancelled: volume, light or quality changed. Save it again."


class PictureSaving(QObject):
    """Asks how a figure shall be, has its images drawn, and saves or copies it.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.

    Attributes
    ----------
    progress : SaveProgress or None
        What is seen of a figure that takes long, with the button that ends it.
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
        self._wanted: _Drawing | None = None
        self.progress: SaveProgress | None = None
        clients = {name: pane.client for name, pane in shown.panes.items()}
        self._channels = Channels(clients, "figure", self._take, self)
        for name, pane in shown.panes.items():
            pane.client.stateChanged.connect(lambda _state, name=name: self._follow(name))
        self._at_work = AtWork(self._channels.values(), self)
        self._at_work.changed.connect(self._show_progress)

    @property
    def unfinished(self) -> str:
        """Work that closing the window would lose, in words; empty for none."""
        if self._wanted is None:
            return ""
        place = self._wanted.place
        return f"{'A figure to be copied' if place is None else place.name} is being drawn"

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
        """The choice that the dialog begins with: the last one, at first that of the screen."""
        shown = self._shown
        choice = PictureChoice(0, 0, shown.background, shown.legend, shown.scale_bar)
        choice = self._last or choice
        samples = choice.samples or PICTURE_SAMPLES if shown.is_path_traced else 0
        return replace(choice, which=shown.which(), samples=samples)

    def draw(self, choice: PictureChoice, place: Path | None) -> None:
        """Have a figure drawn, and save it to a file; without one, copy it to the clipboard."""
        self._last = choice
        inputs, subject = self._state.inputs, self._shown.subject
        self._end()
        self._wanted = _Drawing(choice, place, subject, inputs)
        if choice.which == "difference":
            self._draw_difference(self._wanted)
            return
        for name in self._names(choice):
            raster = self._raster(choice)
            samples = choice.samples if name == "reference" else 0
            quality = Quality(raster.shorter, raster=raster, samples=max(samples, 1))
            self._channels[name].ask(PictureRequest(inputs, quality))
        self.news.emit(f"Drawing {choice.width} × {choice.height} pixels …")

    def cancel(self) -> None:
        """Give up the figure that is being drawn."""
        if self._wanted is not None:
            self._end()
            self.news.emit("The figure was cancelled.")

    def _draw_difference(self, wanted: _Drawing) -> None:
        """Draw the difference of both images as they are shown: the numbers are the screen's."""
        compared = self._shown.compared
        if compared is None:
            self._end()
            self.problem.emit("There is no difference to save; wait until both images are at rest.")
            return
        wanted.images = {name: (image, 1.0) for name, image in zip(TITLES, compared, strict=True)}
        self._finish(wanted)

    def _names(self, choice: PictureChoice) -> list[str]:
        """The images that a figure needs."""
        return [*TITLES] if choice.which == "both" else [choice.which]

    def _raster(self, choice: PictureChoice) -> Raster:
        """Pixels of an image in a figure; a generator has its own."""
        place = panels(choice, choice.which)[-1]
        return Raster(place.width(), place.height())

    def _take(self, name: str, result: Result) -> None:
        wanted = self._wanted
        if wanted is None or self._channels[name].is_pending:
            return
        if result.value is None:
            self._end()
            self.problem.emit(result.error or "The figure could not be drawn; try a smaller one.")
            return
        wanted.images[name] = result.value, self._shown.brightness(name)
        if name == "reference":
            wanted.error = result.image_error
        if len(wanted.images) < len(self._names(wanted.choice)):
            return
        self._finish(wanted)

    def _follow(self, name: str) -> None:
        """Say that a figure is not saved where another engine is started, as it will not answer."""
        wanted = self._wanted
        if wanted is None or name in wanted.images or name not in self._names(wanted.choice):
            return
        if not self._shown.panes[name].client.is_ready:
            self._end()
            self.problem.emit(CHANGED)

    def _show_progress(self, part: float | None) -> None:
        """Show how much of a figure is there, once it takes long."""
        wanted = self._wanted
        if wanted is None or part is None:
            return
        if self.progress is None:
            choice = wanted.choice
            name = "the figure" if wanted.place is None else wanted.place.name
            what = f"Drawing {name}, {choice.width} × {choice.height} pixels …"
            self.progress = SaveProgress("Save figure", what, STEPS, self.cancel, self._parent)
        self.progress.setValue(int(STEPS * part))

    def _end(self) -> None:
        """Wait for nothing any more."""
        self._wanted = None
        self._channels.cancel()
        progress, self.progress = self.progress, None
        if progress is not None:
            progress.end()

    def _finish(self, wanted: _Drawing) -> None:
        self._end()
        choice, inputs = wanted.choice, wanted.inputs
        try:
            image = figure(choice, wanted.images, choice.which, inputs, wanted.subject)
        except RenderError as error:
            self.problem.emit(str(error))
            return
        if choice.scale_bar:
            image.setText("Scale bar", f"Holds {DEPTH_TEXT}")
        if choice.samples and "reference" in self._names(choice):
            image.setText("Light", f"Path-traced, {choice.samples} samples of each pixel")
        if "reference" in self._names(choice) and choice.which != "difference":
            text = _error_text(wanted.error)
            if text:
                image.setText("Error", text)
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


def _error_text(estimated: float | None) -> str:
    """Say how far the ground truth is from the exact image; nothing where that is not known."""
    if estimated is None or not math.isfinite(estimated):
        return ""
    return f"Estimated RMSE of the ground truth's colours, from 0 to 1: {estimated:.2g}."


def _suffixes() -> tuple[str, ...]:
    """Suffixes of the image files that Qt can write, PNG first."""
    endings = {bytes(e.data()).decode() for e in QImageWriter.supportedImageFormats()} - {"png"}
    return ".png", *sorted(f".{ending}" for ending in endings)
