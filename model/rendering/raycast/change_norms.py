"""Squared change of image windows by every edit of a family; on CPU threads.

The derivative of each pixel by the opacity of samples (see :mod:`.differentiation`) is
mapped to the family's edits before it is squared, pixel by pixel, as changes of one edit at
several bins may cancel.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.compilation import compiled, inlined
from model.rendering.raycast.batch import stack_batch
from model.rendering.raycast.differentiation import FAINT_BEAM, look, make_path, strength_of
from model.rendering.raycast.marching import opacity_of_part, slope_of_part
from model.rendering.raycast.rays import ONE, ZERO, make_ray
from model.rendering.raycast.shading import corner_of, light_place
from model.rendering.raycast.shadow_derivatives import SPAN, take_light
from model.rendering.raycast.tables import LEVELS_PER_BIN, NOTHING
from model.scene.transfer_function import TF_SAMPLES

BAND = 16
"""Largest number of edits that change one bin; a constant, so that it fills vector registers."""


def band_of(edits: NDArray[np.floating]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return edits (n, 256) by bin, without those that do not change it.

    Returns
    -------
    band : ndarray of float32, shape (256, BAND)
        Each bin's change by edits that follow one another.
    begin : ndarray of int64, shape (256,)
        The first of them; those behind the n edits given are zero.
    """
    touched = edits != 0
    begin = touched.argmax(axis=0)
    end = np.where(touched.any(axis=0), len(edits) - touched[::-1].argmax(axis=0), 0)
    if (end - begin).max() > BAND:
        raise ValueError(f"{(end - begin).max()} edits change one bin; at most {BAND} may")
    padded = np.zeros((len(edits) + BAND, TF_SAMPLES), dtype=np.float32)
    padded[: len(edits)] = edits
    places = begin[:, None] + np.arange(BAND)
    return padded[places, np.arange(TF_SAMPLES)[:, None]], begin


@compiled
def square_changes(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    colors: Any,
    light: Any,
    glow: Any,
    shadows: Any,
    least: Any,
    camera: Any,
    step: float,
    size: int,
    longest: int,
    edits: Any,
    begin: Any,
    turns: Any,
    windows: Any,
    squares: Any,
) -> None:
    """Sum the squared changes of windows of an image.

    Parameters
    ----------
    edits : ndarray of float32, shape (256, BAND)
        Change of the opacity of a sample at each bin by edits after one another.
    begin : ndarray of int64, shape (256,)
        The first of these edits.
    turns : LightGrid or None
        Change of soft light by each edit, (nodes, n); its nodes may be others than the light's.
    windows : ndarray of int64, shape (m, 4)
        First row, row after the last, first column, column after the last.
    squares : ndarray of float64, shape (n,)
        Output: sum of dI squared over the pixels and channels of all windows.

    See :func:`model.rendering.raycast.differentiation.differentiate_windows` for the others.
    """
    levels, staging, _ = stack_batch(voxels)
    path = make_path(longest)
    image = np.empty(3, dtype=np.float32)
    slopes = np.zeros((TF_SAMPLES + 1, 3), dtype=np.float32)
    taken = np.zeros(TF_SAMPLES + 1, dtype=np.float32)
    changes = np.empty((3, len(squares)), dtype=np.float32)
    squares[:] = 0
    for n in range(len(windows)):
        for row in range(windows[n, 0], windows[n, 1]):
            for column in range(windows[n, 2], windows[n, 3]):
                ray, _ = make_ray(camera, step, column, row, size)
                if ray.count == 0:
                    continue
                count = look(
                    voxels, shape, scale, missing, cells, cell_shape, shift,
                    alphas, colors, light, glow, shadows, ray, levels, staging, path, image,
                )  # fmt: skip
                first, last = _slopes_by_bin(missing, alphas, least, ray, path, count, slopes)
                if shadows is not None:
                    beams = path.beams
                    enough = FAINT_BEAM * strength_of(beams, count)
                    for k in range(count + SPAN):
                        if abs(beams[k, 0]) + abs(beams[k, 1]) + abs(beams[k, 2]) > enough:
                            low, high = take_light(
                                voxels, shape, scale, missing, alphas, shadows, ray, k, ONE,
                                levels, staging, path.shadow, taken,
                            )  # fmt: skip
                            first, last = min(first, low), max(last, high)
                            for bin_ in range(low, high + 1):
                                slopes[bin_, 0] += beams[k, 0] * taken[bin_]
                                slopes[bin_, 1] += beams[k, 1] * taken[bin_]
                                slopes[bin_, 2] += beams[k, 2] * taken[bin_]
                                taken[bin_] = ZERO
                if glow is not None:
                    changes[:] = ZERO
                    _add_light(turns, ray, path.beams, count, changes)
                    _add_edits(slopes, first, last, edits, begin, changes)
                    for edit in range(len(squares)):
                        for channel in range(3):
                            squares[edit] += changes[channel, edit] ** 2
                else:
                    _add_squares(slopes, first, last, edits, begin, changes, squares)


@inlined
def _slopes_by_bin(
    missing: Any,
    alphas: Any,
    least: Any,
    ray: Any,
    path: Any,
    count: int,
    slopes: Any,
) -> Any:
    """Add a pixel's derivative to zeros (257, 3); return the first and the last bin."""
    red = green = blue = ZERO
    first: Any = TF_SAMPLES
    last: Any = 0
    for k in range(count - 1, -1, -1):
        if missing is not None and path.levels[k] == NOTHING:
            continue
        level = np.uint64(np.uint32(path.levels[k]))
        a, through = alphas[level], path.clear[k]
        over_red = path.colors[k, 0] - red
        over_green = path.colors[k, 1] - green
        over_blue = path.colors[k, 2] - blue
        part = ONE
        if k == ray.count - 1:
            part = slope_of_part(a, ray.rest, least)
            a = opacity_of_part(a, ray.rest)
        red += a * over_red
        green += a * over_green
        blue += a * over_blue
        over_red = part * over_red + path.turns[k, 0]
        over_green = part * over_green + path.turns[k, 1]
        over_blue = part * over_blue + path.turns[k, 2]
        lower = level // np.uint64(LEVELS_PER_BIN)
        first, last = min(first, np.int64(lower)), max(last, np.int64(lower))
        share = np.float32(np.int32(level % np.uint64(LEVELS_PER_BIN)))
        upper = share / np.float32(LEVELS_PER_BIN) * through
        below = through - upper
        # The last bin has one more behind it, for what is above it by nothing.
        slopes[lower, 0] += below * over_red
        slopes[lower, 1] += below * over_green
        slopes[lower, 2] += below * over_blue
        slopes[lower + np.uint64(1), 0] += upper * over_red
        slopes[lower + np.uint64(1), 1] += upper * over_green
        slopes[lower + np.uint64(1), 2] += upper * over_blue
    return first, last + 1


@inlined
def _add_squares(
    slopes: Any, first: int, last: int, edits: Any, begin: Any, changes: Any, squares: Any
) -> None:
    """Add a pixel's squared change by each edit, and clear its derivative."""
    start, end = begin[first], begin[min(last, TF_SAMPLES - 1)] + BAND
    red, green, blue = changes[0], changes[1], changes[2]
    for edit in range(start, end):
        red[edit] = green[edit] = blue[edit] = ZERO
    _add_edits(slopes, first, last, edits, begin, changes)
    for edit in range(np.uint64(start), np.uint64(end)):
        squares[edit] += red[edit] ** 2 + green[edit] ** 2 + blue[edit] ** 2


@inlined
def _add_edits(slopes: Any, first: int, last: int, edits: Any, begin: Any, changes: Any) -> None:
    """Add a pixel's change by each edit, and clear its derivative."""
    last = min(last, TF_SAMPLES - 1)
    # Not the constant: unrolled, the loop is not vectorized.
    flat, width = edits.ravel(), np.uint64(edits.shape[1])
    red, green, blue = changes[0], changes[1], changes[2]
    for bin_ in range(first, last + 1):
        row, at = np.uint64(bin_ * BAND), np.uint64(begin[bin_])
        r, g, b = slopes[bin_, 0], slopes[bin_, 1], slopes[bin_, 2]
        slopes[bin_, 0] = slopes[bin_, 1] = slopes[bin_, 2] = ZERO
        for m in range(width):
            weight = flat[row + m]
            red[at + m] += r * weight
            green[at + m] += g * weight
            blue[at + m] += b * weight


@inlined
def _add_light(turns: Any, ray: Any, beams: Any, count: int, changes: Any) -> None:
    """Add the change of a pixel's soft light by each edit, cell by cell of the light's grid."""
    around = np.zeros((8, 3), dtype=np.float32)
    before, is_lit = np.uint64(0), False
    for k in range(count):
        red, green, blue = beams[k, 0], beams[k, 1], beams[k, 2]
        if red + green + blue <= ZERO:
            continue
        place, fx, fy, fz = light_place(turns, ray, min(np.float32(k), ray.last))
        if is_lit and place != before:
            _add_cell(turns, before, around, changes)
        before, is_lit = place, True
        for corner in range(8):
            _, share = corner_of(turns, place, fx, fy, fz, corner)
            around[corner, 0] += share * red
            around[corner, 1] += share * green
            around[corner, 2] += share * blue
    if is_lit:
        _add_cell(turns, before, around, changes)


@inlined
def _add_cell(turns: Any, place: Any, around: Any, changes: Any) -> None:
    """Add the change by the light at a cell's corners, and clear their weights."""
    for corner in range(8):
        at, _ = corner_of(turns, place, ZERO, ZERO, ZERO, corner)
        r, g, b = around[corner, 0], around[corner, 1], around[corner, 2]
        around[corner, 0] = around[corner, 1] = around[corner, 2] = ZERO
        for edit in range(changes.shape[1]):
            turn = turns.grid[at, edit]
            changes[0, edit] += r * turn
            changes[1, edit] += g * turn
            changes[2, edit] += b * turn
