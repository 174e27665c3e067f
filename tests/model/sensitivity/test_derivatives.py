"""Exact derivatives against the complex-step derivative of the 64-bit reference: one table.

Of each light, TF and step: the change of every pixel, a region's sensitivity, and the norm of its
change.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_exact import COLOR, RANGE, REGION, SIZE, VIEW, random_opacity, small_volume, tf_of

from model.rendering.raycast import renderer as ray_caster
from model.rendering.raycast.classification import LEVELS_PER_BIN
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.scene import LightDirection
from model.scene.tf_perturbation import edit_around
from model.scene.volume import Volume
from model.sensitivity.display import cosine
from model.sensitivity.exact import change_norms, region_sensitivity
from tests import reference_light

PART = slice(3, 13), slice(2, 11)
LIGHT = LightDirection(-40.0, 30.0)
VALUES, WIDTH = (60.0, 110.0, 220.0), 6.0
EDITS = np.array([edit_around(value, RANGE, WIDTH) for value in VALUES])

MASK = Mask.of(np.random.default_rng(4).random((9, 12, 10)) < 0.7)

CASES = [*(("none", step) for step in (0.5, 1.0, 2.0)), ("direct", 0.5), ("soft", 0.5)]
"""Lights and sample distances."""


def one_bin():
    opacity = np.zeros(256)
    opacity[100] = 0.5
    return opacity


TFS = {
    "random": random_opacity(0.9),
    "faint": random_opacity(1e-3),
    "nearly nothing": random_opacity(4e-6),
    "nothing": np.zeros(256),
    "nearly opaque": np.full(256, 0.99),
    "opaque": np.ones(256),
    "opaque from some value on": (np.arange(256) >= 90).astype(float),
    "one bin": one_bin(),
}


@pytest.fixture(scope="module")
def volume():
    """Blobs, some voxels of which are missing."""
    small = small_volume()
    missing = np.zeros(small.scalars.shape, bool)
    missing[3:6, 4:7, 2:6] = True
    return Volume(small.scalars, small.spacing, missing=missing).over(RANGE)


@pytest.fixture(autouse=True)
def by_level(monkeypatch):
    """Look the reference's TFs up at the renderer's places, and edit soft light on its own grid."""
    cast = reference_light.cast

    def rounded(*arguments):
        rays = cast(*arguments)
        return replace(rays, bins=np.rint(LEVELS_PER_BIN * rays.bins) / LEVELS_PER_BIN)

    monkeypatch.setattr(reference_light, "cast", rounded)
    monkeypatch.setattr(ray_caster, "FINE_FROM", 1)


@pytest.fixture(scope="module")
def renderers(volume):
    every = {
        lighting: RaycastRenderer(volume, lighting, LIGHT, threads=1)
        for lighting in ("none", "direct", "soft")
    }
    yield every
    for renderer in every.values():
        renderer.close()


@pytest.mark.parametrize(
    ("lighting", "step", "tf", "others"),
    [
        *((*case, tf, {}) for case in CASES for tf in TFS),
        *(
            (lighting, 0.5, "random", others)
            for lighting in ("none", "direct", "soft")
            for others in ({"interpolates": False}, {"mask": MASK})
        ),
    ],
)
def test_derivatives_are_those_of_exact_images(renderers, volume, lighting, step, tf, others):
    renderer = renderers[lighting]
    renderer.sample_distance = step
    crop = CropBox((0.1, 0.2, 0.0), (0.9, 0.9, 0.7)) if tf == "random" else None
    # Along a face, where soft light's grid has exact shares of the cells that it cuts.
    clip = ClipPlane((0.0, -1.0, 0.0), 0.1) if lighting == "soft" else ClipPlane((1, -2, 0.5), 0.2)
    others = {**others, "crop": crop, "clip": None if crop is None else clip}
    view = replace(VIEW, is_orthographic=crop is not None)
    inputs = SceneInputs.of(view, tf_of(TFS[tf], COLOR), light=LIGHT, **others)
    found = [
        reference_light.derivative(volume, inputs, SIZE, step, lighting, edit.astype(float))
        for edit in EDITS
    ]
    image, changes = found[0][0][..., :3], np.array([change[..., :3] for _, change in found])
    seen, moved = image[PART], changes[:, *PART]
    norm = np.linalg.norm(seen) or 1.0
    curve = EDITS @ region_sensitivity(renderer, inputs, SIZE, REGION)
    windows = np.array([[3, 13, 2, 11]])
    squares = [renderer.squared_changes(inputs, SIZE, windows, edit[None])[0] for edit in EDITS]
    norms = np.sqrt((moved**2).sum(axis=(1, 2, 3)))
    # At all values they are interpolated between some.
    every = change_norms(renderer, inputs, SIZE, REGION, WIDTH)[np.array(VALUES, int)]
    for ours, exact, tolerance in (
        (np.array([renderer.change(inputs, SIZE, edit) for edit in EDITS]), changes, 1e-3),
        (curve, (seen * moved).sum(axis=(1, 2, 3)) / norm, 1e-3),
        (np.sqrt(squares), norms, 1e-3),
        (every, norms, 0.03),
    ):
        np.testing.assert_allclose(ours, exact, atol=tolerance * np.abs(exact).max() + 1e-9)


def test_edits_together_are_as_edits_alone_and_windows_together_as_their_sum(renderers):
    renderer = renderers["soft"]
    renderer.sample_distance = 0.5
    inputs = SceneInputs.of(VIEW, tf_of(random_opacity(0.5)))
    windows = np.array([[0, 7, 0, 14], [7, 14, 4, 12]])
    together = renderer.squared_changes(inputs, SIZE, windows, EDITS)
    alone = [renderer.squared_changes(inputs, SIZE, windows, edit[None])[0] for edit in EDITS]
    np.testing.assert_allclose(together, alone, rtol=1e-4)
    gradients, energies = renderer.differentiate(inputs, SIZE, windows)
    gradient, energy = renderer.differentiate_together(inputs, SIZE, windows)
    np.testing.assert_allclose(gradients.sum(axis=0), gradient, rtol=1e-5, atol=1e-6)
    assert energies.sum() == pytest.approx(energy)


def test_by_a_coarse_grid_of_light_all_derivatives_are_of_the_same_image(volume, monkeypatch):
    monkeypatch.setattr(ray_caster, "COARSE", 5)
    renderer = RaycastRenderer(volume, "soft", LIGHT, threads=1)
    inputs = replace(SceneInputs.of(VIEW, tf_of(TFS["random"], COLOR)), light=LIGHT)
    fine = region_sensitivity(renderer, inputs, SIZE, REGION)
    with renderer.asking(is_coarsely_lit=True):
        coarse = region_sensitivity(renderer, inputs, SIZE, REGION)
        seen = renderer.render(inputs, SIZE)[PART][..., :3]
        moved = np.array([renderer.change(inputs, SIZE, edit)[PART] for edit in EDITS])
    expected = (seen * moved).sum(axis=(1, 2, 3)) / np.linalg.norm(seen)
    np.testing.assert_allclose(EDITS @ coarse, expected, rtol=1e-3)
    assert cosine(coarse, fine) < 0.99
    np.testing.assert_array_equal(region_sensitivity(renderer, inputs, SIZE, REGION), fine)
    renderer.close()
