"""Speed against accuracy: the stops of the slider, and the error of coarser images."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import resized

GOOD_ENOUGH = 0.003  # RMS error of the colours that is invisible: less than an 8-bit step
USUAL_SECONDS = 1 / 12  # default time for an image while something moves
MOST_PATIENCE = 2.0  # longest time for other answers, as a multiple of the usual one
REFINING_SECONDS = 15.0  # of path-traced light; samples that end later are not begun
COMPARED = 128  # pixels along each side, at most, by which two images are compared
Stop = Literal["fast", "balanced", "exact"]  # name of a stop

Rgba = NDArray[np.float32]


@dataclass(frozen=True)
class Exactness:
    """A stop of the slider from fast to exact."""

    live_seconds: float  # of an image while something moves; infinite for all of its pixels
    error: float  # estimated, of a path-traced image at rest that gets no more samples
    samples: int  # of each of its pixels at most
    distance: float | None = None  # of samples along rays at rest, in voxels; None as usual
    refining_seconds: float = REFINING_SECONDS  # that a path-traced image at rest may take

    @property
    def patience(self) -> float:
        """Time for live answers other than images, as a multiple of the usual one."""
        return min(self.live_seconds / USUAL_SECONDS, MOST_PATIENCE)


STOPS: dict[Stop, Exactness] = {
    # From 32 to 64 samples, a denoised image takes twice the time and loses a tenth of its error.
    "fast": Exactness(1 / 30, 0.012, 32),
    "balanced": Exactness(USUAL_SECONDS, GOOD_ENOUGH, 32),
    "exact": Exactness(math.inf, 0.001, 1024, 0.25, math.inf),
}
"""The fastest first."""

USUAL: Stop = "balanced"  # the default stop


def distance(coarse: Rgba, fine: Rgba) -> float:
    """Root mean squared difference of two images' colours, as a screen shows them."""
    places = [_grid(count) for count in fine.shape[:2]]
    truth = fine[np.ix_(*places)][..., :3]
    found = resized(coarse[..., :3], fine.shape[:2], places)
    one, other = (np.clip(np.nan_to_num(image), 0, 1) for image in (found, truth))
    return float(np.sqrt(np.mean((one - other).astype(np.float64) ** 2)))


def _grid(count: int) -> NDArray[np.intp]:
    """Indices of at most :data:`COMPARED` pixels, spread evenly."""
    chosen = min(count, COMPARED)
    return ((np.arange(chosen) + 0.5) * count / chosen).astype(np.intp)
