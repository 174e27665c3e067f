"""Jumps of pictures while a TF is edited, which no renderer should have."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from model.rendering.renderer import Renderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TF_SAMPLES, OpacityTF

STEPS = 200
"""Pictures of an edit that moves a mode by one bin in all."""

LIMIT = 0.5
"""Steps of 8 bits that no pixel's second difference should reach: what nobody can see."""


@dataclass(frozen=True)
class Jump:
    """The largest second difference between neighbouring pictures of an edit.

    Attributes
    ----------
    largest : float
        Of any pixel and colour, in steps of 8 bits.
    at : int
        Number of the picture where the largest is.
    """

    largest: float
    at: int


def edits(inputs: SceneInputs, steps: int = STEPS) -> Iterator[SceneInputs]:
    """Yield a scene whose TF's highest mode moves by one bin, in equal steps."""
    tf = inputs.opacity_tf
    bin_width = (tf.scalar_range[1] - tf.scalar_range[0]) / (TF_SAMPLES - 1)
    for number in range(steps + 1):
        yield replace(inputs, opacity_tf=_moved(tf, bin_width * number / steps))


def largest_jump(renderer: Renderer, inputs: SceneInputs, size: int, steps: int = STEPS) -> Jump:
    """Draw an edit, and find the largest second difference of any pixel.

    Parameters
    ----------
    size : int
        Width and height of the pictures in pixels.
    steps : int
        Number of pictures, less one.
    """
    seen: deque[NDArray[np.float32]] = deque(maxlen=3)
    largest, at = 0.0, 0
    for number, edited in enumerate(edits(inputs, steps)):
        seen.append(renderer.render(edited, size)[..., :3])
        if len(seen) == 3:
            before, middle, after = seen
            found = 255 * float(np.abs(after - 2 * middle + before).max())
            if found > largest:
                largest, at = found, number - 1
    return Jump(largest, at)


def _moved(tf: OpacityTF, by: float) -> OpacityTF:
    highest = max(range(len(tf.modes)), key=lambda number: tf.modes[number].amplitude)
    modes = list(tf.modes)
    modes[highest] = replace(modes[highest], mean=modes[highest].mean + by)
    return replace(tf, modes=tuple(modes))
