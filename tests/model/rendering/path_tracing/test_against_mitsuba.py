"""Media of changing extinction and albedo, against pictures that Mitsuba 3 has drawn."""

import math

import numpy as np
import pytest
from mitsuba_scenes import SCENES, SIZE, stored

from model.rendering.path_tracing.renderer import PathTracer

SEEDS, SAMPLES = 24, 32

CLOSE = 0.05
"""Distance of samples along view rays in voxels: where Mitsuba's rays collide is continuous."""

UNSEEN = 1e-3
"""A quarter of an 8-bit step: pixels of less opacity are not traced."""


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES, ids=[scene.name for scene in SCENES])
def test_pixels_are_within_three_standard_errors_of_mitsubas(scene):
    theirs, their_error = stored(scene.name)
    pictures = []
    for seed in range(SEEDS):
        tracer = PathTracer(scene.volume, scene.light, CLOSE, seed=seed, lamp=scene.lamp)
        *_, last = tracer.refine(scene.inputs, SIZE, SAMPLES)
        tracer.close()
        assert np.array_equal(last.radiance[..., 0], last.radiance[..., 1])
        pictures.append(last.radiance[..., 0].astype(np.float64))
    ours = np.mean(pictures, axis=0)
    our_error = np.std(pictures, axis=0, ddof=1) / math.sqrt(SEEDS)
    error = np.hypot(our_error, their_error)
    drawn = error > 0
    assert drawn.mean() > 0.25
    off = np.abs(ours - theirs)[drawn]
    assert np.mean(off <= 3 * error[drawn] + UNSEEN) >= 0.99
    assert abs((ours - theirs).sum() / theirs.sum()) < 0.005
    assert np.abs(ours - theirs)[~drawn].max(initial=0) < UNSEEN
