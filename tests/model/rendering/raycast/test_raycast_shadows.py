"""Shadows by the ray caster: against VTK's, and against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from model.rendering import vtk_renderer
from model.rendering.opengl import software_name
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.raycast.shadows import APART, UNKNOWN, sought
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, Range
from model.scene.view import View
from model.scene.volume import Volume

SIZE = 96
VIEW = View(35.0, 25.0, 7.0, 0.7)
ISOTROPIC, ANISOTROPIC = (1.0, 1.0, 1.0), (1.0, 1.7, 0.6)


def blobs(dtype: str, spacing: tuple[float, float, float], shape=(30, 24, 36)) -> Volume:
    """Some balls of different values that cast shadows on one another, and on the faces."""
    rng = np.random.default_rng(5)
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    field = np.zeros(shape)
    for center, radius, value in zip(
        rng.uniform(0, shape, (9, 3)), rng.uniform(3, 8, 9), rng.uniform(60, 255, 9), strict=True
    ):
        distance = np.linalg.norm(places - center, axis=-1)
        field = np.maximum(field, value * np.clip(1.5 - distance / radius, 0, 1))
    factor = {"uint8": 1.0, "int16": 40.0, "float32": 1e-3}[dtype]
    values = np.clip(field, 0, 255) * factor
    values[0, 0, 0], values[-1, -1, -1] = 0, 255 * factor
    return Volume(values.astype(dtype), spacing)


def tf_of(scalar_range: Range, kind: str) -> tuple[OpacityTF, ColorTF]:
    lo, hi = scalar_range
    width = hi - lo
    stops = ((lo, 0.9, 0.4, 0.3), (lo + 0.5 * width, 0.4, 0.9, 0.5), (hi, 0.7, 0.7, 1.0))
    opacity = {
        "veil": OpacityTF(scalar_range, points=((lo, 0.0), (lo + 0.2 * width, 0.02), (hi, 0.05))),
        "solid": OpacityTF(scalar_range, points=((lo + 0.3 * width, 0.0), (lo + 0.4 * width, 0.9))),
        "shells": OpacityTF(
            scalar_range,
            (
                GaussianMode(lo + 0.35 * width, 0.04 * width, 0.15),
                GaussianMode(lo + 0.8 * width, 0.05 * width, 0.8),
            ),
        ),
    }[kind]
    return opacity, ColorTF(scalar_range, stops)


def rmse_to_vtk(volume: Volume, kind: str, light: LightDirection, crop: CropBox | None) -> float:
    inputs = SceneInputs(VIEW, *tf_of(volume.scalar_range, kind), light, crop)
    images = []
    for renderer in (RaycastRenderer(volume, "shadows"), VtkRenderer(volume, "shadows")):
        images.append(renderer.render(inputs, SIZE))
        renderer.close()
    assert images[1][..., 3].max() > 0.05
    return float(np.sqrt(np.mean((images[0] - images[1]) ** 2)))


@pytest.mark.parametrize("dtype", ["float32", "int16", "uint8"])
@pytest.mark.parametrize("kind", ["shells", "solid", "veil"])
def test_shadows_are_vtks(dtype: str, kind: str) -> None:
    assert rmse_to_vtk(blobs(dtype, ISOTROPIC), kind, LightDirection(), None) <= 0.002


@pytest.mark.parametrize("kind", ["shells", "solid", "veil"])
@pytest.mark.parametrize(
    "light",
    [(0.0, 0.0), (0.0, 90.0), (60.0, -20.0), (90.0, 0.0), (170.0, 10.0)],
)
def test_shadows_are_vtks_from_any_direction(kind: str, light: tuple[float, float]) -> None:
    assert rmse_to_vtk(blobs("uint8", ANISOTROPIC), kind, LightDirection(*light), None) <= 0.002


@pytest.mark.parametrize("kind", ["shells", "veil"])
def test_what_is_cropped_away_casts_shadows_as_vtks_does(kind: str) -> None:
    crop = CropBox((0.1, 0.0, 0.3), (0.8, 0.6, 1.0))
    for volume in (blobs("uint8", ISOTROPIC), blobs("float32", ANISOTROPIC)):
        assert rmse_to_vtk(volume, kind, LightDirection(), crop) <= 0.002


def test_one_cell_of_voxels_and_a_thin_slab_are_lit_as_by_vtk() -> None:
    for shape in ((2, 2, 2), (2, 20, 17), (25, 2, 9)):
        volume = blobs("float32", ISOTROPIC, shape)
        assert rmse_to_vtk(volume, "veil", LightDirection(), None) <= 0.002


def test_a_slab_dims_the_light_by_its_own_opacity() -> None:
    """A veil of constant opacity a, far from faces: after n steps (1 - a)^n of the light is left.

    Half of the diffuse light reaches nothing that has no gradient, see gradient shading; all of
    the colour is scattered light, and the volume is as long as the light's way of `reach`.
    """
    count, alpha = 65, 0.04
    scalars = np.full((count, count, count), 128, np.uint8)
    scalars[0, 0, 0], scalars[-1, -1, -1] = 0, 255
    volume = Volume(scalars)
    # The view's step is half a voxel.
    opacity = OpacityTF((0.0, 255.0), points=((0.0, alpha),))
    white = ColorTF((0.0, 255.0), ((0.0, 1.0, 1.0, 1.0),))
    # From the side: as far as the middle of the image, light comes through half of the volume.
    inputs = SceneInputs(View(0.0, 0.0, 0.0, 1.0), opacity, white, LightDirection(90.0, 0.0))
    image = RaycastRenderer(volume, "shadows").render(inputs, 65)
    step = 0.5 / count
    reach = math.sqrt(3) - (math.sqrt(3) - 0.5 / (count - 1)) * 0.5**0.33
    per_step = 1 - (1 - alpha) ** 0.5
    arriving = (1 - per_step) ** math.ceil(reach / step)
    color = image[32, 32, 0] / image[32, 32, 3]
    assert color == pytest.approx(0.9 * arriving, rel=0.02)


def test_empty_space_and_dark_rays_may_be_left_out() -> None:
    volume = blobs("uint8", ISOTROPIC)
    inputs = SceneInputs(VIEW, *tf_of(volume.scalar_range, "shells"))
    renderer = RaycastRenderer(volume, "shadows")
    fast = renderer.render(inputs, SIZE)
    renderer.skip_empty = renderer.terminate_early = False
    np.testing.assert_allclose(fast, renderer.render(inputs, SIZE), atol=1 / 255)


def light_of(known: np.ndarray, lights: np.ndarray, m: int, a: float) -> tuple[float, int]:
    """Light of a sample, looked up in `lights` where it is sought; and how often it was."""
    count = 0
    wanted, found = sought(known, m, np.float32(a))
    while wanted >= 0:
        assert known[wanted] == UNKNOWN
        known[wanted] = lights[wanted]
        count += 1
        wanted, found = sought(known, m, np.float32(a))
    return float(found), count


def test_faint_samples_share_light_that_changes_little() -> None:
    lights = np.linspace(0.5, 0.53, 33).astype(np.float32)
    known = np.full(33, UNKNOWN)
    cast = 0
    for m in range(32):
        found, count = light_of(known, lights, m, 0.001)
        assert found == pytest.approx(lights[m], abs=1e-4)
        cast += count
    assert cast == 32 / APART + 1


@pytest.mark.parametrize("a", [0.001, 0.9])
def test_light_that_changes_much_is_looked_for_everywhere(a: float) -> None:
    lights = np.linspace(1.0, 2.4, 33).astype(np.float32) ** 2
    known = np.full(33, UNKNOWN)
    for m in range(32):
        assert light_of(known, lights, m, a)[0] == pytest.approx(lights[m], abs=1e-6)


def test_sharing_fades_and_does_not_end_at_once() -> None:
    """A wave between two samples: what counts for a sample moves on with light and opacity."""
    for of_opacity in (False, True):
        found = []
        for share in np.linspace(0, 1, 400):
            lights = np.full(33, 0.5, np.float32)
            lights[1:4] = 1.0
            if not of_opacity:
                lights[APART] += 0.1 * share
            known = np.full(33, UNKNOWN)
            found.append(light_of(known, lights, 1, 0.2 * share if of_opacity else 0.001)[0])
        assert found[0] == pytest.approx(0.5) and found[-1] == pytest.approx(1.0, abs=1e-3)
        assert np.abs(np.diff(found)).max() < 0.02


@pytest.mark.slow
@pytest.mark.skipif(not software_name(), reason="a graphics card ends no loops")
def test_vtk_loses_no_pixels_where_a_program_ends_its_loops(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    volume = blobs("uint8", ISOTROPIC)
    opacity, color = tf_of(volume.scalar_range, "veil")
    inputs = SceneInputs(View(30.0, 30.0, 0.0, 0.8), opacity, color)
    expected = RaycastRenderer(volume, "shadows").render(inputs, 32, 0.05)
    images = []
    for most in (10**9, vtk_renderer.MOST_ITERATIONS):
        monkeypatch.setattr(vtk_renderer, "MOST_ITERATIONS", most)
        renderer = VtkRenderer(volume, "shadows")
        images.append(renderer.render(inputs, 32, 0.05))
        renderer.close()
    lost = [(image[..., 3] < expected[..., 3] - 0.05).sum() for image in images]
    assert lost[0] > 20 and lost[1] == 0
    assert np.sqrt(np.mean((images[1] - expected) ** 2)) <= 0.002
