"""Derivatives of image windows by the opacity of samples at each bin of the TF; on CPU threads.

A pixel is composited from samples front to back, with transparency T_i in front of sample i and
colour B_{i+1} composited behind it:

    d I / d alpha_i = T_i (c_i - B_{i+1}).

B is computed back to front. There is no division by 1 - alpha_i, so that the derivative also holds
at opaque samples. Transparent samples are included, since an edit may make them visible. Under
direct light c_i is the colour under that light, which does not depend on the TF. In soft light it
does: the pixel's derivative by the light of its samples is added up at the nodes of the light's
grid, and taken back from there for all pixels at once, by the sweeps' adjoint.

One walk along each ray gives a pixel's slopes, by bin and channel. From these come the derivative
of the windows' energy, or the squared change of the windows by every edit of a family. Edits are
applied before the square, pixel by pixel, as changes of one edit at several bins may cancel.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.compilation import compiled, inlined
from model.rendering.raycast.batch import BATCH, fetch, stack_batch
from model.rendering.raycast.classification import ENTRIES, LEVELS_PER_BIN, NOTHING
from model.rendering.raycast.marching import opacity_of_part, slope_of_part
from model.rendering.raycast.rays import ONE, ZERO, make_ray, next_visible
from model.rendering.raycast.shading import corner_of, light_place, received, reflect
from model.scene.transfer_function import TF_SAMPLES

NEGLIGIBLE = np.float32(1e-6)  # transparency below which further samples are neglected

BAND = 16
"""Largest number of edits that change one bin; a constant, so that it fills vector registers."""


class Path(NamedTuple):
    """Record of a view ray's samples, to be traversed back to front."""

    levels: Any  # int32 (n,)
    clear: Any  # float32 (n,): transparency in front of each sample
    colors: Any  # float32 (n, 3): lit, not premultiplied
    weights: Any  # float32 (n,): of each sample's colour in the pixel
    beams: Any  # float32 (n, 3): in soft light, the pixel's derivative by the light of samples


class Edits(NamedTuple):
    """Edits of the opacity TF, of which no more than :data:`BAND` change one bin."""

    by_bin: Any  # float32 (256, BAND): change of a sample's opacity by edits after one another
    begin: Any  # int64 (256,): the first of these edits
    turns: Any  # LightGrid: change of soft light by each edit (nodes, n), on nodes of its own


def band_of(edits: NDArray[np.floating]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return edits (n, 256) by bin, without those that do not change it."""
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
def differentiate_windows(
    medium,
    colors,
    light,
    glow,
    fading,
    least,
    camera,
    step,
    size,
    longest,
    windows,
    gradients,
    energies,
    nodes,
    edits,
    squares,
):
    """Differentiate half the energy of windows of an image, or square their changes by edits.

    The energy is the sum of squared pixel values. With a mask, `fading` (tables * 256 + 1,) has the
    derivatives of samples' opacities by the TF's; without, the caller multiplies by them.
    """
    levels, staging = stack_batch(medium.voxels, BATCH)
    path = Path(
        np.empty(longest, np.int32),
        np.empty(longest, np.float32),
        np.empty((longest, 3), np.float32),
        np.empty(longest, np.float32),
        np.empty((longest, 3), np.float32),
    )
    image = np.empty(3, dtype=np.float32)
    gradient = np.empty(TF_SAMPLES + 1)
    slopes = np.zeros((TF_SAMPLES + 1, 3), dtype=np.float32)
    changes = np.empty((3, len(squares)), dtype=np.float32)
    is_edited, glows = len(squares) > 0, len(glow.grid) > 0
    for n in range(len(windows)):
        gradient[:] = 0
        energy = 0.0
        for row in range(windows[n, 0], windows[n, 1]):
            for column in range(windows[n, 2], windows[n, 3]):
                ray, _ = make_ray(camera, step, column, row, size)
                # A black pixel has a change by edits, but its energy has no derivative.
                if (0 if is_edited else next_visible(medium, ray, 0)) >= ray.count:
                    continue
                count = _look(medium, colors, light, glow, ray, levels, staging, path, image)
                energy += image[0] ** 2 + image[1] ** 2 + image[2] ** 2
                first, last = _slopes_by_bin(medium, fading, least, ray, path, count, slopes)
                if first > last:
                    continue
                if not is_edited:
                    for bin_ in range(np.uint64(first), np.uint64(last + 1)):
                        gradient[bin_] += (
                            image[0] * slopes[bin_, 0]
                            + image[1] * slopes[bin_, 1]
                            + image[2] * slopes[bin_, 2]
                        )
                        slopes[bin_, 0] = slopes[bin_, 1] = slopes[bin_, 2] = ZERO
                    if glows:
                        _add_to_nodes(glow, ray, path.beams, count, image, nodes)
                else:
                    start, end = 0, len(squares)
                    if not glows:
                        start = edits.begin[first]
                        end = edits.begin[min(last, TF_SAMPLES - 1)] + BAND
                    for edit in range(start, end):
                        changes[0, edit] = changes[1, edit] = changes[2, edit] = ZERO
                    if glows:
                        _add_light(edits.turns, ray, path.beams, count, changes)
                    _add_edits(slopes, first, last, edits, changes)
                    red, green, blue = changes[0], changes[1], changes[2]
                    for edit in range(np.uint64(start), np.uint64(end)):
                        squares[edit] += red[edit] ** 2 + green[edit] ** 2 + blue[edit] ** 2
        # One more behind the last bin, for what is above it by nothing.
        gradients[n] = gradient[:TF_SAMPLES]
        energies[n] = energy


@inlined
def _look(medium, colors, light, glow, ray, levels, staging, path, image):
    """Composite front to back, recording what is needed to go back."""
    image[:] = ZERO
    through = without_one = ONE
    glows = len(glow.grid) > 0
    k = 0
    while k < ray.count and without_one > NEGLIGIBLE:
        fetch(medium, ray, k, levels, staging)
        first = k
        for m in range(min(ray.count - first, len(levels))):
            path.levels[k] = levels[m]
            level = np.uint64(np.uint32(levels[m]))
            a = medium.alphas[level]
            if k == ray.count - 1:
                a = opacity_of_part(a, ray.rest)
            path.clear[k] = through
            at = np.uint64(4) * (level % np.uint64(ENTRIES))
            path.colors[k, 0] = colors[at]
            path.colors[k, 1] = colors[at + np.uint64(1)]
            path.colors[k, 2] = colors[at + np.uint64(2)]
            weight = through * a
            path.weights[k] = weight
            without_one = max(without_one * (ONE - a), through)
            through -= weight
            k += 1
        # A loop for each light: a test at each sample would take a sixth longer. Samples behind
        # an opaque one are lit, too, as its derivative depends on them.
        if light.shines:
            for n in range(np.uint64(first), np.uint64(k)):
                t = min(np.float32(np.int64(n)), ray.last)
                d, s = reflect(medium, light, ray, t)
                for channel in range(3):
                    path.colors[n, channel] = d * path.colors[n, channel] + s
        elif glows:
            for n in range(np.uint64(first), np.uint64(k)):
                d = received(glow, ray, min(np.float32(np.int64(n)), ray.last))
                for channel in range(3):
                    path.beams[n, channel] = path.weights[n] * path.colors[n, channel]
                    path.colors[n, channel] *= d
        red, green, blue = image[0], image[1], image[2]
        for n in range(np.uint64(first), np.uint64(k)):
            red += path.weights[n] * path.colors[n, 0]
            green += path.weights[n] * path.colors[n, 1]
            blue += path.weights[n] * path.colors[n, 2]
        image[0], image[1], image[2] = red, green, blue
    return k


@inlined
def _slopes_by_bin(medium, fading, least, ray, path, count, slopes):
    """Add a pixel's derivative to zeros (257, 3); return the first and the last bin."""
    red = green = blue = ZERO
    first: Any = TF_SAMPLES
    last: Any = 0
    for k in range(count - 1, -1, -1):
        if len(medium.missing) > 0 and path.levels[k] == NOTHING:
            continue
        level = np.uint64(np.uint32(path.levels[k]))
        a, through = medium.alphas[level], path.clear[k]
        over_red = path.colors[k, 0] - red
        over_green = path.colors[k, 1] - green
        over_blue = path.colors[k, 2] - blue
        part = through
        if k == ray.count - 1:
            part *= slope_of_part(a, ray.rest, least)
            a = opacity_of_part(a, ray.rest)
        red += a * over_red
        green += a * over_green
        blue += a * over_blue
        table = level // np.uint64(ENTRIES)
        level %= np.uint64(ENTRIES)
        lower = level // np.uint64(LEVELS_PER_BIN)
        first, last = min(first, np.int64(lower)), max(last, np.int64(lower))
        share = np.float32(np.int32(level % np.uint64(LEVELS_PER_BIN)))
        upper = share / np.float32(LEVELS_PER_BIN) * part
        below = part - upper
        if len(fading) > 0:
            at = np.uint64(TF_SAMPLES) * table + lower
            below *= fading[at]
            upper *= fading[at + np.uint64(1)]
        # There is one bin more than the TF has, for samples exactly at its last bin.
        slopes[lower, 0] += below * over_red
        slopes[lower, 1] += below * over_green
        slopes[lower, 2] += below * over_blue
        slopes[lower + np.uint64(1), 0] += upper * over_red
        slopes[lower + np.uint64(1), 1] += upper * over_green
        slopes[lower + np.uint64(1), 2] += upper * over_blue
    return first, last + 1


@inlined
def _add_edits(slopes, first, last, edits, changes):
    """Add a pixel's change by each edit, and clear its derivative."""
    last = min(last, TF_SAMPLES - 1)
    # Not the constant: unrolled, the loop is not vectorized.
    flat, width = edits.by_bin.ravel(), np.uint64(edits.by_bin.shape[1])
    red, green, blue = changes[0], changes[1], changes[2]
    for bin_ in range(first, last + 1):
        row, at = np.uint64(bin_ * BAND), np.uint64(edits.begin[bin_])
        r, g, b = slopes[bin_, 0], slopes[bin_, 1], slopes[bin_, 2]
        slopes[bin_, 0] = slopes[bin_, 1] = slopes[bin_, 2] = ZERO
        for m in range(width):
            weight = flat[row + m]
            red[at + m] += r * weight
            green[at + m] += g * weight
            blue[at + m] += b * weight


@inlined
def _add_to_nodes(glow, ray, beams, count, image, nodes):
    """Add the derivative by samples' light to the nodes that it is interpolated between."""
    for k in range(count):
        weight = beams[k, 0] * image[0] + beams[k, 1] * image[1] + beams[k, 2] * image[2]
        if weight != ZERO:
            place, weights = light_place(glow, ray, min(np.float32(k), ray.last))
            for corner in range(8):
                at, share = corner_of(glow, place, weights, corner)
                nodes[at] += share * weight


@inlined
def _add_light(turns, ray, beams, count, changes):
    """Add the change of a pixel's soft light by each edit, cell by cell of the light's grid."""
    around = np.zeros((8, 3), dtype=np.float32)
    before, is_lit = np.uint64(0), False
    for k in range(count):
        red, green, blue = beams[k, 0], beams[k, 1], beams[k, 2]
        if red + green + blue <= ZERO:
            continue
        place, weights = light_place(turns, ray, min(np.float32(k), ray.last))
        if is_lit and place != before:
            _add_cell(turns, before, around, changes)
        before, is_lit = place, True
        for corner in range(8):
            _, share = corner_of(turns, place, weights, corner)
            around[corner, 0] += share * red
            around[corner, 1] += share * green
            around[corner, 2] += share * blue
    if is_lit:
        _add_cell(turns, before, around, changes)


@inlined
def _add_cell(turns, place, around, changes):
    """Add the change by the light at a cell's corners, and clear their weights."""
    for corner in range(8):
        at, _ = corner_of(turns, place, (ZERO, ZERO, ZERO), corner)
        r, g, b = around[corner, 0], around[corner, 1], around[corner, 2]
        around[corner, 0] = around[corner, 1] = around[corner, 2] = ZERO
        for edit in range(changes.shape[1]):
            turn = turns.grid[at, edit]
            changes[0, edit] += r * turn
            changes[1, edit] += g * turn
            changes[2, edit] += b * turn
