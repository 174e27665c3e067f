"""Marching through a coarse volume: images for tables over mean and spread, and derivatives.

A table has a premultiplied RGBA, here called an entry, for each pair of mean and spread. A
pixel is P = sum of T_i e_i with T_{i+1} = T_i (1 - a_i), e_i being the entry of sample i and
a_i its opacity. Its exact derivatives are

- backward, for a gradient g of the pixel: T_i (g - (0, 0, 0, g . B_{i+1})) for e_i, where
  B_i = e_i + (1 - a_i) B_{i+1} is composited back to front;
- forward, for changes de_i of the entries: the sum of T_i de_i + dT_i e_i, where
  dT_{i+1} = dT_i (1 - a_i) - T_i da_i.

There is no division by 1 - a_i, so that both also hold at opaque samples.

The last sample, whose step is shorter, counts as its entry times the step's share of a whole
one: that is linear in the table, and the ray caster's power only for faint entries.

Under light a second image is composited of the entries under that light: (d r + s a,
d g + s a, d b + s a, a), with a diffuse factor d and a gloss s that count as constant.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from model.compilation import compiled, inlined
from model.networks.refined.coarse_volume import SPREADS
from model.rendering.raycast.batch import BATCH, one_by_one, stack_batch
from model.rendering.raycast.compositing import GROUP, composite_group
from model.rendering.raycast.marching import (
    FAINT,
    FULL,
    ONE,
    SHARED,
    ZERO,
    make_ray,
    shade,
    skip_empty,
)
from model.rendering.raycast.trilinear import load_pair, locate

SUBLEVELS = 2
"""Levels of the mean between two bins of a TF."""

LEVELS = 255 * SUBLEVELS + 1
ENTRIES = SPREADS * LEVELS
"""Entries of a table, one level of spread after another; one more, behind the exit, is 0."""

NEGLIGIBLE = np.float32(1e-6)
"""Transparency below which further samples are neglected."""

BYTE = np.uint32(255)
EIGHT, SIXTEEN, LAST = np.uint32(8), np.uint32(16), np.uint32(24)


@inlined
def _find_entries(nodes: Any, shape: Any, ray: Any, k: int, entries: Any, staging: Any) -> None:
    """Find the entries of a batch of samples, starting with sample k.

    Parameters
    ----------
    nodes : ndarray of uint16, 1-D
        Mean in the lower byte, spread in the upper one, in steps of 1/255 and 1/510 of the
        scalar range; x fastest.
    """
    first, last = np.float32(k), np.float32(ray.count - 1)
    for m in range(BATCH):
        t = min(first + np.float32(np.int32(m)), ray.last)
        x = ray.start[0] + t * ray.step[0]
        y = ray.start[1] + t * ray.step[1]
        z = ray.start[2] + t * ray.step[2]
        staging.place[m], staging.x[m], staging.y[m], staging.z[m] = locate(shape, x, y, z)
    row, layer = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    for m in range(BATCH):
        one_by_one()
        place = staging.place[m]
        staging.near[m] = load_pair(nodes, place)
        staging.above[m] = load_pair(nodes, place + row)
        staging.behind[m] = load_pair(nodes, place + layer)
        staging.both[m] = load_pair(nodes, place + layer + row)
    for m in range(BATCH):
        fx, fy, fz = staging.x[m], staging.y[m], staging.z[m]
        mean0, spread0 = _along_x(staging.near[m], fx)
        mean1, spread1 = _along_x(staging.above[m], fx)
        mean2, spread2 = _along_x(staging.behind[m], fx)
        mean3, spread3 = _along_x(staging.both[m], fx)
        mean = _bilinear(mean0, mean1, mean2, mean3, fy, fz)
        spread = _bilinear(spread0, spread1, spread2, spread3, fy, fz)
        level = np.int32(
            min(max(mean, ZERO), np.float32(255)) * np.float32(SUBLEVELS) + np.float32(0.5)
        )
        deviation = np.int32(math.sqrt(max(spread, ZERO)) + np.float32(0.5))
        entry = np.int32(deviation * np.int32(LEVELS) + level)
        behind = first + np.float32(np.int32(m)) > last
        entries[m] = np.int32(ENTRIES) if behind else entry


@inlined
def _along_x(pair: Any, fx: Any) -> Any:
    """Mean and spread between two nodes."""
    mean0 = np.float32(np.int32(pair & BYTE))
    spread0 = np.float32(np.int32((pair >> EIGHT) & BYTE))
    mean1 = np.float32(np.int32((pair >> SIXTEEN) & BYTE))
    spread1 = np.float32(np.int32(pair >> LAST))
    return mean0 + fx * (mean1 - mean0), spread0 + fx * (spread1 - spread0)


@inlined
def _bilinear(v0: Any, v1: Any, v2: Any, v3: Any, fy: Any, fz: Any) -> Any:
    near = v0 + fy * (v1 - v0)
    return near + fz * (v2 + fy * (v3 - v2) - near)


@compiled
def draw(
    nodes: Any,
    means: Any,
    shape: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    table: Any,
    opacities: Any,
    light: Any,
    glow: Any,
    camera: Any,
    step: float,
    opaque: Any,
    rows: Any,
    images: Any,
) -> None:
    """Draw some rows of the unlit image and, under light, of the lit one behind it.

    Parameters
    ----------
    nodes : ndarray of uint16, 1-D
        Mean in the lower byte, spread in the upper one; x fastest.
    means : ndarray of uint8, 1-D
        The same means, for their gradient; only used under light.
    shape, cells, cell_shape, shift, light, glow, opaque
        See :func:`model.rendering.raycast.marching.march`.
    table : ndarray of float32, shape (4 (ENTRIES + 1),)
    opacities : ndarray of float32, shape (ENTRIES + 1,)
        The table's.
    camera, step
        See :func:`model.rendering.raycast.marching.make_ray`.
    rows : tuple of int
        First row, and the row after the last.
    images : ndarray of float32, shape (1 or 2, size, size, 4)
        Output.
    """
    size = images.shape[1]
    entries, staging, total = stack_batch(nodes)
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, _ = make_ray(camera, step, column, row, size)
            total[0] = total[1] = total[2] = total[3] = ZERO
            red = green = blue = ZERO
            d, s = ONE, ZERO
            shared = 0
            through = ONE
            end = np.int32(ENTRIES)
            k = 0
            while k < ray.count and through >= opaque:
                behind = skip_empty(ray, k, cells, cell_shape, shift)
                if behind > k:
                    k = behind
                    continue
                _find_entries(nodes, shape, ray, k, entries, staging)
                if ray.count - k <= BATCH:
                    end = entries[ray.count - 1 - k]
                    entries[ray.count - 1 - k] = np.int32(ENTRIES)
                if light is not None or glow is not None:
                    clear = through
                    for m in range(BATCH):
                        at = np.uint64(4) * np.uint64(np.uint32(entries[m]))
                        a = table[at + np.uint64(3)]
                        if clear * a > FAINT:
                            if shared == 0 or clear * a > FULL:
                                d, s = shade(means, shape, light, glow, ray, np.float32(k + m))
                                shared = SHARED
                            else:
                                shared -= 1
                            red += clear * (d * table[at] + s * a)
                            green += clear * (d * table[at + np.uint64(1)] + s * a)
                            blue += clear * (d * table[at + np.uint64(2)] + s * a)
                        clear *= ONE - a
                for m in range(0, BATCH, GROUP):
                    through = composite_group(table, opacities, entries, m, total, through)
                k += BATCH
            through *= ray.rest
            at = np.uint64(4) * np.uint64(np.uint32(end))
            a = table[at + np.uint64(3)]
            for channel in range(4):
                images[0, row, column, channel] = (
                    total[channel] + through * table[at + np.uint64(channel)]
                )
            if light is not None or glow is not None:
                lit = images[1, row, column]
                if through * a > FAINT:
                    d, s = shade(means, shape, light, glow, ray, ray.last)
                    red += through * (d * table[at] + s * a)
                    green += through * (d * table[at + np.uint64(1)] + s * a)
                    blue += through * (d * table[at + np.uint64(2)] + s * a)
                lit[0], lit[1], lit[2], lit[3] = red, green, blue, images[0, row, column, 3]


@compiled
def pull_back(
    nodes: Any,
    means: Any,
    shape: Any,
    table: Any,
    light: Any,
    glow: Any,
    camera: Any,
    step: float,
    longest: int,
    rows: Any,
    gradients: Any,
    out: Any,
) -> None:
    """Vector-Jacobian product: add what some rows of the images contribute to each entry.

    Parameters
    ----------
    longest : int
        Upper limit of the number of samples along a ray.
    gradients : ndarray of float32, shape (1 or 2, size, size, 4)
        By the images' pixels.
    out : ndarray of float64, shape (ENTRIES + 1, 4)
        Gradient by the entries; added to.
    """
    size = gradients.shape[1]
    entries, staging, _ = stack_batch(nodes)
    path = np.empty(longest + BATCH, dtype=np.int32)
    clear = np.empty(longest + BATCH, dtype=np.float32)
    for row in range(rows[0], rows[1]):
        for column in range(size):
            if not gradients[:, row, column].any():
                continue
            g = gradients[0, row, column]
            ray, _ = make_ray(camera, step, column, row, size)
            count = 0
            through = ONE
            while count < ray.count and through > NEGLIGIBLE:
                _find_entries(nodes, shape, ray, count, entries, staging)
                for m in range(min(BATCH, ray.count - count)):
                    path[count] = entries[m]
                    clear[count] = through
                    through *= ONE - table[np.uint64(4 * entries[m] + 3)]
                    count += 1
            behind = ZERO
            for k in range(count - 1, -1, -1):
                entry = np.uint64(np.uint32(path[k]))
                at = np.uint64(4) * entry
                r, green, b = table[at], table[at + np.uint64(1)], table[at + np.uint64(2)]
                share = ray.rest if k == ray.count - 1 else ONE
                a, t = table[at + np.uint64(3)], share * clear[k]
                red_weight, green_weight, blue_weight, weight = g[0], g[1], g[2], g[3]
                if light is not None or glow is not None:
                    h = gradients[1, row, column]
                    d, s = shade(means, shape, light, glow, ray, np.float32(k))
                    red_weight += d * h[0]
                    green_weight += d * h[1]
                    blue_weight += d * h[2]
                    weight += h[3] + s * (h[0] + h[1] + h[2])
                out[entry, 0] += t * red_weight
                out[entry, 1] += t * green_weight
                out[entry, 2] += t * blue_weight
                out[entry, 3] += t * (weight - behind)
                color = r * red_weight + green * green_weight + b * blue_weight
                behind += share * (color + a * (weight - behind))


@compiled
def push_forward(
    nodes: Any,
    means: Any,
    shape: Any,
    table: Any,
    changes: Any,
    light: Any,
    glow: Any,
    camera: Any,
    step: float,
    rows: Any,
    images: Any,
) -> None:
    """Jacobian-vector product: changes of some rows of the images.

    Parameters
    ----------
    changes : ndarray of float32, shape (4 (ENTRIES + 1),)
        Of the table.
    images : ndarray of float32, shape (1 or 2, size, size, 4)
        Output: changes of the images.
    """
    size = images.shape[1]
    entries, staging, _ = stack_batch(nodes)
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, _ = make_ray(camera, step, column, row, size)
            for image in range(len(images)):
                for channel in range(4):
                    images[image, row, column, channel] = ZERO
            through, change = ONE, ZERO
            k = 0
            while k < ray.count and (through > NEGLIGIBLE or abs(change) > NEGLIGIBLE):
                _find_entries(nodes, shape, ray, k, entries, staging)
                for m in range(min(BATCH, ray.count - k)):
                    at = np.uint64(4) * np.uint64(np.uint32(entries[m]))
                    if k + m == ray.count - 1:
                        through *= ray.rest
                        change *= ray.rest
                    a, da = table[at + np.uint64(3)], changes[at + np.uint64(3)]
                    for channel in range(4):
                        e, de = table[at + np.uint64(channel)], changes[at + np.uint64(channel)]
                        images[0, row, column, channel] += through * de + change * e
                    if light is not None or glow is not None:
                        d, s = shade(means, shape, light, glow, ray, np.float32(k + m))
                        for channel in range(3):
                            e = d * table[at + np.uint64(channel)] + s * a
                            de = d * changes[at + np.uint64(channel)] + s * da
                            images[1, row, column, channel] += through * de + change * e
                        images[1, row, column, 3] += through * da + change * a
                    change = change * (ONE - a) - through * da
                    through *= ONE - a
                k += BATCH
