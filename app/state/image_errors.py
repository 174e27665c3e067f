"""Errors of the reference's images, at rest and while something moves, and their descriptions."""

import math
from dataclasses import dataclass

from PySide6.QtCore import QObject, Signal

from app.engines.client import Channel, EngineClient, EngineState
from app.engines.exactness import GOOD_ENOUGH, STOPS, Exactness, Stop, distance
from app.engines.messages import Result
from app.engines.pace import SCALES
from app.engines.requests import Image, ImageRequest, Request, TradeOffRequest
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

MOST_OWN_ERROR = 0.5  # of an image at rest, by the error that is measured against it
LEAST_SHOWN = 1e-4  # error below which the estimate is noise

LET_GO = "The image is coarser while something moves."
WAIT = "The image becomes finer from here on."
ESTIMATED = "The error is estimated from the differences between samples."
ENDS = (
    "Refining ends at {} per pixel. Choose Exact in the bar above for more, or use the "
    "command render with --samples or --error."
)
MORE = "Choose Exact in the bar above for a smaller error."
TOO_LONG = "All pixels take too long here. Make the window smaller, or choose a faster light."


def error_text(error: float) -> str:
    """Write an error in two digits, such as ".0042"."""
    return f"{max(error, LEAST_SHOWN):.2g}".replace("0.", ".", 1)


def rate_text(seconds: float) -> str:
    """Write the rate of images that take some seconds, such as "12 / s"."""
    rate = min(1 / max(seconds, 1e-9), 999.0)
    return f"{rate:.0f} / s" if rate >= 9.5 else f"{rate:.1f} / s".replace("0.", ".", 1)


def pace_text(stop: Exactness) -> str:
    """Write the rate of a stop while something moves, such as "12 / s"."""
    return "all pixels" if math.isinf(stop.live_seconds) else rate_text(stop.live_seconds)


def figures_text(seconds: float, error: float | None) -> str:
    """Write rate and error of images, such as "12 / s, error .004"."""
    rate = rate_text(seconds)
    if error is None:
        return rate
    return f"{rate}, error {error_text(error)}" if error else f"{rate}, exact"


@dataclass(frozen=True)
class Fidelity:
    """Description of an inexact image; empty for an exact one."""

    error: float | None = None  # root mean square of the colours' errors; None if unknown
    state: str = ""  # what happens next, in words
    reasons: tuple[str, ...] = ()  # sentences on where the error comes from, and how to get better

    @property
    def text(self) -> str:
        """One short line, such as "estimated error .004, refining"; empty for an exact image."""
        if self.error is None:
            return self.state
        error = f"estimated error {error_text(self.error)}"
        return f"{error}, {self.state}" if self.state else error


class ImageErrors:
    """Describes the reference's last image, and measures the last moving one."""

    def __init__(self) -> None:
        self._last: tuple[Request, Image] | None = None
        self._moved: tuple[Request, Image] | None = None
        self._error: float | None = None

    def moving(self, stop: Exactness) -> tuple[float, float | None] | None:
        """Seconds and error of the last moving image; None if none was drawn at this stop."""
        request, image = self._moved or (None, None)
        if image is None or not isinstance(request, ImageRequest) or request.stop != stop:
            return None
        return image.seconds, self._error

    def forget(self) -> None:
        """Forget all: another volume, light or renderer is drawn."""
        self._last = self._moved = None

    def note(self, result: Result, whole: Raster, moves: bool = False) -> None:
        """Note a shown image; if it is at rest, measure the moving one before it."""
        request, image = result.request, result.image
        assert image is not None
        self._last, moved = (request, image), self._moved
        if request.quality.live:
            # The first image of one at rest is coarser, or waits for kernels.
            if moves:
                self._moved = request, image
                self._error = 0.0 if _is_full(image, whole) else None
        elif moved is None or self._error == 0 or not _are_alike(moved[0], request):
            return
        elif not image.is_preview and image.width >= whole.width:
            found = distance(moved[1].rgba, image.rgba)
            if (image.error or 0.0) <= MOST_OWN_ERROR * found:
                self._error = found

    def fidelity(self, inputs: SceneInputs, moves: bool, settled: bool, whole: Raster) -> Fidelity:
        """Describe the last image; no better one follows if it has settled."""
        if self._last is None or (not moves and self._last[0].inputs != inputs):
            return Fidelity()
        request, image = self._last
        if settled and not request.quality.live and not moves:
            return _at_rest(request, image, whole)
        # The estimate does not include missing pixels.
        own = image.error if image.width >= whole.width else None
        own = None if own == math.inf else own
        how = () if own is None else (ESTIMATED,)
        if not moves:
            return Fidelity(own, "refining", (WAIT, *how))
        if _is_full(image, whole) or (own is not None and own <= GOOD_ENOUGH):
            return Fidelity()
        return Fidelity(own, "coarser while moving" if own is None else "", (LET_GO, *how))


def _are_alike(moved: Request, rests: Request) -> bool:
    """Whether two images show the same, in panes of the same size."""
    return (moved.inputs, moved.quality.pixels) == (rests.inputs, rests.quality.pixels)


def _is_full(image: Image, whole: Raster) -> bool:
    """Whether a moving image is as fine as one at rest."""
    # An image with an estimated error gets better at rest.
    return image.width >= whole.width and not image.is_preview and image.error is None


def _at_rest(request: Request, image: Image, whole: Raster) -> Fidelity:
    if image.width < whole.width:
        return Fidelity(None, f"{image.width} of {whole.width} pixels across", (TOO_LONG,))
    if image.error is None or image.error <= GOOD_ENOUGH:
        return Fidelity()
    if isinstance(request, ImageRequest) and image.error <= request.stop.error:
        return Fidelity(image.error, "", (MORE, ESTIMATED))
    ends = ENDS.format("1 sample" if image.samples == 1 else f"{image.samples} samples")
    if image.error == math.inf:
        # One or two samples give no estimate.
        return Fidelity(None, "few samples", (ends,))
    return Fidelity(image.error, "", (ends, ESTIMATED))


@dataclass(frozen=True)
class TradeOffPoint:
    """A moving image: its width as a share of that at rest, its time and its RMSE."""

    scale: float
    seconds: float
    error: float


class TradeOff(QObject):
    """Measures time and error of moving images of the present scene, for each width."""

    changed = Signal()

    def __init__(self, state: ViewerState, reference: EngineClient, parent: QObject) -> None:
        super().__init__(parent)
        # The fewest pixels first; empty until all are measured.
        self.found: tuple[TradeOffPoint, ...] = ()
        # Number of the image that is being measured; 0 while none is.
        self.begun = 0
        self._state, self._reference = state, reference
        self._is_watched = False
        self._channel = Channel(reference, "measured", self)
        self._channel.answered.connect(self._take)
        self._channel.progressed.connect(self._note)
        state.inputsChanged.connect(self._forget)
        reference.stateChanged.connect(self._follow)

    def watch(self, is_watched: bool) -> None:
        """Set whether the measurements are visible."""
        self._is_watched = is_watched
        if is_watched:
            self._measure()
        else:
            self._end()

    @property
    def stops(self) -> dict[TradeOffPoint, list[Stop]]:
        """Stops by their image: the finest in their time, or the fastest."""
        stops: dict[TradeOffPoint, list[Stop]] = {}
        for name, stop in STOPS.items():
            fast = [each for each in self.found if each.seconds <= stop.live_seconds]
            for image in fast[-1:] or sorted(self.found, key=lambda one: one.seconds)[:1]:
                stops.setdefault(image, []).append(name)
        return stops

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.SETTLED:
            self._measure()
        elif state is EngineState.LOADING:
            self._forget()

    def _forget(self) -> None:
        self.found = ()
        self._end()

    def _end(self) -> None:
        self._channel.cancel()
        self._note(-1.0)

    def _measure(self) -> None:
        newest = self._reference.images.newest
        is_wanted = self._is_watched and not (self.found or self._channel.is_pending)
        is_at_rest = self._reference.state is EngineState.SETTLED
        if is_wanted and is_at_rest and isinstance(newest, ImageRequest):
            self._channel.ask(TradeOffRequest(newest.inputs, newest.quality))
            self._note(0.0)

    def _note(self, part: float) -> None:
        self.begun = 1 + round(part * len(SCALES)) if part >= 0 else 0
        self.changed.emit()

    def _take(self, result: Result) -> None:
        if result.value is not None:
            rows = zip(sorted(SCALES), result.value.tolist(), strict=True)
            self.found = tuple(TradeOffPoint(scale, *measured) for scale, measured in rows)
        self._note(-1.0)
