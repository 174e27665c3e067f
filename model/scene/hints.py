"""Hints about a TF: why an image is empty, and parts too narrow to be drawn."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs
from model.scene.ranges import range_text
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range
from model.scene.value_scale import ValueScale
from model.scene.view import VIEW_ANGLE, View

FAINTEST = 1.5 / 255  # opacity of an invisible pixel: hardly a level of 8 bits
TRANSPARENT = 1e-5  # opacity of voxels that are invisible even a thousand in a row
FEW = 1e-5  # share of the voxels that is easily missed in an image
FAINT_PART = 0.01  # share of a TF's largest opacity below which a value hardly counts as visible
POINTS_PER_BIN = 9  # scalar values of a bin at which the opacity is looked up
CLOSE = 0.7  # view distance below which part of the volume may be outside the image
SMALLEST = 0.01  # least diameter of a visible volume, as a fraction of the image's height
Cause = Literal["tf", "crop", "mask", "view"]


@dataclass(frozen=True)
class Emptiness:
    """Reason why an image shows nothing."""

    text: str  # one sentence for the user
    cause: Cause  # what to change: the TF, the crop box, the mask, or the view


def nothing_visible(rgba: NDArray[np.float32]) -> bool:
    """Whether no pixel of an RGBA image (H, W, 4) is visible; a NaN pixel is not."""
    opacity = rgba[..., 3]
    return not bool((opacity >= FAINTEST).any())


def why_nothing(
    inputs: SceneInputs,
    volume_range: Range,
    counts: NDArray[np.int64],
    edges: NDArray[np.float64],
    aspect: float = 1.0,
) -> Emptiness:
    """Explain why an image shows nothing.

    The volume's range is that of all its voxels; the histogram has counts (B,) between increasing
    edges (B + 1,), in the data's units.
    """
    if found := _unshown_values(inputs.opacity_tf, volume_range, counts, edges):
        return Emptiness(found, "tf")
    if found := _out_of_view(inputs.view, aspect):
        return Emptiness(found, "view")
    if not inputs.part.is_whole:
        cuts = {"crop box": inputs.crop, "clipping plane": inputs.clip}
        names = " or ".join(name for name, cut in cuts.items() if cut is not None)
        return Emptiness(f"The {names} cuts away all that the TF shows in this view.", "crop")
    if inputs.mask is not None:
        return Emptiness("The mask hides all that the TF shows in this view.", "mask")
    view = inputs.view
    if view.distance < CLOSE or view.pan_x or view.pan_y:
        return Emptiness("The TF shows nothing in the part of the volume that is in view.", "view")
    return Emptiness("What the TF shows is too transparent to be seen.", "tf")


def _unshown_values(
    opacity_tf: OpacityTF,
    volume_range: Range,
    counts: NDArray[np.int64],
    edges: NDArray[np.float64],
) -> str:
    """Explain why a TF shows none of the volume's values; empty if it shows some."""
    # As in renderers: sampled over its range, constant beyond its ends.
    values = np.linspace(*opacity_tf.scalar_range, TF_SAMPLES)
    samples = opacity_tf.sample()
    peak = float(samples.max())
    if peak < TRANSPARENT:
        return "The TF is transparent at every scalar value."
    least = max(TRANSPARENT, FAINT_PART * peak)
    low, high = values[samples >= least][[0, -1]]
    shown = "the scalar value" if low == high else "scalar values from"
    shown += f" {low:.4g}" if low == high else f" {low:.4g} to {high:.4g}"
    first, last = volume_range
    ends = np.interp([first, last], values, samples)
    if (low > last or high < first) and ends.max() < least:
        return (
            f"The TF shows only {shown}, but the volume's lie between {first:.4g} and {last:.4g}."
        )
    within = edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0, 1, POINTS_PER_BIN)
    bins = np.interp(within, values, samples).max(axis=1) >= least
    count, total = int(counts[bins].sum()), int(counts.sum())
    if count == 0:
        return f"The TF shows only {shown}, which no voxel has."
    if count < FEW * total:
        voxels = "voxel" if count == 1 else "voxels"
        return f"The TF shows only {shown}, which {count:,} {voxels} of {total:,} have."
    return ""


def _out_of_view(view: View, aspect: float) -> str:
    """Explain how a view misses the volume's bounding sphere; empty if it does not."""
    half_angle = math.radians(VIEW_ANGLE / 2)
    sine = math.sin(half_angle) / view.distance
    if sine >= 1 and not view.is_orthographic:
        return ""  # The camera is inside the sphere.
    # In halves of the image's height, like the pan.
    height = sine if view.is_orthographic else math.tan(math.asin(sine))
    radius = height / math.tan(half_angle)
    if abs(view.pan_x) > aspect + radius or abs(view.pan_y) > 1 + radius:
        return "The view was moved until the volume left the image."
    if radius < SMALLEST:
        return "The view is so far away that the volume is too small to be seen."
    return ""


LEAST_RISE = 0.05  # least height of a part that is mentioned, as a fraction of the largest opacity
LEAST_SHADE = 0.1  # the same for colours, as a share of full brightness
LEAST_WIDTH = 0.7  # least width of a curve's part that is drawn correctly, in table entries
WANTED_ENTRIES = 8  # entries for the narrowest part after the remedy
ROUND_STEPS = 40  # number of steps to which the remedy's ends are rounded, about
REACH = 2.0  # distance from its mean to which a mode is followed, in widths


@dataclass(frozen=True)
class NarrowPart:
    """Part of a TF that is too narrow for tables over its range, and a range that is not."""

    values: Range  # lowest and highest of the narrow part, or of all of them, in the data's units
    scalar_range: Range  # the TF's range
    remedy: Range  # a range that shows the narrow part as it is
    scale: ValueScale  # scale that all these lie on

    @property
    def sentence(self) -> str:
        """The problem, in one sentence."""
        shown = range_text(self.scalar_range, self.scalar_range, self.scale)
        return (
            f"The TF's detail at {self._text(self.values)} is finer than 1/{TF_SAMPLES} of the "
            f"range {shown}: it is drawn wider, or not at all."
        )

    @property
    def remedy_text(self) -> str:
        """The suggested range, such as "29,850 to 30,150"."""
        return self._text(self.remedy)

    def _text(self, values: Range) -> str:
        low, high = self.remedy
        steps = (low, low + TF_SAMPLES * (high - low) / ROUND_STEPS)
        return range_text(values, steps, self.scale)


def narrow_part(opacity: OpacityTF, color: ColorTF | None = None) -> NarrowPart | None:
    """Find parts narrower than an entry of the tables over a TF's range, or None.

    Steps of a curve do not count: they are drawn as a slope of one entry. Narrow parts of colours
    count where the TF is opaque.
    """
    parts = [*_of_modes(opacity)]
    if opacity.points:
        values, heights = np.array(opacity.points).T
        parts += _of_heights(values, heights, opacity.bin_width, LEAST_RISE * heights.max())
    if color is not None:
        parts += _of_colors(color, opacity)
    if not parts:
        return None
    first = min(parts, key=lambda part: part[2])
    low, high = min(part[0] for part in parts), max(part[1] for part in parts)
    if not _holds((low, high), first[2]):
        low, high, _ = first
    lowest, highest = opacity.scalar_range
    shown = _shown(opacity)
    remedy = _around(shown if _holds(shown, first[2]) else (low, high), opacity.scalar_range)
    values = (max(low, lowest), min(high, highest))
    return NarrowPart(values, opacity.scalar_range, remedy, opacity.scale)


def _of_modes(opacity: OpacityTF) -> Iterator[tuple[float, float, float]]:
    """Yield lowest value, highest value and width of each mode that is drawn too wide."""
    lo, hi = opacity.scalar_range
    least = LEAST_RISE * max((mode.amplitude for mode in opacity.modes), default=0.0)
    for mode in opacity.modes:
        narrow = mode.width < opacity.bin_width * (1 - 1e-6)
        if narrow and lo <= mode.mean <= hi and mode.amplitude > least:
            reach = REACH * mode.width
            yield mode.mean - reach, mode.mean + reach, mode.width


def _of_colors(color: ColorTF, opacity: OpacityTF) -> Iterator[tuple[float, float, float]]:
    """Yield ends and width of each peak and dip of red, green and blue where the TF is opaque."""
    values, *channels = np.array(color.stops).T
    least = LEAST_RISE * float(opacity.sample().max())
    for heights in channels:
        for part in _of_heights(values, heights, opacity.bin_width, LEAST_SHADE):
            if float(opacity(np.linspace(*part[:2], 9)).max()) > least:
                yield part


def _of_heights(
    values: NDArray[np.float64], heights: NDArray[np.float64], entry: float, least: float
) -> Iterator[tuple[float, float, float]]:
    """Yield ends and width of each peak and dip of a curve that is narrower than an entry."""
    for curve in (heights, -heights):
        for first, last in _tops(curve):
            part = _narrow_top(values, curve, first, last, entry, least)
            if part is not None:
                yield part


def _tops(heights: NDArray[np.float64]) -> Iterator[tuple[int, int]]:
    """Yield first and last point of each top of a curve, except at its ends."""
    changes = np.flatnonzero(np.diff(heights))
    for before, after in pairwise(changes.tolist()):
        if heights[before] < heights[before + 1] > heights[after + 1]:
            yield before + 1, after


def _narrow_top(
    values: NDArray[np.float64],
    heights: NDArray[np.float64],
    first: int,
    last: int,
    entry: float,
    least: float,
) -> tuple[float, float, float] | None:
    """Lowest value, highest value and width at half height of a top; None if it is not narrow."""
    # A slope down to the foot is wide enough on its own, at half of it.
    sides = [_side(values, heights, at, step, 2 * entry) for at, step in ((first, -1), (last, 1))]
    top, foot = heights[first], max(falling[-1] for _, falling in sides)
    if top - foot <= least:
        return None

    def ends_at(level: float) -> tuple[float, float]:
        left, right = (float(np.interp(-level, -falling, away)) for away, falling in sides)
        return float(values[first]) - left, float(values[last]) + right

    low, high = ends_at((top + foot) / 2)
    if high - low >= LEAST_WIDTH * entry:
        return None
    return *ends_at(foot + 0.02 * (top - foot)), high - low


def _side(
    values: NDArray[np.float64], heights: NDArray[np.float64], start: int, step: int, reach: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances from a top, and the heights there, down to the next rise or within a reach."""
    away, falling = np.abs(values[start::step] - values[start]), heights[start::step]
    rises = np.flatnonzero(np.diff(falling) > 0)
    count = rises[0] + 1 if len(rises) else len(away)
    away, falling = away[:count], falling[:count]
    inside = away < reach
    end = min(reach, away[-1])
    return np.append(away[inside], end), np.append(falling[inside], np.interp(end, away, falling))


def _shown(opacity: OpacityTF) -> Range:
    """Lowest and highest visible value of a TF."""
    lo, hi = opacity.scalar_range
    if not opacity.points:
        visible = [mode for mode in opacity.modes if mode.amplitude > 0]
        low = min(mode.mean - REACH * mode.width for mode in visible)
        high = max(mode.mean + REACH * mode.width for mode in visible)
        return max(low, lo), min(high, hi)
    values, heights = np.array(opacity.points).T
    above = np.flatnonzero(heights > 0)
    first, last = max(above[0] - 1, 0), min(above[-1] + 1, len(values) - 1)
    return float(values[first]), float(values[last])


def _holds(values: Range, width: float) -> bool:
    """Whether tables over a range have enough entries for a part of this width."""
    return values[1] - values[0] <= TF_SAMPLES * width / WANTED_ENTRIES


def _around(values: Range, limits: Range) -> Range:
    """Range with room around some values, of round numbers, within limits."""
    span = 4 * (values[1] - values[0])
    middle = (values[0] + values[1]) / 2
    least = span / ROUND_STEPS
    power: float = 10 ** math.floor(math.log10(least))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= least)
    low = step * math.floor((middle - span / 2) / step)
    high = step * math.ceil((middle + span / 2) / step)
    return max(low, limits[0]), min(high, limits[1])
