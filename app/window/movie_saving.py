"""Movies of one full turn: the dialog, the drawing of their pictures, and the file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from queue import SimpleQueue

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QDialog, QDoubleSpinBox, QFormLayout, QSpinBox, QWidget

from app.engines.background import LatestCall
from app.engines.channels import Channels
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import PictureRequest
from app.engines.states import EngineState
from app.state.viewer_state import ViewerState
from app.wheel_guard import WheelGuard
from app.window.figure import FigureLook, Subject, Which, figure, pixels_of
from app.window.file_dialogs import FileDialogs
from app.window.picture_dialog import finish_dialog
from app.window.save_progress import SaveProgress
from app.window.shown_images import ShownImages
from app.window.size_chooser import SizeChooser
from model.errors import RenderError
from model.rendering.movie_file import SUFFIXES, write_movie
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.turntable import turntable
from model.scene.view import View

MOVIE_FILTER = "Movies (*.mp4);;Animated images (*.gif)"

CHANGED = "The movie was cancelled: volume, light or quality changed. Save it again."

LONGER_SIDES = (512, 1024, 1920)
LARGEST = 4096
"""Most pixels along a side that players show."""

SHORTEST, LONGEST = 0.5, 600.0
"""Limits of a movie's length in seconds."""

USUAL_SECONDS, USUAL_RATE, HIGHEST_RATE = 8.0, 25, 60

SAMPLES = 16
"""Of each pixel, in path-traced light."""


@dataclass(frozen=True)
class MovieChoice:
    """Width and height of a movie, its length, and its pictures a second."""

    width: int
    height: int
    seconds: float = USUAL_SECONDS
    rate: int = USUAL_RATE

    @property
    def count(self) -> int:
        """Number of pictures."""
        return max(round(self.seconds * self.rate), 2)


class MovieDialog(QDialog):
    """Asks for a movie's size, length and rate.

    Parameters
    ----------
    width, height : int
        Of the image on the screen.
    """

    def __init__(self, width: int, height: int, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Save movie")
        self.chooser = SizeChooser(self, LONGER_SIDES, LARGEST)
        self.seconds_box, self.rate_box = QDoubleSpinBox(), QSpinBox()
        self.seconds_box.setRange(SHORTEST, LONGEST)
        self.seconds_box.setDecimals(1)
        self.seconds_box.setValue(USUAL_SECONDS)
        self.rate_box.setRange(1, HIGHEST_RATE)
        self.rate_box.setValue(USUAL_RATE)
        form = QFormLayout()
        form.setVerticalSpacing(8)
        self.chooser.add_to(form)
        for name, box in (("Seconds", self.seconds_box), ("Frames per second", self.rate_box)):
            WheelGuard(box)
            box.setToolTip(f"From {box.minimum():g} to {box.maximum():g}")
            form.addRow(name, box)
        self.chooser.set_present(width, height)
        finish_dialog(self, form, "Save…")

    def choice(self) -> MovieChoice:
        """Return what is chosen; the sides are even numbers, as movies' have to be."""
        width, height = (side // 2 * 2 for side in self.chooser.size_chosen)
        return MovieChoice(width, height, self.seconds_box.value(), self.rate_box.value())


@dataclass
class _Turntable:
    """A full turn whose pictures are drawn one after the other, and written meanwhile."""

    place: Path
    which: Which
    look: FigureLook
    inputs: SceneInputs
    subject: Subject
    samples: int
    views: list[View]
    pictures: SimpleQueue[NDArray[np.uint8] | None] = field(default_factory=SimpleQueue)
    drawn: int = 0
    is_given_up: bool = False

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """Yield its pictures as they are drawn; raise where it is given up."""
        while (picture := self.pictures.get()) is not None:
            yield picture
        if self.is_given_up:
            raise _GivenUpError


class _GivenUpError(Exception):
    """Ends the writing of a movie that nobody wants."""


class MovieSaving(QObject):
    """Asks how a movie shall be, has its pictures drawn and saves it; shows how far that is.

    It shows the ground truth, or the generator where that is alone on the screen, with the legend
    and the scale bar that lie over it.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.

    Attributes
    ----------
    progress : SaveProgress or None
        What is seen of a movie under way, with the button that ends it.
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
        self.progress: SaveProgress | None = None
        self._turning: _Turntable | None = None
        self._writing = LatestCall("movie", self)
        self._writing.done.connect(self._saved)
        self._writing.failed.connect(self._fail)
        clients = {name: pane.client for name, pane in shown.panes.items()}
        self._channels = Channels(clients, "movie", self._take, self)
        for name, pane in shown.panes.items():
            pane.client.stateChanged.connect(partial(self._follow, name))

    @property
    def is_running(self) -> bool:
        """Whether a movie is drawn or written."""
        return self._turning is not None or self._writing.is_running

    @property
    def unfinished(self) -> str:
        """Work that closing the window would lose, in words; empty for none."""
        if self._turning is not None:
            return f"{self._turning.place.name} is being drawn"
        return "A movie is being written" if self.is_running else ""

    def save(self) -> None:
        """Ask how and where, and save a movie."""
        which = self._which()
        if which is None:
            self.problem.emit("There is no image to make a movie of yet; wait until one is shown.")
            return
        if self.is_running:
            self.problem.emit("Another movie is being made; wait for it, or cancel it.")
            return
        dialog = MovieDialog(*self._shown.sizes()[which], self._parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        choice = dialog.choice()
        dialog.deleteLater()
        if not accepted:
            return
        name = self._files.proposed_name("turntable", SUFFIXES[0])
        place = self._files.ask_for_place("Save movie", MOVIE_FILTER, SUFFIXES, name)
        if place is not None:
            self.draw(choice, place)

    def draw(self, choice: MovieChoice, place: Path) -> None:
        """Have the pictures of a movie drawn, and save it."""
        state, shown = self._state, self._shown
        which = self._which() or "reference"
        is_traced = shown.is_path_traced and which == "reference"
        pivot = (float(state.pivot[0]), float(state.pivot[1]), float(state.pivot[2]))
        self._turning = turning = _Turntable(
            place,
            which,
            FigureLook(
                choice.width, choice.height, shown.background, shown.legend, shown.scale_bar
            ),
            state.inputs,
            shown.subject,
            SAMPLES if is_traced else 1,
            turntable(state.view, choice.count, state.up_axis, state.proportions, pivot),
        )
        self._writing.ask(partial(write_movie, place, turning.frames(), choice.rate))
        what = f"Drawing the pictures of {place.name} …"
        self.progress = SaveProgress("Save movie", what, choice.count, self.cancel, self._parent)
        self._draw_next(turning)

    def cancel(self) -> None:
        """Give a movie up."""
        if self._turning is not None:
            self.news.emit("The movie was cancelled.")
        self._end()

    def join(self) -> None:
        """Wait until the thread that writes has ended."""
        self._writing.join()

    def _which(self) -> Which | None:
        """The image that a movie shows; None where there is none yet."""
        sizes, seen = self._shown.sizes(), self._shown.which()
        order: tuple[Which, ...] = ("reference", "generator")
        if seen == "generator":
            order = ("generator", "reference")
        return next((which for which in order if which in sizes), None)

    def _draw_next(self, turning: _Turntable) -> None:
        raster = Raster(turning.look.width, turning.look.height)
        inputs = replace(turning.inputs, view=turning.views[turning.drawn])
        quality = Quality(raster.shorter, raster=raster, samples=turning.samples)
        self._channels[turning.which].ask(PictureRequest(inputs, quality))

    def _take(self, name: str, result: Result) -> None:
        turning = self._turning
        if turning is None or self._channels[name].is_pending:
            return
        if result.value is None:
            self._fail(result.error or "A picture could not be drawn; try a smaller movie.")
            return
        images = {name: (result.value, self._shown.brightness(name))}
        try:
            picture = figure(
                turning.look, images, turning.which, result.request.inputs, turning.subject
            )
        except RenderError as error:
            self._fail(str(error))
            return
        turning.pictures.put(pixels_of(picture))
        turning.drawn += 1
        if self.progress is not None:
            self.progress.setValue(turning.drawn)
        if self._turning is None:
            return
        if turning.drawn < len(turning.views):
            self._draw_next(turning)
        else:
            self._turning = None
            turning.pictures.put(None)
            self.news.emit("Writing the movie …")

    def _follow(self, name: str, _state: EngineState) -> None:
        """Give up where another engine is started, as it will not answer."""
        turning = self._turning
        if turning is None or name != turning.which:
            return
        if not self._shown.panes[name].client.is_ready:
            self._fail(CHANGED)

    def _saved(self, path: Path) -> None:
        self._close_progress()
        self.news.emit(f"Saved {path.name}.")

    def _fail(self, text: str) -> None:
        self._end()
        self.problem.emit(text)

    def _end(self) -> None:
        """Have nothing drawn or written any more."""
        turning, self._turning = self._turning, None
        self._writing.forget()
        if turning is not None:
            self._channels[turning.which].cancel()
            turning.is_given_up = True
            turning.pictures.put(None)
        self._close_progress()

    def _close_progress(self) -> None:
        progress, self.progress = self.progress, None
        if progress is not None:
            progress.end()
