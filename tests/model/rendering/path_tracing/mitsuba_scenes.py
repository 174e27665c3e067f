"""Scenes that the path tracer and Mitsuba 3 both draw, and how Mitsuba's pictures were made.

They hold media alone, as Mitsuba has no surfaces that depend on a gradient, and grey colours
bright enough that all collisions keep the same share. Everything that Mitsuba is given follows
from the volume and its TF by numpy and scipy, not by the path tracer's own tables.

    pip install mitsuba
    PYTHONPATH=. python tests/model/rendering/path_tracing/mitsuba_scenes.py

draws them anew (Mitsuba 3.9.1, ``volpath``, variant ``llvm_ad_rgb``) into ``mitsuba_pictures``:
mean and standard error of each pixel.
"""

import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from model.rendering.path_tracing.renderer import Lamp
from model.rendering.path_tracing.scattering import single_scattering_albedo
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import VIEW_ANGLE, View
from model.scene.volume import Volume

FOLDER = Path(__file__).parent / "mitsuba_pictures"

SIZE = 32
"""Width and height of the pictures in pixels."""

FINE = 10
"""Cells of Mitsuba's grid along a voxel: it interpolates extinctions, not values."""

BATCHES, PER_BATCH = 32, 512
"""Independent pictures of each scene, and samples of each pixel in one."""

POINT = 0.05
"""Angular radius of the light in degrees, where Mitsuba's is a direction."""


@dataclass(frozen=True)
class MitsubaScene:
    """A scene of :data:`SCENES`."""

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


def grids(scene):
    """Extinction per voxel size and albedo in the middle of each cell of Mitsuba's grid."""
    volume, inputs = scene.volume, scene.inputs
    counts = [FINE * (n - 1) for n in volume.voxels.shape]
    axes = [(np.arange(count) + 0.5) / FINE for count in counts]
    places = np.meshgrid(*axes, indexing="ij")
    values = map_coordinates(volume.voxels.astype(np.float64), places, order=1)
    lo, hi = volume.scalar_range
    bins = np.linspace(lo, hi, 256)
    known = np.array(inputs.opacity_tf.points)
    opacities = np.interp(bins, known[:, 0], known[:, 1])
    extinction = np.interp(values, bins, -np.log1p(-opacities))
    dark, bright = scene.grays
    gray = dark + (bright - dark) * (values - lo) / (hi - lo)
    albedo = single_scattering_albedo(gray, scene.lamp.asymmetry)
    return extinction.astype(np.float32), albedo.astype(np.float32)


def rays(scene):
    """Eye, and directions through the middles of the pixels, row by row from the top."""
    volume, view = scene.volume, scene.view
    right, up, back = view.basis()
    eye = np.array(volume.extent) / 2 + view.camera_distance(volume.radius) * back
    at = math.tan(math.radians(VIEW_ANGLE / 2)) * ((np.arange(SIZE) + 0.5) * 2 / SIZE - 1)
    directions = -back + at[None, :, None] * right - at[:, None, None] * up
    return eye, directions.reshape(-1, 3) / np.linalg.norm(directions, axis=-1).reshape(-1, 1)


def stored(name):
    """Return Mitsuba's picture of a scene, (rows, columns), and its standard errors."""
    with np.load(FOLDER / f"{name}.npz") as file:
        return file["mean"].astype(np.float64), file["error"].astype(np.float64)


def draw(scene):
    """Have Mitsuba draw a scene, and store it."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    loaded = load(mi, scene)
    pictures = np.array([traced(mi, loaded, scene, PER_BATCH, seed) for seed in range(BATCHES)])
    FOLDER.mkdir(exist_ok=True)
    error = pictures.std(axis=0, ddof=1) / math.sqrt(BATCHES)
    mean = pictures.mean(axis=0)
    np.savez_compressed(
        FOLDER / f"{scene.name}.npz", mean=mean.astype(np.float32), error=error.astype(np.float32)
    )


def load(mi, scene):  # type: ignore[no-untyped-def]
    """Return a scene as Mitsuba holds it."""
    from mitsuba import ScalarTransform4f as Transform

    volume, lamp = scene.volume, scene.lamp
    extinction, albedo = grids(scene)
    extent = list(volume.extent)
    box = Transform().scale(extent)

    def grid(values):
        held = mi.VolumeGrid(np.ascontiguousarray(values[..., None]))
        return {"type": "gridvolume", "grid": held, "to_world": box, "raw": True}

    phase = {"type": "isotropic"}
    if lamp.asymmetry:
        phase = {"type": "hg", "g": lamp.asymmetry}
    medium = {
        "type": "heterogeneous",
        "sigma_t": grid(extinction),
        "albedo": grid(albedo),
        "scale": 1 / volume.voxel_size,
        "phase": phase,
    }
    whole = {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": 64, "rr_depth": 64, "hide_emitters": True},
        "box": {
            "type": "cube",
            "to_world": box @ Transform().translate([0.5] * 3) @ Transform().scale(0.5),
            "bsdf": {"type": "null"},
            "interior": medium,
        },
    }
    if lamp.sky:
        whole["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": [lamp.sky] * 3}}
    if lamp.key:
        from model.rendering.raycast.illumination import travel_direction

        whole["light"] = {
            "type": "directional",
            "direction": list(map(float, travel_direction(scene.view, scene.light))),
            "irradiance": {"type": "rgb", "value": [math.pi * lamp.key] * 3},
        }
    return mi.load_dict(whole)


def traced(  # type: ignore[no-untyped-def]
    mi, loaded, scene, samples, seed
):
    """Return one picture of Mitsuba's, (rows, columns): radiance in the red channel."""
    import drjit as dr

    eye, directions = rays(scene)
    repeated = np.repeat(directions, samples, axis=0).T.astype(np.float32)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, repeated.shape[1])
    ray = mi.RayDifferential3f(mi.Point3f(*map(float, eye)), mi.Vector3f(*map(mi.Float, repeated)))
    found, _valid, _aovs = loaded.integrator().sample(loaded, sampler, ray)
    red = np.array(found.x)
    dr.eval(red)
    return red.reshape(SIZE, SIZE, samples).mean(axis=2)


if __name__ == "__main__":
    for each in SCENES:
        begun = time.perf_counter()
        draw(each)
        mean, error = stored(each.name)
        seconds = time.perf_counter() - begun
        sys.stdout.write(
            f"{each.name}: {seconds:.0f} s, mean {mean.mean():.4f}, "
            f"standard error {np.sqrt((error**2).mean()):.5f}\n"
        )
