"""Exact sensitivities against central differences of rendered images, over volumes, TFs, light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from blobs import blobs
from numpy.typing import NDArray
from ramp import make_volume
from test_exact import random_opacity, small_volume

from model.rendering.raster import Raster, middle_square
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Outline, Region
from model.scene.scene import Lighting
from model.scene.tf_perturbation import edit_around, response_to_edits
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.exact import change_norms, region_sensitivity, visibility

SIZE = 24
WIDTH = 6.0
REGION = Region(4, 3, 20, 21)
VIEW = View(35.0, 25.0, 7.0, 0.9)


def noise() -> Volume:
    """Smoothed noise of 16 bits, negative values among them."""
    values = np.random.default_rng(0).normal(size=(13, 16, 11))
    for axis in range(3):
        values = (values + np.roll(values, 1, axis) + np.roll(values, -1, axis)) / 3
    return Volume(np.rint(4000 * values).astype(np.int16), (1.0, 1.3, 0.7))


VOLUMES: dict[str, Callable[[], Volume]] = {
    "blobs": blobs,
    "small": small_volume,
    "ramp": make_volume,
    "noise": noise,
}


def single_bin() -> NDArray[np.float64]:
    opacity = np.zeros(256)
    opacity[100] = 0.5
    return opacity


TFS = {
    "random": random_opacity(0.5),
    "faint": random_opacity(0.02),
    "saturated": np.full(256, 0.97),
    "clipped": np.minimum(0.02 + 1.5 * np.exp(-((np.arange(256) - 110) ** 2) / 800), 1),
    "single bin": single_bin(),
    "empty": np.zeros(256),
}


def inputs_over(volume: Volume, opacity: NDArray[np.float64]) -> SceneInputs:
    lo, hi = volume.scalar_range
    values = np.linspace(lo, hi, 256).tolist()
    points = tuple(zip(values, opacity.tolist(), strict=True))
    color = ColorTF((lo, hi), ((lo, 0.2, 0.3, 0.9), (hi, 1.0, 0.6, 0.2)))
    return SceneInputs(VIEW, OpacityTF((lo, hi), points=points), color)


def difference(
    renderer: RaycastRenderer, volume: Volume, opacity: NDArray, edit: NDArray, lit: bool
) -> NDArray[np.float64]:
    """Change of the image per unit of an edit; one-sided where opacities have no room.

    The steps are large in lit images: samples fainter than that share their shading there.
    """
    step = min(0.04 if lit else 1e-3, max(1 - opacity.max(), 0.01)) / edit.max()
    above = step if (opacity + step * edit <= 1).all() else 0.0
    below = step if (opacity - step * edit >= 0).all() else 0.0
    images = [
        renderer.render(inputs_over(volume, np.clip(opacity + change * edit, 0, 1)), SIZE)
        for change in (above, -below)
    ]
    return (images[0][..., :3].astype(float) - images[1][..., :3]) / (above + below)


@pytest.mark.parametrize("lighting", ["none", "direct"])
@pytest.mark.parametrize(
    "name", ["blobs", "small", "ramp", pytest.param("noise", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("tf", TFS)
def test_fields_and_plots_are_differences_of_images(name: str, tf: str, lighting: Lighting) -> None:
    volume, opacity = VOLUMES[name](), TFS[tf]
    # At this sample distance the derivative is there for opaque samples, too.
    renderer = RaycastRenderer(volume, lighting, sample_distance=1.0)
    renderer.skip_empty = renderer.terminate_early = False
    inputs = inputs_over(volume, opacity)
    mask = REGION.mask(SIZE)
    image = renderer.render(inputs, SIZE)[mask, :3].astype(float)
    brightness = response_to_edits(region_sensitivity(renderer, inputs, SIZE, REGION), WIDTH)
    sizes = change_norms(renderer, inputs, SIZE, REGION, WIDTH)
    values = np.linspace(*volume.scalar_range, 256)
    tolerance = 0.02 if lighting == "none" else 0.1
    if lighting == "direct" and opacity.max() > 0.9:
        # What shows behind nearly opaque samples is faint, and shares its shading.
        tolerance = 0.3
    # Where opacity is 1, the derivative of the last, shorter sample of a ray is clamped.
    for bin_ in (60, 200) if tf == "clipped" else (60, 100, 148, 200):
        edit = edit_around(values[bin_], volume.scalar_range, WIDTH)
        expected = difference(renderer, volume, opacity, edit.astype(float), lighting == "direct")
        found = renderer.change(inputs, SIZE, edit)
        size = np.linalg.norm(expected)
        assert np.linalg.norm(found - expected) <= tolerance * size + 5e-3
        inside = expected[mask]
        scale = max(float(np.linalg.norm(inside)), 0.1)
        assert sizes[bin_] == pytest.approx(np.linalg.norm(inside), abs=tolerance * scale)
        if tf == "empty":
            assert not brightness.any() and sizes.any()
        else:
            slope = (image * inside).sum() / np.linalg.norm(image)
            assert brightness[bin_] == pytest.approx(slope, abs=tolerance * scale)
    renderer.close()


@pytest.mark.parametrize("raster", [Raster(40, 24), Raster(24, 40)])
def test_a_wider_image_has_the_square_ones_answers_in_its_middle(raster: Raster) -> None:
    """And beside it, those of its own pixels: seen from near, the volume reaches there."""
    volume = blobs()
    renderer = RaycastRenderer(volume, "direct", sample_distance=1.0)
    inputs = replace(inputs_over(volume, random_opacity(0.5)), view=View(35.0, 25.0, 0.0, 0.25))
    edit = edit_around(float(np.mean(volume.scalar_range)), volume.scalar_range, WIDTH)
    wide = renderer.change(inputs, raster, edit)
    assert wide.shape == (raster.rows, raster.columns, 3)
    square = renderer.change(inputs, SIZE, edit)
    np.testing.assert_allclose(middle_square(wide), square, atol=2e-5)
    # A region beside the square is the same one of the panned square image.
    shift = 8 / SIZE
    over = raster.width > raster.height
    beside = (
        Outline.rectangle(0.9, 0.3, 1.3, 0.8) if over else Outline.rectangle(0.3, 0.9, 0.8, 1.3)
    )
    panned = replace(
        inputs,
        view=replace(inputs.view, **({"pan_x": -2 * shift} if over else {"pan_y": 2 * shift})),
    )
    moved = beside.moved(*((-shift, 0.0) if over else (0.0, -shift)))
    for answer in (
        lambda *asked: region_sensitivity(renderer, *asked),
        lambda *asked: change_norms(renderer, *asked, WIDTH),
        lambda *asked: visibility(renderer, *asked),
    ):
        found, expected = answer(inputs, raster, beside), answer(panned, SIZE, moved)
        assert np.abs(expected).max() > 0
        np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())
    renderer.close()
