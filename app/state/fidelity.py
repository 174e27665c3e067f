"""How far the reference's image is from the exact one: estimated, measured, or predicted."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.engines.messages import GOOD_ENOUGH, ImageRequest, Result
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

COMPARED = 128
"""Pixels along each side, at most, by which two images are compared."""

MOST_OWN_ERROR = 0.5
"""Error of an image at rest, relative to what is measured against it, from which that is void."""

REFINING = "refining"
AT_BEST = "as good as it gets here"
MOVING = "coarser while moving"

LET_GO = "Coarser while something moves: let go for the finer image."
WAIT = "It is being refined: wait for it."
MEASURED = "Its error is predicted: as measured of the last image of this kind that came to rest."
ESTIMATED = "Its error is estimated from how the samples of its pixels differ."
ENDS = (
    "Refining ends at {} samples a pixel. The command render draws on, with --samples or --error."
)
TOO_LONG = (
    "It has {} of {} pixels across: all of them take too long here. Make the window smaller, or "
    "choose a faster light."
)
COPY = (
    "The volume is a compact copy. Its error, {}, is that of images of random views and TFs, as "
    "measured when it was written; the original has none."
)

LEAST_SAID = 1e-4
"""Error below which no figure is more than noise."""

Image = NDArray[np.float32]


def error_text(error: float) -> str:
    """Write an error in two digits, such as ".0042"."""
    return f"{max(error, LEAST_SAID):.2g}".replace("0.", ".", 1)


@dataclass(frozen=True)
class Fidelity:
    """What is said of an image that is not exact; nothing of one that is.

    Attributes
    ----------
    error : float or None
        Root mean square of the colours' errors; None if it is not known.
    is_predicted : bool
        Whether it was measured of other images than this one.
    state : str
        What becomes of it, in words; may be empty while something moves.
    reasons : tuple of str
        Sentences on where the error comes from, and how to get better.
    """

    error: float | None = None
    is_predicted: bool = False
    state: str = ""
    reasons: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """One short line, such as "error .004, refining"; empty of an exact image."""
        if self.error is None:
            return self.state
        error = f"error {'~' if self.is_predicted else ''}{error_text(self.error)}"
        return f"{error}, {self.state}" if self.state else error

    def of_copy(self, error: float | None) -> Fidelity:
        """Return what is said where the volume is a lossy copy, whose images have an error."""
        if error is None or (error <= GOOD_ENOUGH and self == Fidelity()):
            return self
        reasons = (*self.reasons, COPY.format(error_text(error)))
        if self.state and self.error is None:
            return replace(self, reasons=reasons)
        both = math.hypot(self.error or 0.0, error)
        return Fidelity(both, True, self.state if self.error else AT_BEST, reasons)


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

    def forget(self) -> None:
        """Begin anew: another volume, light or renderer is drawn."""
        self._known.clear()
        self._waiting.clear()
        self._inputs = self._last = None

    def note(self, result: Result, whole: Raster) -> None:
        """Note that an image is shown, and measure those before it if it knows its own error.

        Parameters
        ----------
        whole : Raster
            Pixels that an image has where nothing stands against it.
        """
        assert result.value is not None
        if result.request.inputs != self._inputs:
            self._waiting.clear()
            self._inputs = result.request.inputs
        self._last = result
        self._waiting[_kind(result)] = result.value
        if result.image_error is not None:
            self._measure(whole)

    def settle(self, whole: Raster) -> None:
        """Take the last image as the one at rest, and measure those before it."""
        if self._last is not None and isinstance(self._last.request, ImageRequest):
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
    return type(result.request), replace(result.request.quality, live=False)


def _is_whole(result: Result, whole: Raster) -> bool:
    """Whether an image is one at rest, with all pixels."""
    quality = result.request.quality
    is_own = isinstance(result.request, ImageRequest)
    return is_own and not quality.live and quality.pixels.width >= whole.width


def _is_full(result: Result, whole: Raster) -> bool:
    """Whether a moving image is as fine as one at rest."""
    request, quality = result.request, result.request.quality
    has_all = quality.pixels.width >= whole.width and quality.coarseness == 1.0
    # What has an error of its own becomes better at rest.
    return has_all and isinstance(request, ImageRequest) and result.image_error is None


def _at_rest(last: Result, whole: Raster) -> Fidelity:
    width, reasons = last.request.quality.pixels.width, []
    own = last.image_error
    if own is not None and own > GOOD_ENOUGH:
        reasons += [ENDS.format(last.request.quality.samples), ESTIMATED]
    if width < whole.width:
        reasons, own = [TOO_LONG.format(width, whole.width)], None
    return Fidelity(own, False, AT_BEST, tuple(reasons)) if reasons else Fidelity()
