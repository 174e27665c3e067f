"""Movies: a turntable of what is shown, or the path between places on the map of TFs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QDialog, QWidget

from app.engines.channels import Channels
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import PictureRequest
from app.engines.states import EngineState
from app.state.latent_path import LatentPath, MovieOrder
from app.state.movie_writing import MovieWriting
from app.state.viewer_state import ViewerState
from app.window.figure import Subject, figure, pixels_of
from app.window.file_dialogs import FileDialogs
from app.window.movie_dialog import MovieChoice, MovieDialog, MovieKind
from app.window.picture_dialog import MOVIE_SAMPLES, PictureChoice
from app.window.save_progress import SaveProgress
from app.window.shown_images import ShownImages
from model.errors import LatentError, RenderError
from model.rendering.movie_file import SUFFIXES
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.turntable import turntable
from model.scene.view import View

MOVIE_FILTER = "Movies (*.mp4);;Animated images (*.gif)"

CHANGED = "The movie was given up, as its images are drawn otherwise now; save it again."


@dataclass
class _Turntable:
    """A turntable whose pictures are being drawn."""

    choice: MovieChoice
    place: Path
    inputs: SceneInputs
    views: list[View]
    subject: Subject
    drawn: int = 0


class MovieSaving(QObject):
    """Asks how a movie shall be, has its pictures drawn and saves it; shows how far that is.

    Parameters
    ----------
    parent : QWidget
        Parent of the dialogs.
    state : ViewerState
    files : FileDialogs
    shown : ShownImages
    path : LatentPath
        Draws and saves its movies itself.

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
        self,
        parent: QWidget,
        state: ViewerState,
        files: FileDialogs,
        shown: ShownImages,
        path: LatentPath,
    ) -> None:
        super().__init__(parent)
        self._parent = parent
        self._state = state
        self._files = files
        self._shown = shown
        self._path = path
        self.progress: SaveProgress | None = None
        self._turning: _Turntable | None = None
        self._writing = MovieWriting("movie", self)
        self._writing.done.connect(self._saved)
        self._writing.failed.connect(self._fail)
        clients = {name: pane.client for name, pane in shown.panes.items()}
        self._channels = Channels(clients, "movie", self._take, self)
        for name, pane in shown.panes.items():
            pane.client.stateChanged.connect(partial(self._follow, name))

    @property
    def is_running(self) -> bool:
        """Whether a turntable is drawn or written."""
        return self._turning is not None or self._writing.is_running

    @property
    def unfinished(self) -> str:
        """Work that closing the window would lose, in words; empty for none."""
        if self._turning is not None:
            return f"{self._turning.place.name} is being drawn"
        return "A movie is being written" if self.is_running or self._path.is_movie else ""

    def save(self) -> None:
        """Ask what movie, how and where, and save it."""
        self._ask("turntable")

    def save_path(self) -> None:
        """The same for the path between places."""
        self._ask("path")

    def _ask(self, first: MovieKind) -> None:
        sizes = self._shown.sizes()
        kinds = [kind for kind, can in (("turntable", sizes), ("path", self._path.can_play)) if can]
        if not kinds:
            self.problem.emit("There is no image to make a movie of yet; wait until one is shown.")
            return
        if self.is_running or self._path.is_movie:
            self.problem.emit("Another movie is still made; wait for it, or cancel it.")
            return
        kinds.sort(key=lambda kind: kind != first)
        shown = self._shown
        begin = PictureChoice(
            0,
            0,
            legend=shown.legend,
            scale_bar=shown.scale_bar,
            which=shown.which(),
            samples=MOVIE_SAMPLES if shown.is_path_traced else 0,
        )
        dialog = MovieDialog(tuple(kinds), sizes, begin, self._parent)  # type: ignore[arg-type]
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        choice = dialog.choice()
        dialog.deleteLater()
        if not accepted:
            return
        name = self._files.proposed_name(choice.kind, SUFFIXES[0])
        place = self._files.ask_for_place("Save movie", MOVIE_FILTER, SUFFIXES, name)
        if place is not None:
            self.draw(choice, place)

    def draw(self, choice: MovieChoice, place: Path) -> None:
        """Have the pictures of a movie drawn, and save it."""
        if choice.kind == "path":
            order = MovieOrder(place, choice.look.width, choice.count, choice.rate)
            try:
                self._path.play(order)
            except LatentError as error:
                self.problem.emit(str(error))
            return
        state = self._state
        pivot = (float(state.pivot[0]), float(state.pivot[1]), float(state.pivot[2]))
        views = turntable(state.view, choice.count, state.up_axis, state.proportions, pivot)
        self._turning = _Turntable(choice, place, state.inputs, views, self._shown.subject)
        self._writing.start(place, choice.rate)
        what = f"Drawing the pictures of {place.name} …"
        self.progress = SaveProgress("Save movie", what, choice.count, self.cancel, self._parent)
        self._draw_next()

    def cancel(self) -> None:
        """Give a turntable up."""
        self._writing.cancel()
        if self._turning is not None:
            self._channels[self._turning.choice.which].cancel()
            self._turning = None
            self.news.emit("The movie was cancelled.")
        self._close_progress()

    def join(self) -> None:
        """Wait until the thread that writes has ended."""
        self._writing.join()

    def _draw_next(self) -> None:
        turning = self._turning
        assert turning is not None
        look = turning.choice.look
        raster = Raster(look.width, look.height)
        inputs = replace(turning.inputs, view=turning.views[turning.drawn])
        samples = turning.choice.samples if turning.choice.which == "reference" else 0
        quality = Quality(raster.shorter, raster=raster, samples=max(samples, 1))
        self._channels[turning.choice.which].ask(PictureRequest(inputs, quality))

    def _take(self, name: str, result: Result) -> None:
        turning = self._turning
        if turning is None or self._channels[name].is_pending:
            return
        if result.value is None:
            self._fail(result.error or "A picture could not be drawn; try a smaller movie.")
            return
        which, look = turning.choice.which, turning.choice.look
        images = {name: (result.value, self._shown.brightness(name))}
        try:
            picture = figure(look, images, which, result.request.inputs, turning.subject)
        except RenderError as error:
            self._fail(str(error))
            return
        self._writing.add(pixels_of(picture))
        turning.drawn += 1
        if self.progress is not None:
            self.progress.setValue(turning.drawn)
        if self._turning is None:
            return
        if turning.drawn < len(turning.views):
            self._draw_next()
        else:
            self._turning = None
            self._writing.finish()
            self.news.emit("Writing the movie …")

    def _follow(self, name: str, _state: EngineState) -> None:
        """Give up where another engine is started, as it will not answer."""
        turning = self._turning
        if turning is None or name != turning.choice.which:
            return
        if not self._shown.panes[name].client.is_ready:
            self._fail(CHANGED)

    def _saved(self, path: Path) -> None:
        self._close_progress()
        self.news.emit(f"Saved {path.name}.")

    def _fail(self, text: str) -> None:
        self._turning = None
        self._writing.cancel()
        self._close_progress()
        self.problem.emit(text)

    def _close_progress(self) -> None:
        progress, self.progress = self.progress, None
        if progress is not None:
            progress.end()
