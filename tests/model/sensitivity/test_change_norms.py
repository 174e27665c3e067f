"""The norm of a region's change by all edits, against the whole Jacobian."""

from __future__ import annotations

import numpy as np
import pytest
from test_exact import VIEW, random_opacity, small_volume, tf_of

from model.rendering.raycast.differentiation import BAND, band_of
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Outline, Region, windows_of
from model.scene.scene import Lighting
from model.scene.tf_perturbation import response_to_edits, spaced_edits
from model.sensitivity import differences
from model.sensitivity.exact import change_norms, region_sensitivity

SIZE = 16
REGION = Region(4, 3, 13, 12)
CLIPPED = np.clip(2 * random_opacity(0.9), 0, 1)


def single_bin() -> np.ndarray:
    opacity = np.zeros(256)
    opacity[100] = 0.5
    return opacity


TFS = {
    "random": random_opacity(0.5),
    "faint": random_opacity(1e-3),
    "saturated": np.full(256, 0.99),
    "clipped": CLIPPED,
    "single bin": single_bin(),
    "empty": np.zeros(256),
}


def jacobian(renderer: RaycastRenderer, inputs: SceneInputs) -> np.ndarray:
    """Change (256, S, S, 3) of the image by every bin, one forward derivative each."""
    return np.stack([renderer.change(inputs, SIZE, bin_) for bin_ in np.eye(256)]).astype(float)


@pytest.mark.parametrize("lighting", ["none", "direct"])
@pytest.mark.parametrize("name", TFS)
def test_it_is_the_norm_of_the_jacobian(name: str, lighting: Lighting) -> None:
    renderer = RaycastRenderer(small_volume(), lighting)
    inputs = SceneInputs.of(VIEW, tf_of(TFS[name]))
    mask = REGION.mask(SIZE)
    single = jacobian(renderer, inputs)[:, mask].reshape(256, -1)
    for width in (0.0, 1.4, 6.0):
        smooth = response_to_edits(single.T.astype(np.float32), width).T
        expected = np.linalg.norm(smooth, axis=1)
        found = change_norms(renderer, inputs, SIZE, REGION, width)
        assert found.dtype == np.float32
        assert expected.max() > 0
        np.testing.assert_allclose(found, expected, atol=0.03 * expected.max())
        bins, _ = spaced_edits(width)
        np.testing.assert_allclose(found[bins], expected[bins], atol=3e-3 * expected.max())
    renderer.close()


@pytest.mark.parametrize("name", ["random", "faint", "empty"])
def test_the_reverse_derivative_is_the_transpose_of_the_forward_one(name: str) -> None:
    renderer = RaycastRenderer(small_volume())
    inputs = SceneInputs.of(VIEW, tf_of(TFS[name]))
    mask = REGION.mask(SIZE)
    forward = jacobian(renderer, inputs)[:, mask]
    image = renderer.render(inputs, SIZE)[mask, :3].astype(float)
    gradients, energies = renderer.differentiate(inputs, SIZE, windows_of(mask))
    scale = np.abs(forward).max() * max(float(image.max()), 1e-3)
    np.testing.assert_allclose(
        gradients.sum(axis=0), (forward * image).sum(axis=(1, 2)), atol=2e-2 * scale
    )
    assert energies.sum() == pytest.approx((image**2).sum(), rel=1e-2, abs=1e-9)
    renderer.close()


def test_a_black_region_may_change_though_its_brightness_has_no_derivative() -> None:
    renderer = RaycastRenderer(small_volume())
    nothing = SceneInputs.of(VIEW, tf_of(np.zeros(256)))
    assert not region_sensitivity(renderer, nothing, SIZE, REGION).any()
    assert change_norms(renderer, nothing, SIZE, REGION, 6.0).max() > 0
    found = differences.region_responses(renderer, nothing, SIZE, REGION, 6.0, "change")
    exact = change_norms(renderer, nothing, SIZE, REGION, 6.0)
    assert np.abs(found - exact).max() < 0.1 * exact.max()
    renderer.close()


def test_differences_are_near_it() -> None:
    renderer = RaycastRenderer(small_volume())
    inputs = SceneInputs.of(VIEW, tf_of(TFS["random"]))
    found = differences.region_responses(renderer, inputs, SIZE, REGION, 6.0, "change")
    exact = change_norms(renderer, inputs, SIZE, REGION, 6.0)
    assert np.abs(found - exact).max() < 0.1 * exact.max()
    renderer.close()


def test_the_parts_of_a_region_add_up() -> None:
    renderer = RaycastRenderer(small_volume())
    inputs = SceneInputs.of(VIEW, tf_of(TFS["random"]))
    whole = change_norms(renderer, inputs, SIZE, Outline(), 0.0)
    lasso = Outline(((0.1, 0.1), (0.9, 0.3), (0.5, 0.95)))
    pixel = Region(7, 8, 8, 9)
    for part in (lasso, pixel):
        mask = part.mask(SIZE)
        inside = change_norms(renderer, inputs, SIZE, part, 0.0)
        outside, _ = (
            renderer.squared_changes(inputs, SIZE, windows_of(m), np.eye(256))
            for m in (~mask, mask)
        )
        np.testing.assert_allclose(
            np.sqrt(inside.astype(float) ** 2 + outside), whole, rtol=1e-4, atol=1e-7
        )
    renderer.close()


def test_edits_by_bin_are_the_edits() -> None:
    for width in (0.0, 1.0, 1.49, 2.9, 6.0, 60.0):
        _, edits = spaced_edits(width)
        band, begin = band_of(edits)
        assert band.shape == (256, BAND)
        for bin_ in (0, 1, 77, 254, 255):
            row = np.zeros(len(edits) + BAND, np.float32)
            row[begin[bin_] : begin[bin_] + BAND] = band[bin_]
            np.testing.assert_array_equal(row[: len(edits)], edits[:, bin_])
    with pytest.raises(ValueError, match="edits change one bin"):
        band_of(np.ones((40, 256)))
