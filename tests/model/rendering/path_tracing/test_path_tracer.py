"""The path tracer: against closed forms, quadrature, the ray caster's opacities, and Mitsuba 3.

Mitsuba has no surfaces that depend on a gradient, so its scenes hold media alone, in grey colours
bright enough that all collisions keep the same share. It drew them (3.9.1, ``volpath`` of depth 64,
variant ``llvm_ad_rgb``) into `mitsuba_pictures`, 32 times with 512 samples of a pixel: mean and
standard error of each pixel. Its medium fills a box of the volume's extent, by grids of ten cells
along a voxel, at whose middles NumPy and SciPy found the extinction per voxel size, -log(1 - a),
and the colour's albedo. A ``constant`` emitter is the sky, a ``directional`` one of irradiance pi
times the lamp's is the light. Rays go through the middles of the pixels.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from model.compilation import compiled
from model.rendering import vtk_renderer
from model.rendering.path_tracing import renderer
from model.rendering.path_tracing.random_numbers import following, hashed, number_of
from model.rendering.path_tracing.renderer import Lamp, PathTracer
from model.rendering.path_tracing.tracking import track
from model.rendering.raster import Raster
from model.rendering.raycast import renderer as raycast
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.rendering.scalars import blurred
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
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


def soft_balls(shape, middles, radii, values):
    """Values from 0 to 255 (nz, ny, nx) of the brightest of some balls with soft rims."""
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    field = np.zeros(shape)
    for middle, radius, value in zip(middles, radii, values, strict=True):
        distance = np.linalg.norm(places - middle, axis=-1)
        field = np.maximum(field, value * np.clip(1.5 - distance / radius, 0, 1))
    return np.clip(field, 0, 255)


def balls(dtype, spacing=(1.0, 1.0, 1.0), missing=False):
    """Some soft balls of different values."""
    draw, shape = np.random.default_rng(5).uniform, (26, 22, 30)
    field = soft_balls(shape, draw(0, shape, (9, 3)), draw(3, 8, 9), draw(60, 255, 9))
    values = (field * {"uint8": 1.0, "float32": 1e-3}[dtype]).astype(dtype)
    hidden = None
    if missing:
        hidden = np.zeros(shape, dtype=bool)
        hidden[8:16, 4:12, 9:20] = True
    return Volume(values, spacing, missing=hidden)


def seen(volume, view=VIEW, **others):
    """Half-transparent balls of many colours."""
    lo, hi = volume.scalar_range
    width = hi - lo
    points = (lo + 0.15 * width, 0.0), (lo + 0.3 * width, 0.15), (hi, 0.6)
    opacity = OpacityTF((lo, hi), points=points)
    color = ColorTF((lo, hi), ((lo, 1.0, 0.5, 0.2), (lo + width / 2, 0.3, 0.9, 0.4), (hi, 1, 1, 1)))
    return SceneInputs(view, opacity, color, **others)


def traced(volume, inputs, size=24, samples=8, **others):
    return PathTracer(volume, **others).render(inputs, size, samples=samples)


@pytest.mark.parametrize(
    "asymmetry", [0.0, *(pytest.param(each, marks=pytest.mark.slow) for each in (-0.5, 0.7))]
)
@pytest.mark.parametrize("opacity", [1e-9, 0.02, 0.97])
def test_white_under_an_even_sky_is_as_bright_as_the_sky(opacity, asymmetry):
    """The white furnace: with albedo 1 everywhere nothing is to be seen but the sky's light."""
    volume, opacity_tf, color_tf = homogeneous(opacity, (1.0, 1.0, 1.0))
    lamp = replace(SKY, asymmetry=asymmetry)
    image = traced(volume, SceneInputs(VIEW, opacity_tf, color_tf), 12, 2, lamp=lamp)
    assert image[..., 3].max() > min(4 * opacity, 0.9)
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


def test_a_surface_that_faces_the_light_has_its_color_and_what_is_cut_away_no_shadow():
    # FACING looks along +y.
    cut = CropBox((0.0, 0.5, 0.0), (1.0, 1.0, 1.0))
    for color, crop in (((1.0, 1.0, 1.0), None), ((0.7, 0.4, 0.1), None), ((1.0, 1.0, 1.0), cut)):
        volume, opacity_tf, color_tf = homogeneous(1.0, color, 24)
        lamp, light = Lamp(gloss=0.0), LightDirection(0.0, 0.0)
        inputs = SceneInputs(FACING, opacity_tf, color_tf, light=light, crop=crop)
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


def extinction_at(volume, opacity_tf, mask, order, places):
    """Extinction per world length, by SciPy's B-splines; 0 outside."""
    indices = (places / np.array(volume.spacing)).T[::-1]
    inside = abs(2 * indices.T / (np.array(volume.voxels.shape) - 1) - 1) <= 1
    voxels = np.pad(volume.voxels.astype(float), 2, "edge")
    opacity = opacity_tf(map_coordinates(voxels, indices + 2, order=order, prefilter=False))
    if mask is not None:
        opacity = opacity * map_coordinates(mask.shown.astype(float), indices, order=1)
    sigma = -np.log1p(-np.minimum(opacity, 1 - 1e-9)) / volume.voxel_size
    return np.where(inside.all(axis=1), sigma, 0.0)


@pytest.mark.parametrize(
    ("spacing", "masks", "size"),
    [
        ((1.0, 1.0, 1.0), False, 51),
        (ANISOTROPIC, False, 51),
        (ANISOTROPIC, True, 51),
        (ANISOTROPIC, True, 251),
    ],
)
def test_light_scattered_once_is_that_of_a_quadrature(spacing, masks, size):
    """From a point-like light, without surfaces, in the picture's middle.

    The values of large voxels are a cubic B-spline's.
    """
    light = LightDirection(60.0, 20.0)
    volume = balls("float32", spacing)
    lo, hi = volume.scalar_range
    white = ColorTF((lo, hi), ((lo, 1.0, 1.0, 1.0), (hi, 1.0, 1.0, 1.0)))
    blocks = np.add.reduce(np.indices(volume.voxels.shape) // 4) % 2 == 0
    mask = Mask.of(blocks) if masks else None
    inputs = replace(seen(volume, light=light), color_tf=white, mask=mask)
    seen_at = partial(extinction_at, volume, inputs.opacity_tf, mask, 3 if size > 100 else 1)
    places, t = through_middle(volume, VIEW)
    step = t[1] - t[0]
    towards = np.array(light.towards()) @ VIEW.basis()
    sigma = seen_at(places)
    width = volume.radius / 400
    beyond = places[:, None] + (np.arange(800) + 0.5)[:, None] * width * towards
    depth = width * seen_at(beyond.reshape(-1, 3)).reshape(len(places), -1).sum(axis=1)
    own = (np.cumsum(sigma) - sigma / 2) * step
    expected = np.sum(sigma * np.exp(-own - depth)) * step / 4
    lamp = Lamp(key=1.0, sky=0.0, radius=0.01, surfaces=False, bounces=1)
    raster = Raster(size, size, size // 2, size // 2, 1, 1)
    # Finer than usual, as the quadrature is: what is compared is the light, not its step.
    image = PathTracer(volume, lamp=lamp).render(inputs, raster, 0.05, 4096)
    assert image[0, 0, 0] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("case", ["cropped", "missing", "part", "masked"])
def test_opacity_is_the_ray_casters(case):
    volume = balls("float32" if case == "cropped" else "uint8", ANISOTROPIC, case == "missing")
    crop = CropBox((0.2, 0.0, 0.3), (1.0, 0.7, 1.0)) if case == "cropped" else None
    view = replace(VIEW, pan_x=0.1, pan_y=-0.2, distance=0.5)
    raster = Raster(40, 30, 7, 5, 20, 11) if case == "part" else Raster(32, 32)
    mask = Mask.of(np.indices(volume.voxels.shape)[2] < 15) if case == "masked" else None
    inputs = seen(volume, view, crop=crop, mask=mask)
    expected = RaycastRenderer(volume).render(inputs, raster, 0.125)[..., 3]
    image = traced(volume, inputs, raster, 4)
    np.testing.assert_allclose(image[..., 3], expected, atol=1 / 500)
    visible = expected > 0.05
    assert visible.any()
    assert (image[..., :3].max(axis=2)[visible] > 0).mean() > 0.99
    assert (image[..., :3][expected == 0] == 0).all()


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


def test_the_estimated_error_is_the_error():
    volume = balls("uint8")
    inputs = seen(volume)
    *_, truth = PathTracer(volume, seed=3).refine(inputs, 24, 1024)
    found = {e.samples: e for e in PathTracer(volume, seed=8).refine(inputs, 24, 64)}
    assert list(found) == [1, 2, 4, 8, 16, 32, 64]
    assert math.isinf(found[1].error)
    for samples in (4, 8, 16, 32, 64):
        error = np.sqrt(np.mean((found[samples].rgba - truth.rgba)[..., :3] ** 2))
        assert found[samples].error / 1.5 < error < found[samples].error * 1.5
    assert found[64].error < found[8].error / 2


@compiled
def tracked(medium, place, direction, state, transmits):
    """Call what is always inlined."""
    return track(medium, place, direction, state, transmits)


def test_a_path_without_depth_leaves_a_medium_of_next_to_no_extinction():
    # Of one value next to nothing is seen, the other is half opaque.
    voxels = np.zeros((20, 20, 20), np.uint8)
    voxels[..., 10:] = 255
    opacity = OpacityTF((0.0, 255.0), points=((0.0, 1e-41), (254.0, 1e-41), (255.0, 0.5)))
    color = ColorTF((0.0, 255.0), ((0.0, 0.8, 0.8, 0.8),))
    tracer = PathTracer(Volume(voxels), threads=1)
    inputs = SceneInputs(View(-90.0, 0.0, 0.0, 0.5), opacity, color)
    scatterer = tracer._scatterer(inputs, tracer._voxels, 0.5, 0.0)
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


SIZE = 32  # width and height of Mitsuba's pictures in pixels
POINT = 0.05  # angular radius of the light in degrees, where Mitsuba's is a direction


@dataclass(frozen=True)
class MitsubaScene:
    """What the path tracer and Mitsuba both draw."""

    name: str
    spacing: tuple[float, float, float]
    opacities: tuple[float, float, float]
    grays: tuple[float, float]
    lamp: Lamp
    view: View
    light: LightDirection

    @property
    def volume(self):
        """Soft balls of different values, without symmetries."""
        draw = np.random.default_rng(5).uniform
        placed = draw(2, 16, (8, 3)), draw(3, 7, 8), draw(90, 255, 8)
        return Volume(soft_balls((20, 18, 22), *placed).astype(np.uint8), self.spacing)

    @property
    def inputs(self):
        """View, TFs and light."""
        lo, hi = self.volume.scalar_range
        middle = (lo + hi) / 2
        start, half, full = self.opacities
        points = ((lo, 0.0), (lo + 0.2 * (hi - lo), start), (middle, half), (hi, full))
        dark, bright = self.grays
        colors = ColorTF((lo, hi), ((lo, *[dark] * 3), (hi, *[bright] * 3)))
        return SceneInputs(self.view, OpacityTF((lo, hi), points=points), colors, self.light)


SCENES = (
    MitsubaScene(
        "sky", (1.0, 1.0, 1.0), (0.0, 0.1, 0.5), (0.9, 0.9), Lamp(0.0, 1.0, POINT, 0.0, 0.0),
        View(35.0, 25.0, 7.0, 0.7), LightDirection(),
    ),
    MitsubaScene(
        "light", (1.0, 1.7, 0.6), (0.02, 0.3, 0.8), (0.7, 1.0), Lamp(1.0, 0.0, POINT, 0.0, 0.0),
        View(-60.0, 10.0, 0.0, 0.8), LightDirection(50.0, 30.0),
    ),
    MitsubaScene(
        "forward", (1.0, 1.0, 1.0), (0.0, 0.2, 0.6), (1.0, 0.65), Lamp(0.8, 0.4, POINT, 0.6, 0.0),
        View(120.0, -20.0, 0.0, 0.6), LightDirection(-70.0, 40.0),
    ),
)  # fmt: skip


SEEDS, SAMPLES = 24, 32
CLOSE = 0.05  # voxels between samples along view rays: where Mitsuba's rays collide is continuous
UNSEEN = 1e-3  # a quarter of an 8-bit step: pixels of less opacity are not traced


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES, ids=[scene.name for scene in SCENES])
def test_pixels_are_within_three_standard_errors_of_mitsubas(scene):
    with np.load(Path(__file__).parent / "mitsuba_pictures" / f"{scene.name}.npz") as file:
        theirs, their_error = (file[name].astype(np.float64) for name in ("mean", "error"))
    pictures = []
    for seed in range(SEEDS):
        tracer = PathTracer(scene.volume, scene.light, CLOSE, seed=seed, lamp=scene.lamp)
        *_, last = tracer.refine(scene.inputs, SIZE, SAMPLES)
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


RASTER = Raster(240, 240, 92, 92, 56, 56)  # the middle, in which a voxel is seven pixels
LEVELS, BROAD = 36.0, 2.5


def drop(n=24):
    """A smooth drop of n voxels along each axis; 24 in steps, as a simulated flame is stored."""
    z, y, x = np.mgrid[0:n, 0:n, 0:n] / ((n - 1) / 2) - 1
    values = LEVELS * np.exp(-BROAD * (x**2 + y**2 + z**2))
    return Volume(values.astype(np.float32) if n > 24 else np.rint(values).astype(np.uint8))


def white_ball(view):
    """The drop's middle, as an opaque ball."""
    opacity = OpacityTF((0.0, LEVELS), points=((0.0, 0.0), (11.0, 0.0), (13.0, 1.0)))
    color = ColorTF((0.0, LEVELS), ((0.0, 0.8, 0.8, 0.8), (LEVELS, 0.8, 0.8, 0.8)))
    return SceneInputs(view, opacity, color, LightDirection(25.0, 20.0))


def smooth_ball(view):
    """The same ball in direct light, in closed form, along the view's right, up and back."""
    places = View.tangent * ((2 * np.arange(92, 148) + 1) / 240 - 1)
    x, y = np.meshgrid(places, -places)
    ways = np.stack([x, y, -np.ones_like(x)]) / np.sqrt(x**2 + y**2 + 1)
    eye = view.camera_distance(drop().radius) * np.array([0.0, 0.0, 1.0])[:, None, None]
    radius = 11.5 * math.sqrt(math.log(LEVELS / 12) / BROAD)
    nearest = -(eye * ways).sum(axis=0)
    depth = nearest - np.sqrt(nearest**2 - (eye**2).sum() + radius**2)
    normals = (eye + depth * ways) / radius
    light = np.array(white_ball(view).light.towards())[:, None, None]
    facing = (normals * light).sum(axis=0)
    mirrored = ((light - 2 * facing * normals) * ways).sum(axis=0)
    return 0.8 * 0.9 * abs(facing) + 0.2 * np.maximum(mirrored, 0) ** 20


def halves_of(kind, view, samples=64):
    """Two differences of a picture from smooth shading; the noise of paths is independent."""
    name, light = kind.split()
    if light != "path":
        lit = open_renderer(name, drop(), light)
        image = lit.render(white_ball(view), RASTER, 0.1)[..., :3].mean(axis=-1)
        return np.stack([image - smooth_ball(view)] * 2)
    # Light that is scattered once, from one direction, has the least noise.
    tracer = PathTracer(drop(), lamp=Lamp(gloss=0.0, sky=0.0, bounces=1, radius=0.05))
    *_, picture = tracer.refine(white_ball(view), RASTER, samples)
    assert (picture.rgba[..., 3] > 0.99).all()
    return picture.halves.mean(axis=-1)


def ring_power(even, odd):
    """Power along the surface of what no smooth shading has; the noise of paths cancels in it."""
    y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in even.shape), indexing="ij")
    powers = [x**m * y**n for m in range(9) for n in range(9 - m)]
    smooth = np.linalg.qr(np.stack([each.ravel() for each in powers], axis=1)).Q
    even, odd = (each.ravel().astype(np.float64) for each in (even, odd))
    return float(np.mean((even - smooth @ (smooth.T @ even)) * (odd - smooth @ (smooth.T @ odd))))


@pytest.mark.parametrize(
    ("kind", "view"),
    [
        ("raycast direct", View(60, 40, 0, 0.7)),
        ("vtk direct", View(20, 15, 0, 0.7)),
        pytest.param("path path", View(60, 40, 0, 0.7), marks=pytest.mark.slow),
    ],
)
def test_large_voxels_have_few_rings(kind, view, monkeypatch):
    smooth = ring_power(*halves_of(kind, view))
    # Linear values and usual normals, of paths with close samples and with the usual steps.
    for blur, times in ((1e-6, 3), (0.0, 5)):
        for module in (renderer, raycast, vtk_renderer):
            monkeypatch.setattr(module, "blur_of", lambda *_, blur=blur: blur)
        assert smooth < ring_power(*halves_of(kind, view)) / times


@pytest.mark.parametrize("is_coarse", [False, True])
@pytest.mark.parametrize(("n", "part"), [(24, RASTER), (96, Raster(336, 336, 129, 129, 78, 78))])
def test_nodes_of_soft_light_show_few_rings(n, part, is_coarse, monkeypatch):
    # Of the small voxels of 2.4 pixels, too, with 3.6 between nodes.
    lit, ball = RaycastRenderer(drop(n), "soft"), white_ball(View(110, -30, 0, 0.7))
    with lit.asking(is_coarsely_lit=is_coarse):
        smooth = ring_power(*[lit.render(ball, part, 0.1)[..., 0]] * 2)
        monkeypatch.setattr(raycast, "blur_of", lambda *_: 0.0)
        assert smooth < ring_power(*[lit.render(ball, part, 0.1)[..., 0]] * 2) / 2.5


def test_thin_bones_in_thick_slices_are_no_combs(monkeypatch):
    z, _, x = np.mgrid[0:24, 0:16, 0:40].astype(np.float32)
    # Edge-on, shifted by two voxels from slice to slice.
    bone = Volume(np.exp(-((x - 2 * z + 3) ** 2) / 2), (1.0, 1.0, 1.6))
    opacity = OpacityTF((0.0, 1.0), points=((0.3, 0.0), (0.5, 1.0)))
    inputs = replace(white_ball(FACING), opacity_tf=opacity)
    raster = Raster(84, 84)  # of voxels of 2.1 x 2.1 x 3.3 pixels

    def unevenness(drawn_by):
        shown = drawn_by.render(inputs, raster)[32:52, :, 3].sum(axis=1)
        return shown.std() / shown.mean()

    assert bone.has_thick_slices and not replace(bone, spacing=(1.0, 1.5, 1.0)).has_thick_slices
    smooth = RaycastRenderer(bone, is_blurred=True)
    assert unevenness(smooth) < 0.5 * unevenness(RaycastRenderer(bone))
    # Of the same picture, derivatives are those of voxels that were blurred before.
    blurred_before = RaycastRenderer(replace(bone, voxels=blurred(bone.voxels)).over((0.0, 1.0)))
    changes = [each.change(inputs, raster, np.eye(256)[100]) for each in (smooth, blurred_before)]
    np.testing.assert_array_equal(*changes)
    found = unevenness(PathTracer(bone))
    monkeypatch.setattr(renderer, "blur_of", lambda *_: 0.0)
    assert found < 0.5 * unevenness(PathTracer(bone))
