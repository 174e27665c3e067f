"""Forward derivatives and visibility, against a second ray caster in float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from test_exact import COLOR, RANGE, SIZE, VIEW, random_opacity, small_volume, tf_of

from model.errors import RenderError
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.raycast.tables import LEVELS_PER_BIN
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting
from model.scene.tf_perturbation import edit_around, response_to_edits
from model.sensitivity.exact import visibility
from tests.reference_raycaster import alphas_of, cast, composite, correct

Array = NDArray[np.float64]
REGION = Region(2, 3, 11, 13)


def single_bin() -> Array:
    opacity = np.zeros(256)
    opacity[100] = 0.5
    return opacity


TFS = {
    "random": random_opacity(0.5),
    "faint": random_opacity(1e-3),
    "nearly opaque": np.full(256, 0.99),
    "single bin": single_bin(),
    "empty": np.zeros(256),
}


def inputs_of(opacity: Array) -> SceneInputs:
    return SceneInputs.of(VIEW, tf_of(opacity))


def samples_of(step: float) -> tuple[Array, Array]:
    """Bin of each sample, and its share of a step."""
    rays = cast(small_volume(), VIEW, SIZE, step)
    return np.rint(LEVELS_PER_BIN * rays.bins) / LEVELS_PER_BIN, rays.shares


@pytest.mark.parametrize("step", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("name", TFS)
def test_a_change_is_the_difference_of_images(name: str, step: float) -> None:
    opacity, samples = TFS[name], samples_of(step)
    color = COLOR.sample(RANGE).astype(np.float64)
    renderer = RaycastRenderer(small_volume(), sample_distance=step)
    for value, width in ((100.0, 0.0), (60.0, 6.0), (250.0, 3.0)):
        edit = edit_around(value, RANGE, width).astype(np.float64)
        h = 1e-6
        # One-sided where there is nothing to take away.
        below = h if (opacity - h * edit >= 0).all() else 0.0
        plus, minus = (
            composite(*samples, correct(opacity + sign * edit, step), color)[..., :3]
            for sign in (h, -below)
        )
        expected = (plus - minus) / (h + below)
        found = renderer.change(inputs_of(opacity), SIZE, edit_around(value, RANGE, width))
        assert found.dtype == np.float32
        # Behind what is nearly opaque, differences are rounding.
        scale = max(np.abs(expected).max(), 1e-3)
        np.testing.assert_allclose(found, expected, atol=5e-4 * scale)
    renderer.close()


@pytest.mark.parametrize("lighting", ["none", "direct"])
def test_forward_and_reverse_agree(lighting: Lighting) -> None:
    renderer = RaycastRenderer(small_volume(), lighting)
    for name in ("random", "faint", "single bin"):
        inputs = inputs_of(TFS[name])
        windows = np.array([[REGION.top, REGION.bottom, REGION.left, REGION.right]])
        gradients, _ = renderer.differentiate(inputs, SIZE, windows)
        rows, columns = slice(REGION.top, REGION.bottom), slice(REGION.left, REGION.right)
        h = 1e-4 * TFS[name].max()
        for value in (60.0, 140.0):
            edit = edit_around(value, RANGE, 6.0)
            change = renderer.change(inputs, SIZE, edit)[rows, columns].astype(np.float64)
            # The renderer shades faint samples together; derivatives shade each.
            image = renderer.render(inputs, SIZE)[rows, columns, :3].astype(np.float64)
            assert gradients[0] @ edit == pytest.approx(
                (image * change).sum(), rel=0.03, abs=h * np.abs(gradients).max()
            )
    renderer.close()


def test_under_direct_light_it_is_the_difference_of_lit_images() -> None:
    renderer = RaycastRenderer(small_volume(), "direct")
    renderer.skip_empty = renderer.terminate_early = False
    # No sample so faint that it shares the shading of another.
    opacity = np.full(256, 0.06)
    unlit = RaycastRenderer(small_volume())
    for value in (60.0, 140.0):
        edit = edit_around(value, RANGE, 6.0).astype(np.float64)
        step = 0.01 / edit.max()
        plus, minus = (
            renderer.render(inputs_of(opacity + sign * step * edit), SIZE) for sign in (0.5, -0.5)
        )
        expected = ((plus - minus) / step)[..., :3]
        found = renderer.change(inputs_of(opacity), SIZE, edit)
        size = np.sqrt(np.mean(expected**2))
        assert np.sqrt(np.mean((found - expected) ** 2)) < 5e-3 * size
        other = unlit.change(inputs_of(opacity), SIZE, edit)
        assert np.sqrt(np.mean((other - expected) ** 2)) > 0.1 * size
    renderer.close()
    unlit.close()


@pytest.mark.parametrize("name", TFS)
def test_visibility_is_what_each_value_adds_to_the_opacity(name: str) -> None:
    opacity = TFS[name]
    bins, shares = (numbers[3:13, 2:11] for numbers in samples_of(0.5))
    at = np.nan_to_num(bins)
    alpha = alphas_of(bins, shares, correct(opacity, 0.5))
    clear = np.cumprod(1 - alpha, axis=-1)
    weight = alpha * np.concatenate([np.ones_like(clear[..., :1]), clear[..., :-1]], axis=-1)
    lower = np.floor(at).astype(int)
    expected = np.zeros(257)
    np.add.at(expected, lower, weight * (1 - (at - lower)))
    np.add.at(expected, lower + 1, weight * (at - lower))
    renderer = RaycastRenderer(small_volume())
    found = visibility(renderer, inputs_of(opacity), SIZE, REGION)
    np.testing.assert_allclose(found, expected[:256] / 90, atol=1e-5)
    image = renderer.opacity_image(inputs_of(opacity), SIZE)[3:13, 2:11]
    assert found.sum() == pytest.approx(image.mean(), abs=2e-3)
    renderer.close()


def test_regions_outside_are_refused() -> None:
    renderer = RaycastRenderer(small_volume())
    with pytest.raises(RenderError, match="outside"):
        visibility(renderer, inputs_of(TFS["random"]), SIZE, Region(0, 0, 15, 2))
    renderer.close()


@pytest.mark.parametrize("width", [0.0, 1.0, 6.0, 40.0])
def test_an_edit_adds_up_to_one_and_matches_the_response(width: float) -> None:
    slopes = np.random.default_rng(0).normal(size=256).astype(np.float32)
    edit = edit_around(128.0, RANGE, width)
    assert edit.sum() == pytest.approx(1, abs=2e-3)
    assert edit @ slopes == pytest.approx(response_to_edits(slopes, width)[128], abs=1e-5)


def test_what_lies_behind_an_opaque_sample_is_lit_too() -> None:
    renderer = RaycastRenderer(small_volume(), "direct")
    opacity = np.clip(2 * random_opacity(0.9), 0, 1)
    assert (opacity == 1).any()
    inputs = inputs_of(opacity)
    windows = np.array([[REGION.top, REGION.bottom, REGION.left, REGION.right]])
    gradients, _ = renderer.differentiate(inputs, SIZE, windows)
    image = renderer.render(inputs, SIZE)[3:13, 2:11, :3].astype(np.float64)
    forward = [
        (image * renderer.change(inputs, SIZE, bin_)[3:13, 2:11]).sum() for bin_ in np.eye(256)
    ]
    np.testing.assert_allclose(gradients[0], forward, atol=1e-2 * np.abs(forward).max())
    renderer.close()
