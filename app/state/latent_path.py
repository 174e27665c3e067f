"""A path between named places, played as an animation, or drawn frame by frame for a movie."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.channels import Channels
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest
from app.state.brightness import Brightness
from app.state.engine_chooser import EngineName
from app.state.latent_drawer import LatentDrawer
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentState, Place
from app.state.movie_writing import MovieWriting
from app.state.viewer_state import ViewerState
from model.errors import LatentError
from model.latent.movie import movie_frame
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF

FRAMES_PER_LEG = 48
FRAME_MS = 40
"""25 frames a second, or as many as the engine draws."""

PLAYED_SIZE = 192

Images = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture of a path, with its TF and the place on the map."""

    number: int
    count: int
    place: Place
    tf: OpacityTF
    image: Images


@dataclass(frozen=True)
class MovieOrder:
    """A path as a movie.

    Attributes
    ----------
    file : Path
    size : int
        Width of its pictures in pixels, where the engine has no size of its own.
    count : int
        Number of pictures.
    rate : float
        Pictures a second.
    """

    file: Path
    size: int
    count: int
    rate: float


class LatentPath(QObject):
    """Has the frames of a path drawn one after the other.

    Parameters
    ----------
    state : ViewerState
    latent : LatentState
        Its named places are visited in their order.
    session : LatentSession
    drawer : LatentDrawer
        Knows the engines, and which of them draws.
    brightness : Brightness
        Of movies.
    """

    frameDrawn = Signal(object)
    """Emitted with a :class:`Frame`, or None at the end."""
    ended = Signal(str)
    """Emitted at the end of a path or movie with a sentence for the user, or nothing."""

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        session: LatentSession,
        drawer: LatentDrawer,
        brightness: Brightness,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._brightness = brightness
        self._state = state
        self._latent = latent
        self._session = session
        self._drawer = drawer
        self._tfs: list[OpacityTF] = []
        self._codes: NDArray[np.float32] | None = None
        self._places: list[Place] = []
        self._inputs: SceneInputs | None = None
        self._number = 0
        self._engine: EngineName = "exact"
        self._movie: MovieOrder | None = None
        self._waiting: Frame | None = None
        self._timer = QTimer(self, interval=FRAME_MS)
        self._timer.timeout.connect(self._show)
        self._writing = MovieWriting("latent-movie", self)
        self._writing.done.connect(lambda path: self.ended.emit(f"Saved {path}."))
        self._writing.failed.connect(self._movie_failed)
        self._channels = Channels(drawer.clients, "path", self._take, self)
        session.mapClosed.connect(self.cancel)

    @property
    def engine(self) -> EngineName:
        """The engine that draws the frames."""
        return self._engine

    @property
    def is_movie(self) -> bool:
        """True while frames of a movie are drawn or written."""
        return (self.is_running and self._movie is not None) or self._writing.is_running

    @property
    def can_play(self) -> bool:
        """Whether there is a map with named places to visit."""
        there = self._session.space is not None and self._session.map is not None
        return there and bool(self._latent.places)

    @property
    def is_running(self) -> bool:
        """True while a path is played or drawn."""
        return bool(self._tfs)

    def play(self, movie: MovieOrder | None = None) -> None:
        """Visit the named places; without two of them, from the present TF to the only one.

        Parameters
        ----------
        movie : MovieOrder, optional
            File to write the frames to, instead of playing them at their pace.

        Raises
        ------
        LatentError
            With too few places, or while another movie is written.
        """
        from model.latent.path import path_codes

        space, map_ = self._session.space, self._session.map
        if space is None or map_ is None:
            return
        if movie is not None and self._writing.is_running:
            raise LatentError("Another movie is still written; try again in a moment.")
        self.cancel()
        tfs = [named.tf for named in self._latent.places]
        if len(tfs) == 1:
            tfs.insert(0, self._state.transfer_function.opacity)
        stations = np.array([space.code_of(tf) for tf in tfs])
        usual = FRAMES_PER_LEG * max(len(tfs) - 1, 1) + 1
        codes = path_codes(space.codec, stations, usual if movie is None else movie.count)
        self._tfs = space.tfs_of(codes)
        self._codes = codes if self._drawer.from_codes else None
        self._places = [map_.place(code) for code in codes]
        self._inputs, self._number, self._movie = self._state.inputs, 0, movie
        self._waiting = None
        # The same engine to the end: frames of another would have another size.
        self._engine = self._drawer.source
        if movie is None:
            self._timer.start()
        else:
            self._writing.start(movie.file, movie.rate)
        self._ask()

    def cancel(self) -> None:
        """End the path, without a movie."""
        if self._tfs:
            self._timer.stop()
            self._tfs, self._waiting = [], None
            if self._movie is not None:
                self._writing.cancel()
            self._channels[self._engine].cancel()
            self.frameDrawn.emit(None)
            self.ended.emit("")

    def stop(self) -> None:
        """Ask nothing any more; a movie whose frames are all drawn is still written."""
        self._timer.stop()
        if self._tfs and self._movie is not None:
            self._writing.cancel()
        self._tfs = []

    def join(self) -> None:
        """Wait until a movie is written."""
        self._writing.join()

    def _movie_failed(self, text: str) -> None:
        self.cancel()
        self.ended.emit(text)

    def _ask(self) -> None:
        assert self._inputs is not None
        wanted = PLAYED_SIZE if self._movie is None else self._movie.size
        size = self._drawer.size_of(self._engine, wanted)
        # The view may turn while a path is played.
        inputs = self._state.inputs if self._movie is None else self._inputs
        number = self._number
        code = () if self._codes is None else (tuple(self._codes[number].tolist()),)
        request = BatchRequest(
            replace(inputs, opacity_tf=self._tfs[number]),
            Quality(size),
            codes=code,
        )
        self._channels[self._engine].ask(request)

    def _take(self, name: EngineName, result: Result) -> None:
        if self._channels[name].is_pending or not self._tfs:
            return
        if result.value is None:
            problem = result.error or ""
            self.cancel()
            self.ended.emit(problem)
            return
        number = self._number
        self._waiting = Frame(
            number, len(self._tfs), self._places[number], self._tfs[number], result.value[0]
        )
        if self._movie is not None:
            self._writing.add(
                movie_frame(
                    result.value[0],
                    self._tfs[number],
                    result.request.inputs.color_tf,
                    self._brightness.of(self._engine),
                )
            )
            self._show()

    def _show(self) -> None:
        """Show the frame that is drawn, and have the next one drawn."""
        frame, self._waiting = self._waiting, None
        if frame is None:
            return
        self._number += 1
        self.frameDrawn.emit(frame)
        if self._number < len(self._tfs):
            self._ask()
        else:
            self._finish()

    def _finish(self) -> None:
        self._timer.stop()
        movie, self._tfs = self._movie, []
        if movie is not None:
            self._writing.finish()
        # Whoever hears it finds the movie being written.
        self.frameDrawn.emit(None)
        if movie is None:
            self.ended.emit("")
