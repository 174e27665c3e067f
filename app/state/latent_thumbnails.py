"""Small pictures of samples of the map, in the present view, light and colours."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.messages import Result
from app.engines.quality import Quality
from app.state.engine_chooser import EngineName
from app.state.latent_drawer import look_of
from app.state.latent_pictures import LatentPictures
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentChoices, LatentState
from app.state.viewer_state import ViewerState
from model.scene.inputs import SceneInputs

SIZE, AT_ONCE, KEPT = 64, 8, 1000
"""Edge in pixels, pictures in one request, and those that are kept."""

Images = NDArray[np.float32]


class LatentThumbnails(QObject):
    """Has samples drawn by who draws the map's pictures, a few at a time, while nothing moves.

    Parameters
    ----------
    state : ViewerState
    latent : LatentState
    session : LatentSession
    pictures : LatentPictures

    Attributes
    ----------
    images : dict of int to ndarray
        Pictures (S, S, 4) of samples in the present view, light and colours.
    stale : dict of int to ndarray
        Those of an earlier view, light or colours.
    """

    drawn = Signal()

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        session: LatentSession,
        pictures: LatentPictures,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.images: dict[int, Images] = {}
        self.stale: dict[int, Images] = {}
        self._state, self._latent = state, latent
        self._session, self._pictures = session, pictures
        self._channels = pictures.drawer.opened("thumbnails", self._take)
        self._asked: tuple[int, ...] | None = None
        self._wanted: list[int] = []
        self._drawn_for: SceneInputs | None = None
        self._drawn_before = latent.choices.drawn
        pictures.asked.connect(self._follow)
        pictures.restarted.connect(self._call_off)
        pictures.forgotten.connect(self._forget)
        latent.choicesChanged.connect(self._choices_changed)
        state.inputsChanged.connect(self._check)

    def want(self, samples: Iterable[int]) -> None:
        """Have small pictures of these samples drawn, the first ones first."""
        self._wanted = [index for index in samples if index not in self.images]
        self._ask()

    def _follow(self) -> None:
        self._check()
        self._ask()

    def _check(self) -> None:
        """Draw them anew if view, light or colours have changed."""
        look = look_of(self._state.inputs)
        if self._drawn_for is not None and self._drawn_for != look:
            self._make_stale()
        self._drawn_for = look

    def _choices_changed(self, choices: LatentChoices) -> None:
        if choices.drawn != self._drawn_before:
            # Pictures of the same places, drawn otherwise.
            self._drawn_before = choices.drawn
            self._make_stale()
            self._asked = None
            self._ask()

    def _make_stale(self) -> None:
        if self.images:
            self.stale.update(self.images)
            self.images = {}
            self._asked = None
            self.drawn.emit()

    def _call_off(self) -> None:
        self._asked = None
        self._channels.cancel()

    def _forget(self) -> None:
        self._call_off()
        self.images, self.stale, self._wanted = {}, {}, []
        self.drawn.emit()

    def _ask(self) -> None:
        space, map_ = self._session.space, self._session.map
        if self._asked is not None or not self._wanted or map_ is None or space is None:
            return
        if not self._latent.choices.shown or self._state.live:
            return
        self._asked = tuple(self._wanted[:AT_ONCE])
        codes = map_.codes[[*self._asked]]
        inputs = [self._pictures.drawer.with_tf(tf) for tf in space.tfs_of(codes)]
        self._pictures.drawer.ask(self._channels, inputs, Quality(SIZE, live=True), codes)

    def _take(self, source: EngineName, result: Result) -> None:
        if self._channels[source].is_pending:
            return
        asked, self._asked = self._asked, None
        if result.value is None:
            self._wanted = []
        if asked is None or result.value is None:
            return
        if look_of(result.request.inputs) == look_of(self._state.inputs):
            self.images.update(zip(asked, map(thumbnail, result.value), strict=True))
            for pictures in (self.images, self.stale):
                while len(pictures) > KEPT:
                    del pictures[next(iter(pictures))]
            self._wanted = [index for index in self._wanted if index not in self.images]
            self.drawn.emit()
        self._ask()


def thumbnail(image: Images) -> Images:
    """Some of the pixels of a picture (S, S, 4), about 64 x 64 of them."""
    step = max(len(image) // SIZE, 1)
    return image[::step, ::step].copy()
