"""The path tracer: against closed forms, quadrature, and the ray caster's opacities."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from model.compilation import compiled
from model.rendering.path_tracing import renderer
from model.rendering.path_tracing.random_numbers import following, hashed, number_of
from model.rendering.path_tracing.renderer import Lamp, PathTracer, questions
from model.rendering.path_tracing.tracking import track
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

SKY = Lamp(key=0.0, sky=1.0, bounces=1 << 20)
"""Even light from everywhere, scattered as often as it takes."""

VIEW = View(35.0, 25.0, 7.0, 0.7)
FACING = View(0.0, 0.0, 0.0, 0.7)
ANISOTROPIC = (1.0, 1.7, 0.6)


def homogeneous(opacity, color, n=12, spacing=(1.0, 1.0, 1.0)):
    """A block of some values that all look the same."""
    values = np.arange(n**3, dtype=np.float32).reshape(n, n, n) / (n**3 - 1)
    volume = Volume(values, spacing)
    lo, hi = volume.scalar_range
    opacity_tf = OpacityTF((lo, hi), points=((lo, opacity), (hi, opacity)))
    return volume, opacity_tf, ColorTF((lo, hi), ((lo, *color), (hi, *color)))


def balls(dtype, spacing=(1.0, 1.0, 1.0), missing=False):
    """Some soft balls of different values."""
    rng = np.random.default_rng(5)
    shape = (26, 22, 30)
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    field = np.zeros(shape)
    for middle, radius, value in zip(
        rng.uniform(0, shape, (9, 3)), rng.uniform(3, 8, 9), rng.uniform(60, 255, 9), strict=True
    ):
        distance = np.linalg.norm(places - middle, axis=-1)
        field = np.maximum(field, value * np.clip(1.5 - distance / radius, 0, 1))
    factor = {"uint8": 1.0, "float32": 1e-3}[dtype]
    values = (np.clip(field, 0, 255) * factor).astype(dtype)
    hidden = None
    if missing:
        hidden = np.zeros(shape, dtype=bool)
        hidden[8:16, 4:12, 9:20] = True
    return Volume(values, spacing, missing=hidden)


def seen(volume, view=VIEW, **others):
    """Half-transparent balls of many colours."""
    lo, hi = volume.scalar_range
    width = hi - lo
    opacity = OpacityTF(
        (lo, hi), points=((lo + 0.15 * width, 0.0), (lo + 0.3 * width, 0.15), (hi, 0.6))
    )
    color = ColorTF((lo, hi), ((lo, 1.0, 0.5, 0.2), (lo + width / 2, 0.3, 0.9, 0.4), (hi, 1, 1, 1)))
    return SceneInputs(view, opacity, color, **others)


def traced(volume, inputs, size=24, samples=8, **others):
    tracer = PathTracer(volume, **others)
    try:
        return tracer.render(inputs, size, samples=samples)
    finally:
        tracer.close()


@pytest.mark.parametrize(
    "asymmetry", [0.0, *(pytest.param(each, marks=pytest.mark.slow) for each in (-0.5, 0.7))]
)
@pytest.mark.parametrize("opacity", [0.02, 0.97])
def test_white_under_an_even_sky_is_as_bright_as_the_sky(opacity, asymmetry):
    """The white furnace: with albedo 1 everywhere nothing is to be seen but the sky's light."""
    volume, opacity_tf, color_tf = homogeneous(opacity, (1.0, 1.0, 1.0))
    lamp = replace(SKY, asymmetry=asymmetry)
    image = traced(volume, SceneInputs(VIEW, opacity_tf, color_tf), 12, 2, lamp=lamp)
    assert image[..., 3].max() > min(5 * opacity, 0.9)
    for channel in range(3):
        np.testing.assert_allclose(image[..., channel], image[..., 3], atol=2e-3)


@pytest.mark.parametrize(("asymmetry", "error"), [(0.0, 0.035), (0.6, 0.08)])
def test_a_thick_evenly_lit_piece_has_the_color_of_its_tf(asymmetry, error):
    color = (0.2, 0.5, 0.85)
    volume, opacity_tf, color_tf = homogeneous(0.9, color, 24)
    lamp = replace(SKY, asymmetry=asymmetry, surfaces=False, bounces=4096)
    view = replace(FACING, distance=0.3)
    image = traced(volume, SceneInputs(view, opacity_tf, color_tf), 16, 64, lamp=lamp)
    middle = image[4:12, 4:12].mean(axis=(0, 1))
    np.testing.assert_allclose(middle, (*color, 1.0), atol=error)


@pytest.mark.parametrize("opacity", [0.01, 0.9])
@pytest.mark.parametrize("surfaces", [False, True])
def test_the_hue_is_that_of_the_tf_however_thin_a_piece_is(opacity, surfaces):
    """Red, green and blue are in the proportions of the TF, also where light scatters once."""
    color = np.array([0.9, 0.5, 0.15])
    volume, opacity_tf, color_tf = homogeneous(opacity, tuple(color))
    lamp = Lamp(gloss=0.0, surfaces=surfaces)
    image = traced(volume, SceneInputs(VIEW, opacity_tf, color_tf), 16, 16, lamp=lamp)
    light = image[..., :3].mean(axis=(0, 1)) / color
    assert light.min() > 0
    np.testing.assert_allclose(light / light[0], 1.0, atol=0.02)


def test_a_white_surface_that_faces_the_light_is_white_and_one_has_its_color():
    for color in ((1.0, 1.0, 1.0), (0.7, 0.4, 0.1)):
        volume, opacity_tf, color_tf = homogeneous(1.0, color, 24)
        lamp = Lamp(gloss=0.0)
        inputs = SceneInputs(FACING, opacity_tf, color_tf, light=LightDirection(0.0, 0.0))
        image = traced(volume, inputs, 16, 128, lamp=lamp)
        middle = image[6:10, 6:10].mean(axis=(0, 1))
        np.testing.assert_allclose(middle[:3], color, atol=0.05)


def through_middle(volume, view):
    """Places along the ray through the picture's middle, and their distances, in fine steps."""
    back = view.basis()[2]
    eye = np.array(volume.extent) / 2 + view.camera_distance(volume.radius) * back
    t = np.linspace(0, 4 * volume.radius, 4001)
    t = t + max(np.linalg.norm(eye) - 2 * volume.radius, 0)
    places = eye - t[:, None] * back
    inside = ((places >= 0) & (places <= volume.extent)).all(axis=1)
    return places[inside], t[inside]


def extinction_at(volume, opacity_tf, places):
    """Extinction per world length, interpolated as SciPy does; 0 outside."""
    indices = (places / np.array(volume.spacing)).T[::-1]
    values = map_coordinates(volume.voxels.astype(float), indices, order=1, cval=np.nan)
    opacity = opacity_tf(np.nan_to_num(values))
    sigma = -np.log1p(-np.minimum(opacity, 1 - 1e-9)) / volume.voxel_size
    return np.where(np.isnan(values), 0.0, sigma)


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), ANISOTROPIC])
def test_light_scattered_once_is_that_of_a_quadrature(spacing):
    """From a point-like light, without surfaces, in the picture's middle."""
    light = LightDirection(60.0, 20.0)
    volume = balls("float32", spacing)
    lo, hi = volume.scalar_range
    white = ColorTF((lo, hi), ((lo, 1.0, 1.0, 1.0), (hi, 1.0, 1.0, 1.0)))
    inputs = replace(seen(volume, light=light), color_tf=white)
    places, t = through_middle(volume, VIEW)
    step = t[1] - t[0]
    towards = np.array(light.towards()) @ VIEW.basis()
    sigma = extinction_at(volume, inputs.opacity_tf, places)
    apart = np.linspace(0, 2 * volume.radius, 801)[1:] - volume.radius / 800
    beyond = places[:, None] + apart[:, None] * towards
    depth = extinction_at(volume, inputs.opacity_tf, beyond.reshape(-1, 3))
    depth = depth.reshape(len(places), -1).sum(axis=1) * (2 * volume.radius / 800)
    own = (np.cumsum(sigma) - sigma / 2) * step
    expected = np.sum(sigma * np.exp(-own - depth)) * step / 4
    lamp = Lamp(key=1.0, sky=0.0, radius=0.01, surfaces=False, bounces=1)
    tracer = PathTracer(volume, lamp=lamp)
    raster = Raster(101, 101, 50, 50, 1, 1)
    # Finer than usual, as the quadrature is: what is compared is the light, not its step.
    image = tracer.render(inputs, raster, 0.05, 4096)
    tracer.close()
    assert image[0, 0, 0] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("case", ["cropped", "missing", "part"])
def test_opacity_is_the_ray_casters(case):
    volume = balls("float32" if case == "cropped" else "uint8", ANISOTROPIC, case == "missing")
    crop = CropBox((0.2, 0.0, 0.3), (1.0, 0.7, 1.0)) if case == "cropped" else None
    view = replace(VIEW, pan_x=0.1, pan_y=-0.2, distance=0.5)
    raster = Raster(40, 30, 7, 5, 20, 11) if case == "part" else Raster(32, 32)
    inputs = seen(volume, view, crop=crop)
    caster = RaycastRenderer(volume)
    expected = caster.render(inputs, raster)[..., 3]
    caster.close()
    image = traced(volume, inputs, raster, 4)
    np.testing.assert_allclose(image[..., 3], expected, atol=1 / 500)
    visible = expected > 0.05
    assert visible.any()
    assert (image[..., :3].max(axis=2)[visible] > 0).mean() > 0.99
    assert (image[..., :3][expected == 0] == 0).all()


def test_a_cut_face_is_lit_and_what_is_cut_away_casts_no_shadow():
    volume, opacity_tf, color_tf = homogeneous(1.0, (1.0, 1.0, 1.0), 24)
    light = LightDirection(0.0, 0.0)
    whole = SceneInputs(FACING, opacity_tf, color_tf, light=light)
    # FACING looks along +y.
    cut = replace(whole, crop=CropBox((0.0, 0.5, 0.0), (1.0, 1.0, 1.0)))
    lamp = Lamp(gloss=0.0)
    first, second = (traced(volume, i, 24, 64, lamp=lamp)[10:14, 10:14] for i in (whole, cut))
    np.testing.assert_allclose(second.mean(axis=(0, 1)), first.mean(axis=(0, 1)), atol=0.03)


def test_pictures_do_not_depend_on_threads_tiles_or_edits_without_effect(monkeypatch):
    volume = balls("uint8")
    inputs = seen(volume)
    image = traced(volume, inputs, Raster(40, 30), 13, threads=1)
    np.testing.assert_array_equal(traced(volume, inputs, Raster(40, 30), 13, threads=3), image)
    part = traced(volume, inputs, Raster(40, 30, 11, 9, 13, 17), 13)
    np.testing.assert_allclose(part, image[9:26, 11:24], atol=1e-5)
    other = traced(volume, inputs, Raster(40, 30), 13, seed=1)
    assert np.abs(other - image)[..., :3].max() > 0.05
    # Nor on how many samples are traced together.
    monkeypatch.setattr(renderer, "MOST_TOGETHER", 1)
    np.testing.assert_array_equal(traced(volume, inputs, Raster(40, 30), 13), image)


@pytest.mark.parametrize("samples", [1, 37])
def test_it_asks_as_often_as_it_says(samples):
    volume, asked = balls("uint8"), []
    tracer, raster = PathTracer(volume), Raster(300, 40)
    for _ in tracer.refine(seen(volume), raster, samples, lambda: not asked.append(1)):
        pass
    tracer.close()
    assert len(asked) == questions(raster, samples)


def test_the_same_random_numbers_while_a_tf_is_edited():
    """A small edit changes a picture by much less than another seed does."""
    volume = balls("uint8")
    inputs = seen(volume)
    lo, hi = volume.scalar_range
    points = tuple((x, y * 1.01) for x, y in inputs.opacity_tf.points)
    edited = replace(inputs, opacity_tf=OpacityTF((lo, hi), points=points))
    image, changed, other = (
        traced(volume, i, 32, 2, seed=seed) for i, seed in ((inputs, 0), (edited, 0), (inputs, 1))
    )
    by_edit, by_seed = (np.sqrt(np.mean((each - image) ** 2)) for each in (changed, other))
    assert by_edit < 0.4 * by_seed


def test_the_estimated_error_is_the_error():
    volume = balls("uint8")
    inputs = seen(volume)
    tracer = PathTracer(volume, seed=3)
    *_, truth = tracer.refine(inputs, 32, 2048)
    found = {e.samples: e for e in PathTracer(volume, seed=8).refine(inputs, 32, 64)}
    tracer.close()
    assert list(found) == [1, 2, 4, 8, 16, 32, 64]
    assert math.isinf(found[1].error)
    for samples in (4, 8, 16, 32, 64):
        error = np.sqrt(np.mean((found[samples].rgba - truth.rgba)[..., :3] ** 2))
        assert found[samples].error / 1.5 < error < found[samples].error * 1.5
    assert found[64].error < found[8].error / 2


LENGTH = 20


def faint_block(faint):
    """A block of two values: of one next to nothing is seen, the other is half opaque."""
    voxels = np.zeros((LENGTH, LENGTH, LENGTH), np.uint8)
    voxels[..., LENGTH // 2 :] = 255
    opacity = OpacityTF((0.0, 255.0), points=((0.0, faint), (254.0, faint), (255.0, 0.5)))
    color = ColorTF((0.0, 255.0), ((0.0, 0.8, 0.8, 0.8), (255.0, 0.8, 0.8, 0.8)))
    return Volume(voxels), SceneInputs(View(-90.0, 0.0, 0.0, 0.5), opacity, color)


@compiled
def tracked(medium, place, direction, state, transmits):
    """Call what is always inlined."""
    return track(medium, place, direction, state, transmits)


def test_a_path_without_depth_leaves_a_medium_of_next_to_no_extinction():
    volume, inputs = faint_block(1e-41)
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
