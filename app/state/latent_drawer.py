"""Drawing of the map's pictures: by which engine, from what, and in how many pixels.

Automatically it is the ray caster, or the model where the ray caster has proved too slow. A
picture is that of the decoded TF, so that it is what a click on it gives, or, by a model that draws
codes, of the code itself, as in the paper (section 5.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.channels import Channels, EngineName
from app.engines.client import EngineClient
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest, Request
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentState
from app.state.pace import Pace
from app.state.viewer_state import ViewerState
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF

SLOW_SECONDS = 0.12
"""Expected time of a picture at which the model takes over, if there is one."""

CELL_SIZE = 128
LIVE_SIZES = (128, 96, 64, 48, 32)
LEAST_TIMED_SIZE = 96

Take = Callable[[EngineName, Result], None]


class LatentDrawer(QObject):
    """Asks the engine that is chosen for pictures of TFs.

    Parameters
    ----------
    exact : EngineClient
        Client of a ray caster.
    learned : EngineClient
        Client of the generator.

    Attributes
    ----------
    clients : dict
        Both clients by name.
    learned_size : int or None
        Image size of a generator that fits the volume.
    draws_codes : bool
        Whether that generator draws the codes of its own codec.
    """

    problem = Signal(str)

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        session: LatentSession,
        exact: EngineClient,
        learned: EngineClient,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.clients: dict[EngineName, EngineClient] = {"exact": exact, "learned": learned}
        self.learned_size: int | None = None
        self.draws_codes = False
        self._state, self._latent, self._session = state, latent, session
        self._pace = Pace()
        self._patience = 1.0
        self._warm: set[EngineName] = set()

    @property
    def source(self) -> EngineName:
        """The engine that draws."""
        choice = self._latent.choices.engine
        if self.learned_size is None or choice == "exact":
            return "exact"
        if choice == "learned" or self.has_own_codes:
            return "learned"
        expected = self._pace.expected("exact", CELL_SIZE)
        return "learned" if expected is not None and expected > SLOW_SECONDS else "exact"

    @property
    def from_codes(self) -> bool:
        """Whether pictures are drawn from codes, not from the TFs that these are decoded to."""
        return self.has_own_codes and self.source == "learned"

    @property
    def has_own_codes(self) -> bool:
        """Whether the map's codes are those of a model that draws them."""
        return self.draws_codes and self._session.has_models_codec

    def set_learned(self, size: int | None) -> None:
        """Set the image size of a generator that fits the volume; None without one."""
        self.learned_size = size

    def set_codes(self, drawn: bool) -> None:
        """Say whether that generator draws the codes of its own codec."""
        self.draws_codes = drawn

    def allow(self, patience: float) -> None:
        """Have live pictures take so many times the usual time, from the next on."""
        self._patience = patience

    def forget_times(self) -> None:
        """Forget how long pictures took: they are of another volume or light."""
        self._pace = Pace()
        self._warm.clear()

    def size_of(self, source: EngineName, size: int) -> int:
        """Size of an engine's pictures where one would do: a generator has its own."""
        return (self.learned_size or size) if source == "learned" else size

    def quality(self, largest: int, seconds: float, live: bool) -> Quality:
        """Return the quality of a picture that may take some seconds while something moves."""
        if not live:
            return Quality(largest)
        expected, seconds = self._pace.expected(self.source, 1) or 0.0, seconds * self._patience
        sizes = (size for size in LIVE_SIZES if expected * size**2 <= seconds)
        return Quality(min(largest, next(sizes, LIVE_SIZES[-1])), live=True)

    def opened(self, name: str, take: Take) -> Channels[EngineName]:
        """Open channels to both engines, whose answers are taken, and their problems told."""
        return Channels(self.clients, name, partial(self._take, take), self)

    def ask(
        self,
        channels: Channels[EngineName],
        inputs: list[SceneInputs],
        quality: Quality,
        codes: NDArray[np.float32],
    ) -> int:
        """Ask for pictures of some TFs with their codes (n, d), and return the request's number."""
        source = self.source
        quality = replace(quality, size=self.size_of(source, quality.size))
        drawn = tuple(map(tuple, codes.tolist())) if self.from_codes else ()
        request = BatchRequest(inputs[0], quality, tuple(inputs[1:]), drawn)
        return channels[source].ask(request).sequence

    def with_tf(self, tf: OpacityTF) -> SceneInputs:
        """Present inputs under another opacity TF."""
        return replace(self._state.inputs, opacity_tf=tf)

    def _take(self, take: Take, source: EngineName, result: Result) -> None:
        if result.value is not None and not is_traced(result.request):
            seconds = result.seconds / len(result.value)
            self._note_pace(source, result.request.quality.size, seconds)
        take(source, result)
        if result.value is None:
            self.problem.emit(result.error or "The engine returned no pictures.")

    def _note_pace(self, source: EngineName, size: int, seconds: float) -> None:
        """Note the time of a picture, unless it says little about larger ones."""
        # The first one compiles; of small ones most of the time has nothing to do with pixels.
        if source in self._warm and size >= LEAST_TIMED_SIZE:
            self._pace.note(source, size, seconds)
        self._warm.add(source)


def is_traced(request: Request) -> bool:
    """Whether pictures are path-traced that others have stood in for."""
    return isinstance(request, BatchRequest) and request.traced


def look_of(inputs: SceneInputs) -> SceneInputs:
    """Inputs that pictures of the map depend on besides their own opacity TF."""
    return replace(inputs, opacity_tf=replace(inputs.opacity_tf, modes=(), points=()))
