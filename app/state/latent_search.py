"""A goal search that runs beside the window: each step is one batch of pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.channels import Channels
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest
from app.state.engine_chooser import EngineName
from app.state.latent_drawer import LatentDrawer
from app.state.latent_session import LatentSession
from app.state.latest_call import LatestCall
from app.state.viewer_state import ViewerState
from model.errors import TfscopeError
from model.latent.goal_search import SEARCH_SIZE, Goal, GoalSearch, Wish, candidates_for
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.transfer_function import OpacityTF

Images = NDArray[np.float32]


@dataclass(frozen=True)
class SearchStep:
    """State of a search after a batch of pictures.

    Attributes
    ----------
    tf : OpacityTF
        The best so far.
    error : float
        Weighted RMSE from the goal.
    batches : int
        Batches of pictures so far.
    is_done : bool
    """

    tf: OpacityTF
    error: float
    batches: int
    is_done: bool


class LatentSearch(QObject):
    """Runs one search at a time, on whichever engine draws the map's pictures.

    Parameters
    ----------
    state : ViewerState
    session : LatentSession
    drawer : LatentDrawer
        Knows the engines, and which of them draws.
    """

    stepped = Signal(object)
    """Emitted with a :class:`SearchStep`."""
    ended = Signal(str)
    """Emitted with a problem, or nothing, when a search has ended or was cancelled."""

    def __init__(
        self,
        state: ViewerState,
        session: LatentSession,
        drawer: LatentDrawer,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._session = session
        self._drawer = drawer
        self._search: GoalSearch | None = None
        self._inputs: SceneInputs | None = None
        self._wish: tuple[Wish, Outline] | None = None
        self._engine: EngineName = "exact"
        self._batches = 0
        self._preparing = LatestCall("latent-search", self)
        self._preparing.done.connect(self._begin)
        self._preparing.failed.connect(self._end)
        self._channels = Channels(drawer.clients, "search", self._take, self)
        for changed in (state.viewChanged, state.light_input.changed, state.crop_input.changed):
            changed.connect(lambda _value: self.cancel())
        session.mapClosed.connect(self.cancel)

    @property
    def is_running(self) -> bool:
        """True from the start of a search to its end."""
        return self._inputs is not None

    def seek(self, wish: Wish, outline: Outline) -> None:
        """Search for more or less in a region of the present picture."""
        self.cancel()
        if self._session.map is None:
            return
        self._start((wish, outline))
        assert self._inputs is not None
        self._draw((self._inputs,))

    def seek_picture(self, picture: Images, outline: Outline | None = None) -> None:
        """Search for a picture (S, S, 4), or for a region as it is in that picture."""
        self.cancel()
        if self._session.map is None:
            return
        self._start(None)
        size = self._size()
        try:
            mask = None if outline is None else outline.mask(size)
            self._prepare(Goal.like(resized(picture, size), mask))
        except TfscopeError as error:
            self._end(str(error))

    def cancel(self) -> None:
        """End the search; what it has found so far stays."""
        if self._inputs is not None:
            self._preparing.forget()
            self._channels[self._engine].cancel()
            self._end("")

    def stop(self) -> None:
        """Ask nothing any more; returns at once."""
        self.cancel()
        self._preparing.stop()

    def join(self) -> None:
        """Wait until the thread has ended."""
        self._preparing.join()

    def _start(self, wish: tuple[Wish, Outline] | None) -> None:
        self._inputs, self._wish, self._batches = self._state.inputs, wish, 0
        # The same engine to the end: pictures of another would have another size.
        self._engine = self._drawer.source

    def _prepare(self, goal: Goal) -> None:
        """Choose the codes to start from in the background: thousands are compared."""
        session, inputs = self._session, self._inputs
        assert inputs is not None and session.space is not None and session.map is not None
        present = session.space.code_of(inputs.opacity_tf)
        self._preparing.ask(
            partial(_prepared, goal, present, session.volume, inputs, session.space, session.map)
        )

    def _begin(self, search: Any) -> None:
        if self._inputs is not None:
            self._search = search
            self._ask()

    def _ask(self) -> None:
        space = self._session.space
        assert self._search is not None and self._inputs is not None and space is not None
        tfs = space.tfs_of(self._search.question)
        self._draw(tuple(replace(self._inputs, opacity_tf=tf) for tf in tfs))

    def _draw(self, inputs: tuple[SceneInputs, ...]) -> None:
        request = BatchRequest(inputs[0], Quality(self._size()), inputs[1:])
        self._channels[self._engine].ask(request)

    def _size(self) -> int:
        return self._drawer.size_of(self._engine, SEARCH_SIZE)

    def _take(self, name: EngineName, result: Result) -> None:
        if self._channels[name].is_pending or self._inputs is None:
            return
        try:
            if result.value is None:
                self._end(result.error or "The engine returned no pictures.")
            elif self._search is None:
                self._begin_wish(result.value[0])
            else:
                self._step(result.value)
        except TfscopeError as error:
            self._end(str(error))

    def _begin_wish(self, picture: Images) -> None:
        assert self._wish is not None
        wish, outline = self._wish
        self._prepare(Goal.of_wish(wish, picture, outline.mask(len(picture))))

    def _step(self, images: Images) -> None:
        search, space = self._search, self._session.space
        if search is None or space is None:
            return
        search.answer(images)
        self._batches += 1
        found = search.found
        assert found is not None
        self.stepped.emit(
            SearchStep(space.tf_of(found.code), found.error, self._batches, search.is_done)
        )
        if search.is_done:
            self._end("")
        elif self._search is search:
            self._ask()

    def _end(self, problem: str) -> None:
        self._search = self._inputs = None
        self.ended.emit(problem)


def resized(picture: Images, size: int) -> Images:
    """Means of a picture's parts, or its pixels repeated, at another size."""
    from skimage.transform import resize

    found = resize(picture, (size, size, picture.shape[2]), order=1, anti_aliasing=True)
    return np.asarray(found, dtype=np.float32)


def _prepared(
    goal: Goal, present: Any, volume: Any, inputs: SceneInputs, space: Any, map_: Any
) -> GoalSearch:
    from model.latent.opacity_overview import RayLengths

    lengths = RayLengths.of(volume, inputs.view)
    opacities = space.frame.stretched(map_.samples.tfs)
    images = lengths.opacity_images(opacities)
    return GoalSearch(goal, candidates_for(goal, present, map_.codes, images), map_.codes)
