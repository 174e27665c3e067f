"""Extinctions and opacities that are nearly nothing: paths end somewhere all the same.

Where a position were no number, memory outside the volume would be read.
"""

import numpy as np

from model.compilation import compiled
from model.rendering.path_tracing.paths import _collide
from model.rendering.path_tracing.random_numbers import following, hashed, number_of
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.path_tracing.tracking import track
from model.rendering.raster import Raster
from model.rendering.raycast.batch import BATCH, stack_batch
from model.rendering.raycast.rays import camera_array, make_ray
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

LENGTH = 20


def scene(faint):
    """A block of two values: of one next to nothing is seen, the other is half opaque."""
    voxels = np.zeros((LENGTH, LENGTH, LENGTH), np.uint8)
    voxels[..., LENGTH // 2 :] = 255
    opacity = OpacityTF((0.0, 255.0), points=((0.0, faint), (254.0, faint), (255.0, 0.5)))
    color = ColorTF((0.0, 255.0), ((0.0, 0.8, 0.8, 0.8), (255.0, 0.8, 0.8, 0.8)))
    return Volume(voxels), SceneInputs(View(-90.0, 0.0, 0.0, 0.5), opacity, color)


@compiled
def collide(scatterer, camera, step, size, target):
    """Collide along the ray through the middle of an image."""
    levels, staging = stack_batch(scatterer.medium.voxels, BATCH)
    ray, _ = make_ray(camera, step, size // 2, size // 2, size)
    targets, order = np.full(1, target, np.float32), np.zeros(1, np.int32)
    hits, places = np.empty(1, np.int32), np.empty(1, np.float32)
    _collide(scatterer.medium, ray, targets, order, levels, staging, hits, places)
    return hits[0], places[0]


@compiled
def tracked(medium, place, direction, state, transmits):
    """Call what is always inlined."""
    return track(medium, place, direction, state, transmits)


def test_a_path_without_depth_leaves_a_medium_of_next_to_no_extinction():
    volume, inputs = scene(1e-41)
    tracer = PathTracer(volume, threads=1)
    scatterer = tracer._scatterer(inputs, 0.5)
    tracer.close()
    # Its reciprocal is infinite.
    assert 0 < scatterer.majorants[scatterer.majorants > 0].min() < 1e-39
    # The only state below 2^26 whose number is 0.
    nothing = np.uint32(7189834)
    assert number_of(hashed(following(nothing))) == 0
    place = tuple(map(np.float32, (2.0, 10.0, 10.0)))
    away = tuple(map(np.float32, (-1.0, 0.0, 0.0)))
    for transmits in (False, True):
        level, t, through = tracked(scatterer, place, away, nothing, transmits)
        assert (level, t, through) == (-1, 2.0, 1.0)


def test_light_collides_with_nothing_that_is_too_faint_to_count():
    volume, inputs = scene(1e-9)
    tracer = PathTracer(volume, threads=1)
    scatterer = tracer._scatterer(inputs, 0.5)
    tracer.close()
    assert 0 < scatterer.medium.alphas[0] < 1e-8
    camera = camera_array(inputs.view, volume, Raster(9, 9))
    for target in (1.0, 0.9, 0.5, 0.0):
        level, t = collide(scatterer, camera, 0.5, 9, np.float32(target))
        assert np.isfinite(t)
        # Behind the faint half, in steps of half a voxel.
        assert level > 0 and t > LENGTH / 2 - 2
