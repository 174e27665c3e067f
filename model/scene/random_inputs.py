"""Random views, lights and TFs: the paper's (section 4.3.1), and TFs like users' own.

Every draw takes an explicit :class:`numpy.random.Generator` and is a function of its arguments
only. The family "paper" has only mixtures of Gaussian modes; "drawn" also has ramps, plateaus,
steps, bands, free curves, and TFs that show little or nothing.
"""

import colorsys
from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np

from model.scene.scene import LightDirection, LightRange, Scene
from model.scene.transfer_function import TF_SAMPLES, ColorTF, GaussianMode, OpacityTF
from model.scene.view import View, ViewRange, upright_frame

OpacityKind = Literal[
    "modes", "ramp", "plateau", "step", "band", "curve", "constant", "nearly empty", "empty"
]
"""Shape of an opacity TF."""

SHARES: dict[OpacityKind, float] = {
    "modes": 0.4, "ramp": 0.08, "plateau": 0.1, "step": 0.08, "band": 0.12, "curve": 0.12,
    "constant": 0.05, "nearly empty": 0.03, "empty": 0.02,
}  # fmt: skip
"""Frequencies of the kinds in the family "drawn"."""

MAX_MODES = 5
MIN_WIDTH_BINS = 2.0  # least width of random modes and edges, also near the ends

LEAST_CONSTANT = 0.001
CURVE_POINTS = 3, 8
COLOR_MAP_SHARE = 0.4  # share of the family "drawn" with colours of one of `COLOR_MAPS`
Stops = tuple[tuple[float, float, float], ...]

COLOR_MAPS: dict[str, Stops] = {
    "gray": ((0, 0, 0), (1, 1, 1)),
    "black body": ((0, 0, 0), (0.7, 0.1, 0.05), (0.9, 0.4, 0.05), (0.9, 0.9, 0.2), (1, 1, 1)),
    "cool to warm": ((0.23, 0.3, 0.75), (0.87, 0.87, 0.87), (0.71, 0.02, 0.15)),
    "rainbow": ((0, 0, 1), (0, 1, 1), (0, 1, 0), (1, 1, 0), (1, 0, 0)),
    "viridis": (
        (0.27, 0.0, 0.33), (0.23, 0.32, 0.55), (0.13, 0.57, 0.55),
        (0.37, 0.79, 0.38), (0.99, 0.91, 0.14),
    ),
    "bone": ((0, 0, 0), (0.33, 0.33, 0.45), (0.66, 0.78, 0.78), (1, 1, 1)),
}  # fmt: skip
"""Stops, evenly spaced over the range, of colour maps in common use."""


def draw_kind(rng: np.random.Generator, scene: Scene) -> OpacityKind:
    """Draw the kind of an opacity TF; use no random number for the family "paper"."""
    if scene.tf_family == "paper":
        return "modes"
    kinds = list(SHARES)
    return kinds[int(rng.choice(len(kinds), p=[*SHARES.values()]))]


def draw_opacity_tf(rng: np.random.Generator, scene: Scene) -> OpacityTF:
    """Draw an opacity TF of the scene's family."""
    return opacity_tf_of(draw_kind(rng, scene), rng, scene)


def opacity_tf_of(kind: OpacityKind, rng: np.random.Generator, scene: Scene) -> OpacityTF:
    """Draw an opacity TF of one kind.

    A ramp and a plateau rise from 0 to a constant opacity between two values; a step does so over
    :data:`MIN_WIDTH_BINS`; a band is a trapezoid, a curve is linear between points. Nearly empty
    TFs have modes of at most .01.
    """
    if kind == "modes":
        return _modes(rng, scene)
    if kind == "nearly empty":
        faint = _modes(rng, scene)
        factor = 0.01 * rng.uniform() / max(mode.amplitude for mode in faint.modes)
        modes = (GaussianMode(m.mean, m.width, m.amplitude * factor) for m in faint.modes)
        return OpacityTF(scene.scalar_range, tuple(modes), scale=scene.scale)
    if kind == "empty":
        return OpacityTF(scene.scalar_range, scale=scene.scale)
    lo, hi = scene.scalar_range
    points = sorted(_POINTS[kind](rng, scene))
    return OpacityTF(
        scene.scalar_range,
        points=tuple((float(np.clip(value, lo, hi)), float(opacity)) for value, opacity in points),
        scale=scene.scale,
    )


def draw_color_tf(rng: np.random.Generator, scene: Scene, opacity: OpacityTF) -> ColorTF:
    """Draw a colour TF: a common colour map, or a colour for each feature of the opacity TF.

    Random colours are light (HSL lightness above 0.6) at modes and inner points of a curve, and
    dark (below 0.4) at both ends, so that opaque values are bright. They are interpolated linearly
    in RGB.
    """
    lo, hi = opacity.scalar_range
    if scene.tf_family == "drawn" and rng.uniform() < COLOR_MAP_SHARE:
        colors = [*COLOR_MAPS.values()][int(rng.integers(len(COLOR_MAPS)))]
        if rng.uniform() < 0.25:
            colors = colors[::-1]
        places = np.linspace(lo, hi, len(colors)).tolist()
        return ColorTF(
            opacity.scalar_range, tuple((p, *c) for p, c in zip(places, colors, strict=True))
        )
    means = sorted(mode.mean for mode in opacity.modes)
    means += [value for value, _ in opacity.points if lo < value < hi]
    values = [lo, *means, hi]
    stops = []
    for i, value in enumerate(values):
        at_end = i in (0, len(values) - 1)
        lightness = rng.uniform(0.0, 0.4) if at_end else rng.uniform(0.6, 1.0)
        red, green, blue = colorsys.hls_to_rgb(rng.uniform(), lightness, rng.uniform())
        stops.append((value, red, green, blue))
    return ColorTF(opacity.scalar_range, tuple(stops))


def _modes(rng: np.random.Generator, scene: Scene) -> OpacityTF:
    """Draw a mixture of 1 to 5 Gaussian modes, as the paper."""
    lo, hi = scene.scalar_range
    count = int(rng.integers(1, MAX_MODES + 1))
    means = rng.uniform(*scene.scalar_window, count)
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
    return OpacityTF(scene.scalar_range, modes, scale=scene.scale)


Points = list[tuple[float, float]]


def _ramp(rng: np.random.Generator, scene: Scene, ends: int = 2, least: float = 0.0) -> Points:
    """A rise from 0 at one value; with a least opacity, to one that is log-uniform above it."""
    first, *_, last = 2 * sorted(rng.uniform(*scene.scalar_window, ends))
    height = float(np.exp(rng.uniform(np.log(least), 0))) if least else rng.uniform(0.05, 1.0)
    return [(first, 0.0), (last + _edge(scene), height)]


def _band(rng: np.random.Generator, scene: Scene) -> Points:
    values = sorted(rng.uniform(*scene.scalar_window, 4))
    height, edge = rng.uniform(0.05, 1.0), _edge(scene)
    a, b, c, d = (value + i * edge for i, value in enumerate(values))
    return [(a, 0.0), (b, height), (c, height), (d, 0.0)]


def _curve(rng: np.random.Generator, scene: Scene) -> Points:
    first, last = CURVE_POINTS
    count = int(rng.integers(first, last + 1))
    values = np.sort(rng.uniform(*scene.scalar_window, count))
    # Half of the points are at 0, as other curves would hide the inside.
    heights = rng.uniform(0.0, 1.0, count) ** 2 * (rng.uniform(size=count) < 0.5)
    return [*zip(values.tolist(), heights.tolist(), strict=True)]


def _constant(rng: np.random.Generator, scene: Scene) -> Points:
    return [(scene.scalar_range[0], float(np.exp(rng.uniform(np.log(LEAST_CONSTANT), 0))))]


def _edge(scene: Scene) -> float:
    """Least distance between points of different opacity."""
    lo, hi = scene.scalar_range
    return MIN_WIDTH_BINS * (hi - lo) / TF_SAMPLES


_POINTS: dict[OpacityKind, Callable[[np.random.Generator, Scene], Points]] = {
    "ramp": _ramp, "plateau": partial(_ramp, least=0.01), "step": partial(_ramp, ends=1),
    "band": _band, "curve": _curve, "constant": _constant,
}  # fmt: skip


def draw_view(rng: np.random.Generator, view_range: ViewRange) -> View:
    """Draw a view uniformly over the range; azimuths cover the whole circle."""
    view = View(
        azimuth=rng.uniform(0.0, 360.0),
        elevation=rng.uniform(-view_range.max_elevation, view_range.max_elevation),
        roll=rng.uniform(-view_range.max_roll, view_range.max_roll),
        distance=rng.uniform(view_range.nearest, view_range.farthest),
    )
    return view.in_frame(upright_frame(view_range.up).T)


def draw_light(rng: np.random.Generator, light_range: LightRange) -> LightDirection:
    """Draw a light direction with both angles uniform over the range."""
    return LightDirection(
        azimuth=rng.uniform(-light_range.max_azimuth, light_range.max_azimuth),
        elevation=rng.uniform(-light_range.max_elevation, light_range.max_elevation),
    )
