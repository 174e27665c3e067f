"""Random views and transfer functions, drawn as in the paper (section 4.3.1).

Every draw takes an explicit :class:`numpy.random.Generator`, and
:func:`sample_rng` gives each sample of each split one of its own: sample 17
is the same whichever process draws it, and in whatever order.
"""

from __future__ import annotations

import colorsys
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from model.scene.scene import Scene
from model.scene.tf_perturbation import EDIT_WIDTH
from model.scene.transfer_function import (
    TF_SAMPLES,
    ColorTF,
    GaussianMode,
    OpacityTF,
    Range,
    TransferFunction,
)
from model.scene.view import View, ViewRange

Split = Literal["train", "holdout"]
"""Which samples: those to learn from, or those that no training ever sees."""

MAX_MODES = 5
MIN_WIDTH_BINS = 2.0
"""Narrowest random mode, in bins; without a floor, modes near the ends would become spikes."""

TF_STREAM = 3
"""Tells the random numbers of opacity TFs on their own from all others."""

EDIT_STREAM = 4
"""The same for edits of opacity TFs."""

EDIT_HEIGHT = 0.1
"""Opacity that random edits add or take away where they are highest."""


@dataclass(frozen=True)
class SceneSample:
    """The inputs of one rendering."""

    view: View
    transfer_function: TransferFunction


def sample_rng(seed: int, split: Split, index: int) -> np.random.Generator:
    """The random generator of one sample: a function of its arguments only."""
    return np.random.default_rng([seed, get_args(Split).index(split), index])


def draw_sample(scene: Scene, seed: int, split: Split, index: int) -> SceneSample:
    """Draw sample `index` of a split of this scene."""
    rng = sample_rng(seed, split, index)
    view = draw_view(rng, scene.view_range)
    opacity = draw_opacity_tf(rng, scene.scalar_range, scene.scalar_window)
    return SceneSample(view, TransferFunction(opacity, draw_color_tf(rng, opacity)))


def draw_opacity_tfs(scene: Scene, seed: int, index: int, count: int) -> NDArray[np.float32]:
    """Draw opacity TFs on their own, sampled over the scalar range: (count, 256), in 0..1.

    Batch `index` is a function of the arguments only, like a sample.
    """
    rng = np.random.default_rng([seed, TF_STREAM, index])
    tfs = [draw_opacity_tf(rng, scene.scalar_range, scene.scalar_window) for _ in range(count)]
    return np.stack([tf.sample(scene.scalar_range) for tf in tfs])


def draw_edits(scene: Scene, seed: int, index: int, count: int) -> NDArray[np.float32]:
    """Draw smooth edits of opacity TFs, sampled over the scalar range: (count, 256).

    Batch `index` is a function of the arguments only, like a sample.

    Returns
    -------
    ndarray of float32, shape (count, 256)
        Bumps of a height of :data:`EDIT_HEIGHT`, up or down, to be added to a
        TF's opacities: Gaussians with means uniform in the scalar window and
        standard deviations from half to four times those that sensitivities
        stand for (:data:`model.scene.tf_perturbation.EDIT_WIDTH`), on a logarithmic scale.
    """
    rng = np.random.default_rng([seed, EDIT_STREAM, index])
    lo, hi = scene.scalar_range
    means = rng.uniform(*scene.scalar_window, (count, 1))
    widths = EDIT_WIDTH * 2.0 ** rng.uniform(-1, 2, (count, 1))
    heights = EDIT_HEIGHT * rng.choice([-1.0, 1.0], (count, 1))
    bins = np.arange(TF_SAMPLES) - (means - lo) / (hi - lo) * (TF_SAMPLES - 1)
    return (heights * np.exp(-0.5 * (bins / widths) ** 2)).astype(np.float32)


def draw_view(rng: np.random.Generator, view_range: ViewRange) -> View:
    """Draw a view uniformly over the range; azimuths cover the whole circle."""
    return View(
        azimuth=rng.uniform(0.0, 360.0),
        elevation=rng.uniform(-view_range.max_elevation, view_range.max_elevation),
        roll=rng.uniform(-view_range.max_roll, view_range.max_roll),
        distance=rng.uniform(view_range.nearest, view_range.farthest),
    )


def draw_opacity_tf(
    rng: np.random.Generator, scalar_range: Range, scalar_window: Range
) -> OpacityTF:
    """Draw a mixture of 1 to 5 Gaussian modes.

    Parameters
    ----------
    rng : numpy.random.Generator
    scalar_range : tuple of float
        The volume's scalar range.
    scalar_window : tuple of float
        Where the means may lie; outside it a rendering is all opaque or empty.

    Returns
    -------
    OpacityTF
        Means uniform in the window; widths uniform from a floor of two bins to
        half the distance to the nearer end of the range; amplitudes uniform in
        0.1..1, divided by their sum when there is more than one mode.
    """
    lo, hi = scalar_range
    count = int(rng.integers(1, MAX_MODES + 1))
    means = rng.uniform(*scalar_window, count)
    floor = MIN_WIDTH_BINS * (hi - lo) / TF_SAMPLES
    widest = np.maximum(np.minimum(means - lo, hi - means) / 2, floor)
    widths = rng.uniform(floor, widest)
    amplitudes = rng.uniform(0.1, 1.0, count)
    if count > 1:
        amplitudes /= amplitudes.sum()
    modes = tuple(
        GaussianMode(float(m), float(w), float(a))
        for m, w, a in zip(means, widths, amplitudes, strict=True)
    )
    return OpacityTF(scalar_range, modes)


def draw_color_tf(rng: np.random.Generator, opacity: OpacityTF) -> ColorTF:
    """Draw a colour per opacity mode and one for each end of the range.

    The colours at the modes are light (HSL lightness above 0.6) and those at
    the ends dark (below 0.4), so that what the opacity TF brings out is also
    what shines; in between colour is linear in RGB.
    """
    lo, hi = opacity.scalar_range
    values = [lo, *sorted(mode.mean for mode in opacity.modes), hi]
    stops = []
    for i, value in enumerate(values):
        at_end = i in (0, len(values) - 1)
        lightness = rng.uniform(0.0, 0.4) if at_end else rng.uniform(0.6, 1.0)
        red, green, blue = colorsys.hls_to_rgb(rng.uniform(), lightness, rng.uniform())
        stops.append((value, red, green, blue))
    return ColorTF(opacity.scalar_range, tuple(stops))
