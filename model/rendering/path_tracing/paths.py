"""Paths of light to a pixel, one per sample.

The first collision is drawn from the ray caster's samples along the view ray, so a pixel's opacity
is exact and every path has a collision. Paths go on by delta tracking; at each collision, light
that comes directly from the lamp or sky is added.

Light takes on a colour at the first collision only; further ones are grey. Thin and broken pieces
thus have the hue of their TF, no neighbour tints them, and the legend is right.
"""

from __future__ import annotations

import math

import numpy as np

from model.compilation import compiled, inlined
from model.rendering.path_tracing.estimate import LEAST
from model.rendering.path_tracing.random_numbers import joined, number_of, spread
from model.rendering.path_tracing.scattering import TWO, about, phase, phase_cosine, surface_at
from model.rendering.path_tracing.tracking import CLEAREST, track
from model.rendering.raycast.batch import BATCH, HALF, fetch, stack_batch
from model.rendering.raycast.classification import ENTRIES
from model.rendering.raycast.compositing import GROUP
from model.rendering.raycast.rays import ONE, ZERO, dot, make_ray, next_visible, place_on
from model.rendering.raycast.trilinear import clamp

CERTAIN = 2  # collisions after which paths may end at random, the darker the likelier


@compiled
def trace_rows(scatterer, optics, camera, step, close, opacity, place, tile, samples, seed, sums):
    """Add some samples to each pixel of a tile."""
    width = opacity.shape[1]
    medium = scatterer.medium
    levels, staging = stack_batch(medium.voxels, GROUP * BATCH if close else BATCH)
    count = samples[1] - samples[0]
    targets, order = np.empty(count, np.float32), np.empty(count, np.int32)
    hits, places = np.empty(count, np.int32), np.empty(count, np.float32)
    for row in range(tile[0], tile[1]):
        for column in range(tile[2], tile[3]):
            a = opacity[row, column, 0]
            if a < LEAST:
                continue
            number = (place[1] + row) * place[2] + place[0] + column
            for n in range(count):
                sample = samples[0] + n
                pixel = _stream(seed, number, sample)
                _insert(targets, order, n, ONE - spread(pixel, sample >> 1, 0) * a)
            ray, _ = make_ray(camera, step, column, row, width)
            _collide(medium, ray, targets, order, levels, staging, hits, places)
            for n in range(count):
                sample, t = samples[0] + n, places[n]
                if hits[n] < 0:
                    continue
                away = (
                    np.float32(ray.step[0] / (optics.slope[0] * step)),
                    np.float32(ray.step[1] / (optics.slope[1] * step)),
                    np.float32(ray.step[2] / (optics.slope[2] * step)),
                )
                stream, at = _stream(seed, number, sample), place_on(ray, t)
                r, g, b = _radiance(scatterer, optics, stream, sample >> 1, hits[n], at, away)
                sums[sample & 1, row, column, 0] += a * r
                sums[sample & 1, row, column, 1] += a * g
                sums[sample & 1, row, column, 2] += a * b


@inlined
def _stream(seed, number, sample):
    """Return the stream of random numbers of a pixel's even, or odd, samples."""
    half = sample & 1
    return joined(joined(seed * 2 + half, number & 0xFFFFFFFF), number >> 32)


@inlined
def _insert(targets, order, n, target):
    """Insert the target of the n-th sample among those before it, the greatest first."""
    place = n
    while place > 0 and targets[place - 1] < target:
        targets[place], order[place] = targets[place - 1], order[place - 1]
        place -= 1
    targets[place], order[place] = target, n


@inlined
def _collide(medium, ray, targets, order, levels, staging, hits, places):
    """Find where the transmittance along a view ray falls to each of some targets.

    Within the step that belongs to a sample of the ray, the extinction is that sample's.
    """
    through = ONE
    last_level, last_t = np.int32(-1), ZERO
    found = 0
    k = 0
    while True:
        k = next_visible(medium, ray, k)
        if k >= ray.count:
            break
        if len(levels) > BATCH:
            # The samples at which the volume is read must not depend on what was skipped.
            k -= k % GROUP
        fetch(medium, ray, k, levels, staging)
        for m in range(min(len(levels), ray.count - k)):
            level = levels[m]
            clear = ONE - medium.alphas[np.uint64(np.uint32(level))]
            # Transparent, or so faint that float32 gives a logarithm of 0.
            if clear >= ONE:
                continue
            length = ray.rest if k + m == ray.count - 1 else ONE
            left = through * (clear if length == ONE else clear**length)
            begin = np.float32(k + m) - ONE
            while left <= targets[found]:
                share = math.log(targets[found] / through) / math.log(max(clear, CLEAREST))
                hits[order[found]] = level
                places[order[found]] = begin + np.float32(min(max(share, 0.0), length))
                found += 1
                if found == len(targets):
                    return
            through = left
            last_level, last_t = level, begin + length
        k += len(levels)
    # By rounding, the transmittance of all samples may be slightly above the target.
    for n in range(found, len(targets)):
        hits[order[n]], places[order[n]] = last_level, last_t


@inlined
def _radiance(scatterer, optics, pixel, index, level, place, direction):
    """Return the light that one path brings from its first collision: red, green and blue."""
    # Light coloured by the first collision, mirrored there without colour, and from the later path.
    colored, white, rest = ZERO, ZERO, ZERO
    cr, cg, cb = ZERO, ZERO, ZERO
    mirrors = False
    left = ONE
    (x, y, z), shape = place, scatterer.medium.shape
    for bounce in range(optics.bounces):
        x, y, z = clamp(x, shape[0]), clamp(y, shape[1]), clamp(z, shape[2])
        stream = joined(joined(pixel, 1000 + bounce), index)
        if bounce == 0:
            kind = spread(pixel, index, 1)
            u, v = spread(pixel, index, 2), spread(pixel, index, 3)
            p, q = spread(pixel, index, 4), spread(pixel, index, 5)
        else:
            kind = number_of(joined(stream, 1))
            u, v = number_of(joined(stream, 2)), number_of(joined(stream, 3))
            p, q = number_of(joined(stream, 4)), number_of(joined(stream, 5))
        entry = np.uint64(np.uint32(level))
        is_surface, normal = surface_at(
            scatterer, optics, x, y, z, direction, optics.solid[entry], kind
        )
        entry = np.uint64(4) * (entry % np.uint64(ENTRIES))
        table = optics.surfaces if is_surface else optics.media
        light = about(optics.towards, ONE - u * (ONE - optics.cone), v)
        glossy, shown = ZERO, ZERO
        if is_surface:
            twice = TWO * dot(normal, direction)
            mirrored = (
                direction[0] - twice * normal[0],
                direction[1] - twice * normal[1],
                direction[2] - twice * normal[2],
            )
            facing = dot(normal, light)
            if facing > ZERO:
                shown = (ONE - optics.gloss) * facing
                along = dot(mirrored, light)
                if along > ZERO:
                    lobe = HALF * (optics.power + ONE) * along**optics.power
                    glossy = optics.gloss * lobe
        else:
            mirrored = direction
            shown = phase(dot(direction, light), optics.asymmetry)
        share = ONE
        if bounce > 0:
            share = table[entry + np.uint64(3)]
        else:
            cr, cg, cb = table[entry], table[entry + np.uint64(1)], table[entry + np.uint64(2)]
        if shown + glossy > ZERO:
            _, _, through = track(scatterer, (x, y, z), light, joined(stream, 6), True)
            through *= optics.key
            if bounce > 0:
                rest += left * through * (share * shown + glossy)
            else:
                colored = through * shown
                white = through * glossy
        choice = number_of(joined(stream, 7))
        if is_surface and choice < optics.gloss:
            direction = about(mirrored, p ** (ONE / (optics.power + ONE)), q)
            mirrors |= bounce == 0
        else:
            if is_surface:
                direction = about(normal, math.sqrt(p), q)
            else:
                direction = about(direction, phase_cosine(p, optics.asymmetry), q)
            left *= share
        if bounce >= CERTAIN and left < ONE:
            if number_of(joined(stream, 8)) >= left:
                break
            left = ONE
        level, t, _ = track(scatterer, (x, y, z), direction, joined(stream, 9), False)
        if level < 0:
            rest += left * optics.sky
            break
        x += t * direction[0] * scatterer.scaling[0]
        y += t * direction[1] * scatterer.scaling[1]
        z += t * direction[2] * scatterer.scaling[2]
    if mirrors:
        white += rest
    else:
        colored += rest
    return cr * colored + white, cg * colored + white, cb * colored + white
