"""Random views and transfer functions, drawn as in the paper (section 4.3.1), and lights.

Every draw takes an explicit :class:`numpy.random.Generator` and is a function
of its arguments only.
"""

from __future__ import annotations

import colorsys

import numpy as np

from model.scene.light import LightDirection, LightRange
from model.scene.transfer_function import TF_SAMPLES, ColorTF, GaussianMode, OpacityTF, Range
from model.scene.view import View, ViewRange

MAX_MODES = 5
MIN_WIDTH_BINS = 2.0
"""Least width of random modes, in bins, so that modes near the ends are not spikes."""


def draw_view(rng: np.random.Generator, view_range: ViewRange) -> View:
    """Draw a view uniformly over the range; azimuths cover the whole circle."""
    return View(
        azimuth=rng.uniform(0.0, 360.0),
        elevation=rng.uniform(-view_range.max_elevation, view_range.max_elevation),
        roll=rng.uniform(-view_range.max_roll, view_range.max_roll),
        distance=rng.uniform(view_range.nearest, view_range.farthest),
    )


def draw_light(rng: np.random.Generator, light_range: LightRange) -> LightDirection:
    """Draw a light direction with both angles uniform over the range."""
    return LightDirection(
        azimuth=rng.uniform(-light_range.max_azimuth, light_range.max_azimuth),
        elevation=rng.uniform(-light_range.max_elevation, light_range.max_elevation),
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
        Range of the means; outside it, renderings are opaque or empty throughout.

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
    the ends dark (below 0.4), so that values with high opacity are also bright;
    colours are interpolated linearly in RGB.
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
