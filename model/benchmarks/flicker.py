"""Flicker of path-traced pictures while something moves, beyond what the scene itself changes."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs

PERCENTILE = 99.0

Draw = Callable[[SceneInputs], NDArray[np.float32]]


@dataclass(frozen=True)
class Flicker:
    """Changes of successive pictures beyond the truth, and their distance from it.

    Attributes
    ----------
    seconds : float
        Median time of a picture.
    most, mean : float
        99th percentile and mean, over all pixels and colours, of the second difference's distance
        from the truth's, in steps of 8 bits.
    error : float
        Root mean square of the colours' distances from the truth's, 0 to 1.
    """

    seconds: float
    most: float
    mean: float
    error: float


def flicker(
    draws: Mapping[str, Draw], truth: Draw, frames: Sequence[SceneInputs], first: int = 0
) -> dict[str, Flicker]:
    """Measure how pictures flicker.

    Parameters
    ----------
    draws : dict of str to callable
        What draws a picture (rows, columns, 4), by name; it is called frame by frame.
    truth : callable
        Draws what they are compared with.
    frames : sequence of SceneInputs
        Of one movement.
    first : int
        First frame that counts; three or more do.
    """
    right = np.stack([truth(inputs)[..., :3] for inputs in frames[first:]])
    found = {}
    for name, draw in draws.items():
        timed = [_timed(draw, inputs) for inputs in frames][first:]
        drawn = np.stack([image[..., :3] for image, _ in timed])
        beyond = 255 * np.abs(np.diff(drawn, n=2, axis=0) - np.diff(right, n=2, axis=0))
        found[name] = Flicker(
            median(seconds for _, seconds in timed),
            float(np.percentile(beyond, PERCENTILE)),
            float(beyond.mean()),
            float(np.sqrt(np.mean((drawn - right) ** 2))),
        )
    return found


def _timed(draw: Draw, inputs: SceneInputs) -> tuple[NDArray[np.float32], float]:
    begun = time.perf_counter()
    return draw(inputs), time.perf_counter() - begun
