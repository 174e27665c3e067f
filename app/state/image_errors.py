"""Errors of the reference's images: estimated, measured at rest, or predicted by others."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.engines.messages import Result
from app.engines.quality import GOOD_ENOUGH
from app.engines.requests import ImageRequest
from app.state.fidelity import (
    AS_CHOSEN,
    AT_BEST,
    ENDS,
    ESTIMATED,
    LET_GO,
    MEASURED,
    MORE,
    MOVING,
    REFINING,
    TOO_LONG,
    WAIT,
    Fidelity,
)
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

COMPARED = 128
"""Pixels along each side, at most, by which two images are compared."""

MOST_OWN_ERROR = 0.5
"""Error of an image at rest, relative to what is measured against it, from which that is void."""

MOST_SECONDS = 1.0
"""Time of the first image from which it says nothing of those that follow while something moves."""

Image = NDArray[np.float32]


class ImageErrors:
    """Judges each image of the reference, and learns from it how wrong others are.

    Coarse images are kept until the one at rest of the same inputs is there, and compared with
    that. The error that is found predicts that of the next images of their kind: as many pixels,
    samples as far apart, and as many of them.
    """

    def __init__(self) -> None:
        self._known: dict[object, float] = {}
        self._waiting: dict[object, Image] = {}
        self._inputs: SceneInputs | None = None
        self._last: Result | None = None
        self._moved: Result | None = None
        self._moved_in_full = False

    @property
    def moving(self) -> tuple[float, float | None] | None:
        """Seconds and error of the last image while something moved; None if there is none."""
        if self._moved is None:
            return None
        error = 0.0 if self._moved_in_full else self._known.get(_kind(self._moved))
        return self._moved.seconds, error

    def forget(self) -> None:
        """Begin anew: another volume, light or renderer is drawn."""
        self._known.clear()
        self._waiting.clear()
        self._inputs = self._last = self._moved = None

    def note(self, result: Result, whole: Raster, moves: bool = False) -> None:
        """Note that an image is shown, and measure those before it if it knows its own error.

        Parameters
        ----------
        moves : bool
            Whether something moves.
        whole : Raster
            Pixels that an image has where nothing stands against it.
        """
        assert result.value is not None
        if result.request.inputs != self._inputs:
            self._waiting.clear()
            self._inputs = result.request.inputs
        # Kernels may have been compiled meanwhile.
        is_first = self._last is None and result.seconds > MOST_SECONDS
        self._last = result
        if result.request.quality.live and (moves or not (is_first or self._follows(result))):
            self._moved, self._moved_in_full = result, _is_full(result, whole)
        self._waiting[_kind(result)] = result.value
        if result.image_error is not None:
            self._measure(whole)

    def _follows(self, result: Result) -> bool:
        """Whether it is the reference's first one at rest, after the ray caster's in motion."""
        return self._moved is not None and not _is_own(self._moved) and _is_own(result)

    def settle(self, whole: Raster) -> None:
        """Take the last image as the one at rest, and measure those before it."""
        if self._last is not None and _is_own(self._last):
            self._measure(whole)
            self._waiting.clear()

    def _measure(self, whole: Raster) -> None:
        last = self._last
        if last is None or last.value is None or not _is_whole(last, whole):
            return
        own = last.image_error or 0.0
        for kind, image in self._waiting.items():
            if kind != _kind(last):
                found = distance(image, last.value)
                if own <= MOST_OWN_ERROR * found:
                    self._known[kind] = found

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
        own = last.image_error if last.request.quality.pixels.width >= whole.width else None
        own = None if own == math.inf else own
        error = self._known.get(_kind(last)) if own is None else own
        how = () if error is None else (MEASURED if own is None else ESTIMATED,)
        if not moves:
            return Fidelity(error, own is None, REFINING, (WAIT, *how))
        if error is None:
            return Fidelity() if _is_full(last, whole) else Fidelity(None, False, MOVING, (LET_GO,))
        return (
            Fidelity() if error <= GOOD_ENOUGH else Fidelity(error, own is None, "", (LET_GO, *how))
        )


def distance(coarse: Image, fine: Image) -> float:
    """Root mean squared difference of two images' colours, as a screen shows them.

    Parameters
    ----------
    coarse : ndarray of float32, shape (h, w, 4)
        Interpolated linearly where the other has its pixels.
    fine : ndarray of float32, shape (H, W, 4)
        A grid of its pixels is compared.
    """
    places = [_grid(count) for count in fine.shape[:2]]
    truth = fine[np.ix_(*places)][..., :3]
    found = coarse[..., :3]
    for axis in (0, 1):
        have = coarse.shape[axis]
        at = np.clip((places[axis] + 0.5) * have / fine.shape[axis] - 0.5, 0, have - 1)
        before = np.floor(at).astype(np.intp)
        part = (at - before).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        after = np.minimum(before + 1, have - 1)
        found = np.take(found, before, axis) * (1 - part) + np.take(found, after, axis) * part
    one, other = (np.clip(np.nan_to_num(image), 0, 1) for image in (found, truth))
    return float(np.sqrt(np.mean((one - other).astype(np.float64) ** 2)))


def _grid(count: int) -> NDArray[np.intp]:
    """Places of at most :data:`COMPARED` pixels, evenly over all of them."""
    chosen = min(count, COMPARED)
    return ((np.arange(chosen) + 0.5) * count / chosen).astype(np.intp)


def _kind(result: Result) -> object:
    return _is_own(result), replace(result.request.quality, live=False, error=0.0)


def _is_own(result: Result) -> bool:
    """Whether the reference itself has drawn an image, not who stands in for it."""
    return not (isinstance(result.request, ImageRequest) and result.request.stands_in)


def _is_whole(result: Result, whole: Raster) -> bool:
    """Whether an image is one at rest, with all pixels."""
    quality = result.request.quality
    return _is_own(result) and not quality.live and quality.pixels.width >= whole.width


def _is_full(result: Result, whole: Raster) -> bool:
    """Whether a moving image is as fine as one at rest."""
    quality = result.request.quality
    has_all = quality.pixels.width >= whole.width and quality.coarseness == 1.0
    # What has an error of its own becomes better at rest.
    return has_all and _is_own(result) and result.image_error is None


def _at_rest(last: Result, whole: Raster) -> Fidelity:
    quality, own = last.request.quality, last.image_error
    if quality.pixels.width < whole.width:
        return _best(None, TOO_LONG.format(quality.pixels.width, whole.width))
    if own is None or own <= GOOD_ENOUGH:
        return Fidelity()
    if own <= quality.error:
        return Fidelity(own, False, AS_CHOSEN, (MORE, ESTIMATED))
    return _best(own, ENDS.format(quality.samples), ESTIMATED)


def _best(error: float | None, *reasons: str) -> Fidelity:
    return Fidelity(error, False, AT_BEST, reasons)
