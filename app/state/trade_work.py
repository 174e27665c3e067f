"""Measures what images while something moves cost in the present scene, and how wrong they are."""

from __future__ import annotations

import math
from dataclasses import replace

from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.channels import Channels
from app.engines.client import EngineClient
from app.engines.messages import Result
from app.engines.requests import ImageRequest, Request
from app.engines.states import EngineState
from app.state.dispatcher import Dispatcher
from app.state.exactness import Exactness
from app.state.image_errors import distance
from app.state.pace import SCALES
from app.state.trade_keeper import AtRest, Traded, TradeKeeper
from app.state.viewer_state import ViewerState
from model.scene.inputs import SceneInputs
from model.scene.scene import RendererName

REPEATED_BELOW = 0.15
"""Seconds of an image below which it is drawn a second time; the faster time counts."""

REST_MS, SOON_MS = 3000, 50
"""Time without requests after which it is measured: for later, and for somebody who looks."""

BEST_GAIN, LEAST_GAIN = 0.5, 0.95
"""Limits of what an error is multiplied by for twice the samples."""

ENOUGH = 8
"""Scenes of a volume from which nothing is measured for later: they predict the others."""

CHANNEL = "measured"
"""Name of the channels on which it asks."""


class TradeWork(QObject):
    """Has the present scene drawn as while something moves, at each number of pixels.

    Only while nothing moves and nothing else is asked for, and the image at rest is there, against
    which the others are measured. A change ends it; what was measured predicts the volume's other
    scenes.

    Parameters
    ----------
    state : ViewerState
    reference, stand_in : EngineClient
        One of them draws while something moves.
    dispatcher : Dispatcher
        Knows which, and at which quality.
    keeper : TradeKeeper
        Keeps what was measured.

    Attributes
    ----------
    found : tuple of Traded
        The fewest pixels first.
    """

    changed = Signal()

    def __init__(
        self,
        state: ViewerState,
        reference: EngineClient,
        stand_in: EngineClient,
        dispatcher: Dispatcher,
        keeper: TradeKeeper,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.found: tuple[Traded, ...] = ()
        self._state, self._reference = state, reference
        self._dispatcher, self._keeper = dispatcher, keeper
        self._is_watched = self._is_paused = False
        self._truth: Result | None = None
        self._of_rest: tuple[Result, AtRest] | None = None
        self._refined: list[tuple[int, float, float]] = []
        self._first: Result | None = None
        clients = {client: client for client in (reference, stand_in)}
        self._channels = Channels(clients, CHANNEL, self._measure, self)
        self._rest = QTimer(self, singleShot=True)
        self._rest.timeout.connect(self._go_on)
        state.inputsChanged.connect(self._forget)
        reference.stateChanged.connect(self._follow)
        reference.images.answered.connect(self._take)
        for client in clients:
            client.requested.connect(self._give_way)

    @property
    def is_measuring(self) -> bool:
        """Whether more is about to be found."""
        return self._channels.is_pending

    @property
    def is_complete(self) -> bool:
        """Whether all is found."""
        return len(self.found) == len(SCALES)

    @property
    def _next_scale(self) -> float:
        return sorted(SCALES)[len(self.found)]

    def watch(self, is_watched: bool) -> None:
        """Say whether somebody looks, who has it measured at once."""
        self._is_watched = is_watched
        if is_watched:
            self._go_on()
        else:
            self._call_off()

    def pause(self, is_paused: bool) -> None:
        """Measure nothing for later, as the processors are needed for something that lasts."""
        self._is_paused = is_paused

    def stop(self) -> None:
        """Measure no more."""
        self._rest.stop()
        self._is_watched, self._is_paused = False, True

    def at(self, step: Exactness) -> Traded | None:
        """Return the image that a step leads to: the finest that it has time for, or the fastest.

        None as long as not all is measured.
        """
        return _within(self.found, step) if self.is_complete else None

    def expected(self, step: Exactness) -> Traded | None:
        """Predict the image that a step leads to by those of other scenes; None without any."""
        known = self.predicted
        return _within(known, step) if known else None

    @property
    def predicted(self) -> tuple[Traded, ...]:
        """All that other scenes of the volume predict, the fewest pixels first; may be empty."""
        side = self._dispatcher.plan.raster.side
        return self._keeper.expected(self._renderer, side, self._rest_of(self._state.inputs))

    def at_rest(self, step: Exactness) -> tuple[float, float] | None:
        """Return error and seconds of path-traced light at rest; None where they are not known.

        As far as the image is drawn, they are its own. From there on each doubling of its samples
        is expected to take twice as long as the one before, and to bring as much.
        """
        seconds, known = 0.0, [each for each in self._refined if math.isfinite(each[1])]
        for samples, error, seconds in known:
            if error <= step.error or samples >= step.samples:
                return error, seconds
        if len(known) < 2:
            return None
        (_, error_before, seconds_before), (samples, error, seconds) = known[-2:]
        gain = min(max(error / error_before, BEST_GAIN), LEAST_GAIN)
        doubling = seconds - seconds_before
        while error > step.error and samples < step.samples:
            samples, error, doubling = 2 * samples, gain * error, 2 * doubling
            seconds += doubling
        return error, seconds

    @property
    def scenes(self) -> int:
        """Number of the volume's scenes that were measured on this machine."""
        return self._keeper.scenes(self._renderer, self._dispatcher.plan.raster.side)

    @property
    def _renderer(self) -> RendererName:
        """Name of the renderer that draws while something moves."""
        client, _quality = self._dispatcher.live_at(1.0)
        is_vtk = client is self._reference and not client.by_raycast
        return "vtk" if is_vtk and self._dispatcher.plan.most_samples == 1 else "raycast"

    def _rest_of(self, inputs: SceneInputs) -> AtRest | None:
        """Return time and error of the image at rest; None if it is not there."""
        truth = self._truth
        if truth is None or truth.value is None or truth.request.inputs != inputs:
            return None
        if self._of_rest is None or self._of_rest[0] is not truth:
            # Late: it is needed at rest only, and brings the renderers.
            from model.rendering.resizing import quartered

            error = distance(quartered(truth.value), truth.value)
            self._of_rest = truth, AtRest(_seconds_a_sample(truth), error)
        return self._of_rest[1]

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.SETTLED:
            self._wait()
        elif state is EngineState.LOADING:
            self._truth = None
            self._forget()

    def _wait(self) -> None:
        """Go on once nothing else has been asked for during some time."""
        if self._is_watched or not self._is_paused:
            self._rest.start(SOON_MS if self._is_watched else REST_MS)

    def _give_way(self, request: Request) -> None:
        """Let another request of the same engines come first."""
        if request.channel != CHANNEL:
            self._call_off()
            self._wait()

    def _forget(self) -> None:
        self._call_off()
        if self.found:
            self.found = ()
            self.changed.emit()

    def _call_off(self) -> None:
        if self.is_measuring:
            self._channels.cancel()
            self.changed.emit()

    def _go_on(self) -> None:
        """Ask for the next image, if it is wanted and can be measured."""
        is_wanted = self._is_watched or not (self._is_paused or self.scenes >= ENOUGH)
        truth, is_due = self._truth, is_wanted and not self.is_complete
        if not is_due or self.is_measuring or truth is None or self._state.live:
            return
        is_at_rest = self._reference.state is EngineState.SETTLED
        if is_at_rest and truth.request.inputs == self._state.inputs:
            self._first = None
            self._ask()

    def _ask(self) -> None:
        client, quality = self._dispatcher.live_at(self._next_scale)
        # It is not live: it is given up for what is asked for meanwhile.
        quality = replace(quality, live=False)
        self._channels[client].ask(ImageRequest(self._state.inputs, quality, is_measured=True))
        self.changed.emit()

    def _take(self, result: Result) -> None:
        if not result.request.quality.live:
            self._note_refined(result)
            self._truth = result
            self.changed.emit()
        self._wait()

    def _note_refined(self, result: Result) -> None:
        """Note samples, error and seconds of an image at rest that becomes better."""
        quality, before = result.request.quality, self._truth
        goes_on = before is not None and (
            (before.request.inputs, before.request.quality.pixels)
            == (result.request.inputs, quality.pixels)
        )
        if not goes_on or quality.samples == 1:
            self._refined.clear()
        if result.image_error is not None:
            seconds = self._refined[-1][2] if self._refined else 0.0
            found = quality.samples, result.image_error, seconds + result.seconds
            self._refined.append(found)

    def _measure(self, _client: EngineClient, result: Result) -> None:
        if result.value is None or self._truth is None or self._truth.value is None:
            self.changed.emit()
            return
        first, self._first = self._first, None
        if first is None and result.seconds < REPEATED_BELOW:
            self._first = result
            self._ask()
            return
        seconds = result.seconds if first is None else min(result.seconds, first.seconds)
        found = Traded(self._next_scale, seconds, distance(result.value, self._truth.value))
        self.found = (*self.found, found)
        rest = self._rest_of(result.request.inputs)
        if self.is_complete and rest is not None:
            self._keeper.note(self._renderer, self._dispatcher.plan.raster.side, rest, self.found)
        self._go_on()
        self.changed.emit()


def _seconds_a_sample(image: Result) -> float:
    """Seconds of one sample of each pixel: half of all were drawn since the image before."""
    samples = image.request.quality.samples
    return image.seconds / max(samples - samples // 2, 1)


def _within(images: tuple[Traded, ...], step: Exactness) -> Traded:
    """Return the finest of some images that a step has time for, or the fastest."""
    fast = [each for each in images if each.seconds <= step.live_seconds]
    return max(fast, key=lambda each: each.scale) if fast else images[0]
