"""The derivative in soft light against the complex-step derivative of the 64-bit reference."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from model.rendering.raycast import renderer as ray_caster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.random_tfs import OpacityKind, opacity_tf_of
from model.scene.region import Region
from model.scene.scene import Scene
from model.scene.tf_perturbation import edit_around, with_opacity
from model.scene.transfer_function import ColorTF
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity import exact
from tests import reference_light

SIZE, STEP = 18, 0.5
RANGE = (0.0, 255.0)
VIEW = View(35.0, 25.0, 7.0, 0.6)
LIGHT = LightDirection(-40.0, 30.0)
COLOR = ColorTF(RANGE, ((0.0, 0.9, 0.4, 0.3), (128.0, 0.4, 0.9, 0.5), (255.0, 0.7, 0.7, 1.0)))
EDITS = np.array([edit_around(value, RANGE, 6.0) for value in (15.0, 60.0, 110.0, 160.0, 220.0)])
KINDS = [kind for kind in get_args(OpacityKind) if kind != "empty"]
REGION = Region(3, 4, 15, 16)
PART = slice(4, 16), slice(3, 15)


@pytest.fixture(scope="module")
def volume() -> Volume:
    """Balls of several values, some voxels of which are missing."""
    rng = np.random.default_rng(5)
    shape = (16, 13, 18)
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    field = np.zeros(shape)
    for center, radius, value in zip(
        rng.uniform(0, shape, (7, 3)), rng.uniform(3, 6, 7), rng.uniform(80, 255, 7), strict=True
    ):
        distance = np.linalg.norm(places - center, axis=-1)
        field = np.maximum(field, value * np.clip(1.5 - distance / radius, 0, 1))
    field[0, 0, 0], field[-1, -1, -1] = 0, 255
    missing = np.zeros(shape, bool)
    missing[3:6, 4:8, 6:12] = True
    return Volume(np.rint(field).astype(np.uint8), (1.0, 1.3, 0.8), missing=missing)


def inputs_of(
    kind: OpacityKind, volume: Volume, seed: int, crop: CropBox | None = None
) -> SceneInputs:
    rng, scene = np.random.default_rng([3, seed]), Scene.of(volume, SIZE, "direct")
    inputs = SceneInputs(VIEW, opacity_tf_of(kind, rng, scene), COLOR, LIGHT, crop)
    return with_opacity(inputs, np.minimum(inputs.opacity_tf.sample(RANGE), 0.98))


def truth(volume: Volume, inputs: SceneInputs) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The image's colours, and their changes by each edit."""
    found = [
        reference_light.derivative(volume, inputs, SIZE, STEP, "soft", edit.astype(float))
        for edit in EDITS
    ]
    return found[0][0][..., :3], np.array([change[..., :3] for _, change in found])


def difference(found: NDArray[np.floating], expected: NDArray[np.floating]) -> tuple[float, float]:
    """Relative error, and 1 - cosine."""
    found = np.asarray(found, dtype=float)
    error = np.linalg.norm(found - expected) / np.linalg.norm(expected)
    along = (found * expected).sum() / np.linalg.norm(found) / np.linalg.norm(expected)
    return float(error), 1 - float(along)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("crop", [None, CropBox((0.1, 0.2, 0.0), (0.9, 0.9, 0.7))])
def test_derivatives_are_those_of_exact_images(
    kind: OpacityKind, crop: CropBox | None, volume: Volume, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The light's changes by many edits on its own grid, as for images of this size and more.
    monkeypatch.setattr(ray_caster, "FINE_FROM", SIZE)
    renderer = RaycastRenderer(volume, "soft", sample_distance=STEP, threads=2)
    for seed in range(2):
        inputs = inputs_of(kind, volume, seed, crop)
        image, changes = truth(volume, inputs)
        assert np.abs(renderer.render(inputs, SIZE)[..., :3] - image).max() < 5e-3
        fields = np.array([renderer.change(inputs, SIZE, edit) for edit in EDITS])
        curve = EDITS @ exact.region_sensitivity(renderer, inputs, SIZE, REGION)
        seen, moved = image[PART], changes[:, *PART]
        norm = np.linalg.norm(seen)
        windows = np.array([[4, 16, 3, 15]])
        norms = np.sqrt(
            [renderer.squared_changes(inputs, SIZE, windows, edit[None])[0] for edit in EDITS]
        )
        for found, right in (
            (fields, changes),
            (curve, (seen * moved).sum(axis=(1, 2, 3)) / norm),
            (norms, np.sqrt((moved**2).sum(axis=(1, 2, 3)))),
        ):
            error, turned = difference(found, right)
            assert error <= 1e-2 and turned <= 1e-3
    renderer.close()


def test_edits_together_are_as_edits_alone_and_windows_together_as_their_sum(
    volume: Volume,
) -> None:
    renderer = RaycastRenderer(volume, "soft", sample_distance=STEP, threads=2)
    inputs = inputs_of("modes", volume, 1)
    windows = np.array([[0, 9, 0, 18], [9, 18, 4, 12]])
    together = renderer.squared_changes(inputs, SIZE, windows, EDITS)
    alone = [renderer.squared_changes(inputs, SIZE, windows, edit[None])[0] for edit in EDITS]
    np.testing.assert_allclose(together, alone, rtol=1e-4)
    gradients, energies = renderer.differentiate(inputs, SIZE, windows)
    gradient, energy = renderer.differentiate_together(inputs, SIZE, windows)
    np.testing.assert_allclose(gradients.sum(axis=0), gradient, rtol=1e-5, atol=1e-6)
    assert energies.sum() == pytest.approx(energy)
    renderer.close()


def test_small_images_take_a_coarser_grid_for_many_edits() -> None:
    """On volumes that have more voxels than that grid has nodes."""
    places = np.stack(np.meshgrid(*[np.linspace(-1, 1, 72)] * 3, indexing="ij"))
    field = 255 * np.exp(-3 * (places**2).sum(axis=0)) * (1 + 0.2 * np.sin(9 * places[0]))
    volume = Volume(np.clip(np.rint(field), 0, 255).astype(np.uint8))
    renderer = RaycastRenderer(volume, "soft", sample_distance=STEP, threads=2)
    inputs = with_opacity(inputs_of("modes", volume, 2), np.linspace(0.01, 0.08, 256))
    small, large = (
        exact.change_norms(renderer, inputs, size, Region.whole(size), 6.0) for size in (64, 128)
    )
    # Four times as many pixels have twice the norm.
    assert difference(2 * small, large)[0] < 0.1
    assert difference(2 * small, large)[1] < 2e-3
    renderer.close()
