"""Flicker of path-traced pictures while something moves, beyond what the scene itself changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from model.rendering.path_tracing.cleaning import Cleaning
from model.rendering.path_tracing.refinement import drawn
from model.rendering.path_tracing.renderer import PathTracer
from model.scene.inputs import SceneInputs

PERCENTILE = 99.0


def flicker(
    tracer: PathTracer,
    cleanings: dict[str, Cleaning | None],
    truth: PathTracer,
    frames: Sequence[SceneInputs],
    size: int,
    samples: int,
    many: int,
) -> dict[str, float]:
    """Measure what successive pictures of few samples change beyond the truth.

    Parameters
    ----------
    tracer : PathTracer
        Draws the pictures.
    cleanings : dict of str to callable, or None
        What takes the noise out of them, by name.
    truth : PathTracer
        Draws what they are compared with.
    frames : sequence of SceneInputs
        Three or more of one movement.
    size : int
        Width and height in pixels.
    samples, many : int
        Of each pixel: of the pictures, and of the truth, which is denoised where it can be.

    Returns
    -------
    dict of str to float
        By the names of `cleanings`: the 99th percentile over all pixels and colours of the second
        difference's distance from the truth's, in steps of 8 bits.
    """

    def series(draw: Callable[[SceneInputs], NDArray[np.float32]]) -> NDArray[np.float32]:
        return np.diff(np.stack([draw(inputs)[..., :3] for inputs in frames]), n=2, axis=0)

    best = next((each for each in cleanings.values() if each is not None), None)
    right = series(lambda inputs: drawn(truth, inputs, size, many, cleaning=best).rgba)
    found = {}
    for name, cleaning in cleanings.items():

        def draw(inputs: SceneInputs, cleaning: Cleaning | None = cleaning) -> NDArray[np.float32]:
            return drawn(tracer, inputs, size, samples, cleaning=cleaning).rgba

        beyond = np.abs(series(draw) - right)
        found[name] = 255 * float(np.percentile(beyond, PERCENTILE))
    return found
