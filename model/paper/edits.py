"""Edits of an opacity TF that sensitivities suggest, and what they do (paper, Figs. 8 and 9)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.tf_perturbation import EDIT_WIDTH, with_opacity
from model.scene.transfer_function import TF_SAMPLES, GaussianMode

AMPLITUDE = 0.3
"""Opacity of a mode that is added."""

MOST_OPACITY = 0.6
"""Opacity above which a value is left alone: one more mode there would hardly show."""


def suggested_mode(
    scene: Scene,
    inputs: SceneInputs,
    responses: NDArray[np.floating],
    not_near: GaussianMode | None = None,
) -> GaussianMode:
    """Return the mode that promises most, as the paper's user reads it off the plot."""
    lo, hi = scene.scalar_range
    values = np.linspace(lo, hi, TF_SAMPLES)
    # A mode has no 1/2 in its exponent.
    width = math.sqrt(2) * EDIT_WIDTH * (hi - lo) / (TF_SAMPLES - 1)
    opacity = inputs.opacity_tf.sample(scene.scalar_range)
    first, last = scene.scalar_window
    free = (values >= first) & (values <= last) & (opacity < MOST_OPACITY)
    if not_near is not None:
        free &= np.abs(values - not_near.mean) > 2 * not_near.width
    strength = np.where(free, np.abs(responses), -1.0)
    return GaussianMode(float(values[strength.argmax()]), width, AMPLITUDE)


def with_mode(inputs: SceneInputs, mode: GaussianMode) -> SceneInputs:
    """Return the inputs with one more mode of the opacity TF, of modes or a free curve."""
    tf = inputs.opacity_tf
    if not tf.points:
        return replace(inputs, opacity_tf=replace(tf, modes=(*tf.modes, mode)))
    values = np.linspace(*tf.scalar_range, TF_SAMPLES)
    bump = mode.amplitude * np.exp(-(((values - mode.mean) / mode.width) ** 2))
    return with_opacity(inputs, tf.sample() + bump)


def rms_change(
    before: NDArray[np.floating], after: NDArray[np.floating], mask: NDArray[np.bool_]
) -> float:
    """Root mean square of the change of some pixels' colours, for images (S, S, 3)."""
    change = after[mask].astype(np.float64) - before[mask]
    return float(np.sqrt(np.square(change).mean()))
