"""Errors of the reference's images: estimated, or measured at rest."""

from __future__ import annotations

import math

from app.engines.messages import Result
from app.engines.quality import GOOD_ENOUGH
from app.engines.requests import ImageRequest, Request
from app.engines.trade import distance
from app.state.fidelity import (
    COARSE,
    ENDS,
    ESTIMATED,
    LET_GO,
    MORE,
    MOVING,
    REFINING,
    TOO_LONG,
    WAIT,
    Fidelity,
)
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

MOST_OWN_ERROR = 0.5
"""Error of an image at rest, relative to what is measured against it, from which that is void."""

MOST_SECONDS = 1.0
"""Time of the first image from which it says nothing of those that follow while something moves."""


class ImageErrors:
    """Judges the reference's last image, and measures the last one while something moved.

    That is kept until the image at rest of the same inputs is there, and compared with it.
    """

    def __init__(self) -> None:
        self._last: Result | None = None
        self._moved: Result | None = None
        self._error: float | None = None

    @property
    def moving(self) -> tuple[float, float | None] | None:
        """Seconds and error of the last image while something moved; None if there is none."""
        return None if self._moved is None else (self._moved.seconds, self._error)

    def forget(self) -> None:
        """Begin anew: another volume, light or renderer is drawn."""
        self._last = self._moved = None

    def note(self, result: Result, whole: Raster, moves: bool = False) -> None:
        """Note that an image is shown, and measure the moving one before it if it is at rest.

        Parameters
        ----------
        moves : bool
            Whether something moves.
        whole : Raster
            Pixels that an image has where nothing stands against it.
        """
        # Kernels may have been compiled meanwhile.
        is_first = self._last is None and result.seconds > MOST_SECONDS
        self._last, moved = result, self._moved
        if result.request.quality.live:
            if moves or not is_first:
                self._moved = result
                self._error = 0.0 if _is_full(result, whole) else None
        elif moved is None or self._error == 0 or not _are_alike(moved.request, result.request):
            return
        elif not result.stands_in and _has_all_pixels(result, whole):
            assert moved.value is not None and result.value is not None
            found = distance(moved.value, result.value)
            if (result.image_error or 0.0) <= MOST_OWN_ERROR * found:
                self._error = found

    def fidelity(self, inputs: SceneInputs, moves: bool, settled: bool, whole: Raster) -> Fidelity:
        """Judge the last image.

        Parameters
        ----------
        inputs : SceneInputs
            Of the image that is wanted. Where at rest another one is still there, nothing is
            said of it.
        moves : bool
            Whether something moves.
        settled : bool
            Whether no better image follows.
        whole : Raster
            See :meth:`note`.
        """
        last = self._last
        if last is None or (not moves and last.request.inputs != inputs):
            return Fidelity()
        if settled and not last.request.quality.live and not moves:
            return _at_rest(last, whole)
        # The estimate knows nothing of pixels that are not there.
        own = last.image_error if _has_all_pixels(last, whole) else None
        own = None if own == math.inf else own
        how = () if own is None else (ESTIMATED,)
        if not moves:
            return Fidelity(own, REFINING, (WAIT, *how))
        if _is_full(last, whole) or (own is not None and own <= GOOD_ENOUGH):
            return Fidelity()
        return Fidelity(own, MOVING if own is None else "", (LET_GO, *how))


def _are_alike(moved: Request, rests: Request) -> bool:
    """Whether two images show the same, in panes of the same size."""
    return (moved.inputs, moved.quality.pixels) == (rests.inputs, rests.quality.pixels)


def _width(result: Result) -> int:
    assert result.value is not None
    return int(result.value.shape[1])


def _has_all_pixels(result: Result, whole: Raster) -> bool:
    return _width(result) >= whole.width


def _is_full(result: Result, whole: Raster) -> bool:
    """Whether a moving image is as fine as one at rest."""
    # What has an error of its own becomes better at rest.
    is_own = not result.stands_in and result.image_error is None
    return _has_all_pixels(result, whole) and is_own


def _at_rest(last: Result, whole: Raster) -> Fidelity:
    request, own = last.request, last.image_error
    if not _has_all_pixels(last, whole):
        return Fidelity(None, COARSE.format(_width(last), whole.width), (TOO_LONG,))
    if own is None or own <= GOOD_ENOUGH:
        return Fidelity()
    if isinstance(request, ImageRequest) and own <= request.stop.error:
        return Fidelity(own, "", (MORE, ESTIMATED))
    return Fidelity(own, "", (ENDS.format(last.samples), ESTIMATED))
