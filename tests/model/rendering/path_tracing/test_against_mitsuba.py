"""Media against pictures that Mitsuba 3 has drawn, and surfaces of voxels of many pixels.

Mitsuba has no surfaces that depend on a gradient, so the scenes hold media alone, in grey colours
bright enough that all collisions keep the same share. It drew them (3.9.1, ``volpath`` of depth 64,
variant ``llvm_ad_rgb``) into `mitsuba_pictures`, 32 times with 512 samples of a pixel: mean and
standard error of each pixel. Its medium fills a box of the volume's extent, by grids of ten cells
along a voxel, at whose middles NumPy and SciPy found the extinction per voxel size, -log(1 - a),
and the colour's albedo. A ``constant`` emitter is the sky, a ``directional`` one of irradiance pi
times the lamp's is the light. Rays go through the middles of the pixels.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from model.rendering.path_tracing import renderer
from model.rendering.path_tracing.renderer import Lamp, PathTracer
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

SIZE = 32
"""Width and height of Mitsuba's pictures in pixels."""

POINT = 0.05
"""Angular radius of the light in degrees, where Mitsuba's is a direction."""


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
        rng = np.random.default_rng(5)
        shape = (20, 18, 22)
        places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
        field = np.zeros(shape)
        for middle, radius, value in zip(
            rng.uniform(2, 16, (8, 3)), rng.uniform(3, 7, 8), rng.uniform(90, 255, 8), strict=True
        ):
            distance = np.linalg.norm(places - middle, axis=-1)
            field = np.maximum(field, value * np.clip(1.5 - distance / radius, 0, 1))
        return Volume(np.clip(field, 0, 255).astype(np.uint8), self.spacing)

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

CLOSE = 0.05
"""Distance of samples along view rays in voxels: where Mitsuba's rays collide is continuous."""

UNSEEN = 1e-3
"""A quarter of an 8-bit step: pixels of less opacity are not traced."""


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES, ids=[scene.name for scene in SCENES])
def test_pixels_are_within_three_standard_errors_of_mitsubas(scene):
    with np.load(Path(__file__).parent / "mitsuba_pictures" / f"{scene.name}.npz") as file:
        theirs, their_error = (file[name].astype(np.float64) for name in ("mean", "error"))
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


RASTER = Raster(240, 240, 92, 92, 56, 56)
"""The middle of a picture in which a voxel is ten pixels."""


def flame():
    """Smooth drops of few 8-bit steps a voxel, as a simulated flame is stored."""
    z, y, x = np.mgrid[0:16, 0:16, 0:16] / 7.5 - 1
    values = 230 * np.exp(-1.6 * (x**2 + y**2 + z**2))
    values += 60 * np.exp(-5 * ((x - 0.5) ** 2 + (y + 0.4) ** 2 + (z - 0.3) ** 2))
    return Volume(np.rint(values.clip(0, 255)).astype(np.uint8))


def scene(view):
    """An opaque, white surface."""
    opacity = OpacityTF((0.0, 255.0), points=((0.0, 0.0), (90.0, 0.0), (120.0, 1.0)))
    color = ColorTF((0.0, 255.0), ((0.0, 0.8, 0.8, 0.8), (255.0, 0.8, 0.8, 0.8)))
    return SceneInputs(view, opacity, color, LightDirection(25.0, 20.0))


def ring_power(view, samples=64):
    """Power along the surface of what no smooth shading has; the noise of paths cancels in it."""
    # Light that is scattered once, from one direction, has the least noise.
    tracer = PathTracer(flame(), lamp=Lamp(gloss=0.0, sky=0.0, bounces=1, radius=0.05))
    *_, picture = tracer.refine(scene(view), RASTER, samples)
    tracer.close()
    assert (picture.rgba[..., 3] > 0.99).all()
    y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in RASTER.shape), indexing="ij")
    powers = [x**m * y**n for m in range(9) for n in range(9 - m)]
    smooth = np.linalg.qr(np.stack([each.ravel() for each in powers], axis=1)).Q
    even, odd = picture.halves.mean(axis=-1).reshape(2, -1).astype(np.float64)
    # The halves' noise is independent.
    return float(np.mean((even - smooth @ (smooth.T @ even)) * (odd - smooth @ (smooth.T @ odd))))


@pytest.mark.slow
@pytest.mark.parametrize(
    "view",
    [View(60, 40, 0, 0.7), View(110, -30, 0, 0.7), View(250, 60, 0, 0.7), View(20, 15, 0, 0.7)],
)
def test_rings_on_surfaces_are_less_than_a_fifth_of_those_of_the_usual_steps(view, monkeypatch):
    finer = ring_power(view)
    monkeypatch.setattr(renderer, "LARGE", np.inf)
    assert finer < ring_power(view) / 5
