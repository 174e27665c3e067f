"""Exact derivatives against the complex-step derivative of the 64-bit reference: one table."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from ramp import byte_volume, make_tf

from model.errors import RenderError
from model.rendering.raster import BLUR, Raster, middle_square
from model.rendering.raycast import renderer as ray_caster
from model.rendering.raycast.classification import FADES, LEVELS_PER_BIN
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.region import Outline, Region, windows_of
from model.scene.scene import LightDirection
from model.scene.tf_perturbation import edit_around, response_to_edits
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.display import cosine
from model.sensitivity.exact import (
    block_fields,
    change_norms,
    region_sensitivity,
    sensitivity_field,
    visibility,
)
from tests import reference_light
from tests.reference_raycaster import alphas_of, cast, correct

RANGE = (0.0, 255.0)
VIEW = View(35.0, 25.0, 7.0, 0.6)
SIZE = 14
REGION = Region(2, 3, 11, 13)


def colors():
    rng = np.random.default_rng(4)
    stops = ((float(value), *rng.random(3).tolist()) for value in np.linspace(*RANGE, 9))
    return ColorTF(RANGE, tuple(stops))


COLOR = colors()


def tf_of(opacity, color=COLOR):
    """A TF with these opacities at the 256 values."""
    values = np.linspace(*RANGE, 256).tolist()
    points = tuple(zip(values, np.asarray(opacity).tolist(), strict=True))
    return TransferFunction(OpacityTF(RANGE, points=points), color)


def small_volume():
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (9, 12, 10)), indexing="ij")
    values = np.exp(-((x - 0.2) ** 2 + y**2 + (z + 0.3) ** 2) / 0.5)
    values += 0.6 * np.exp(-((x + 0.5) ** 2 + (y - 0.4) ** 2 + (z - 0.4) ** 2) / 0.2)
    values += 0.1 * np.sin(3 * x + 3 * y) * np.cos(4 * z)
    values = (values - values.min()) / np.ptp(values)
    return Volume(np.rint(255 * values).astype(np.uint8), (1.2, 0.8, 1.0))


@pytest.fixture(scope="module")
def renderer():
    return RaycastRenderer(small_volume(), threads=2)


def random_opacity(highest):
    values = highest * np.random.default_rng(1).random(256)
    return values.astype(np.float32).astype(np.float64)


def test_a_black_region_has_none(renderer):
    far = replace(VIEW, distance=3.0)
    black = ColorTF(RANGE, ((0.0, 0.0, 0.0, 0.0),))
    for view, tf, region in (
        (VIEW, tf_of(np.zeros(256)), REGION),
        (VIEW, tf_of(np.ones(256), black), REGION),
        (far, tf_of(np.ones(256)), Region(0, 0, 2, 2)),
    ):
        inputs = SceneInputs.of(view, tf)
        assert not region_sensitivity(renderer, inputs, SIZE, region).any()
        assert sensitivity_field(renderer, inputs, SIZE, 5).any() == (view is far)


def test_a_block_is_a_region(renderer):
    tf = tf_of(random_opacity(0.5))
    field = sensitivity_field(renderer, SceneInputs.of(VIEW, tf), SIZE, 5)
    for row, column in ((0, 1), (1, 1), (1, 2), (2, 2)):
        left, top = 5 * column, 5 * row
        region = Region(left, top, min(left + 5, SIZE), min(top + 5, SIZE))
        expected = region_sensitivity(renderer, SceneInputs.of(VIEW, tf), SIZE, region)
        np.testing.assert_allclose(field[row, column], expected, rtol=1e-4, atol=1e-6)


OUTSIDE = (-1, 0, 4, 4), (0, -1, 4, 4), (0, 0, 15, 4), (0, 0, 4, 15)
EMPTY = (4, 0, 4, 4), (0, 5, 4, 4)


def test_regions_outside_the_image_or_empty_and_blocks_that_do_not_fit_are_refused(renderer):
    inputs = SceneInputs.of(VIEW, tf_of(np.ones(256)))
    for sides in (*OUTSIDE, *EMPTY):
        with pytest.raises(RenderError, match="empty or outside the image of 14 x 14 pixels"):
            region_sensitivity(renderer, inputs, SIZE, Region(*sides))
    for block in (0, -3, 15):
        with pytest.raises(RenderError, match="give 1 to 14"):
            sensitivity_field(renderer, inputs, SIZE, block)


@pytest.mark.parametrize("highest", [0.0, 1e-3, 0.5, 1.0])
def test_visibility_is_what_each_value_adds_to_the_opacity(renderer, highest):
    opacity = random_opacity(highest)
    rays = cast(small_volume(), VIEW, SIZE, 0.5)
    bins = np.rint(LEVELS_PER_BIN * rays.bins[3:13, 2:11]) / LEVELS_PER_BIN
    shares = rays.shares[3:13, 2:11]
    at = np.nan_to_num(bins)
    alpha = alphas_of(bins, shares, correct(opacity, 0.5))
    clear = np.cumprod(1 - alpha, axis=-1)
    weight = alpha * np.concatenate([np.ones_like(clear[..., :1]), clear[..., :-1]], axis=-1)
    lower = np.floor(at).astype(int)
    expected = np.zeros(257)
    np.add.at(expected, lower, weight * (1 - (at - lower)))
    np.add.at(expected, lower + 1, weight * (at - lower))
    inputs = SceneInputs.of(VIEW, tf_of(opacity))
    found = visibility(renderer, inputs, SIZE, REGION)
    np.testing.assert_allclose(found, expected[:256] / 90, atol=1e-5)
    image = renderer.render(inputs, SIZE)[3:13, 2:11, 3]
    assert found.sum() == pytest.approx(image.mean(), abs=2e-3)


@pytest.mark.parametrize("width", [0.0, 1.0, 6.0, 40.0])
def test_an_edit_adds_up_to_one_and_matches_the_response(width):
    slopes = np.random.default_rng(0).normal(size=256).astype(np.float32)
    edit = edit_around(128.0, RANGE, width)
    assert edit.sum() == pytest.approx(1, abs=2e-3)
    assert edit @ slopes == pytest.approx(response_to_edits(slopes, width)[128], abs=1e-5)


@pytest.mark.parametrize("raster", [Raster(40, 24), Raster(24, 40)])
def test_a_wider_image_has_the_square_ones_answers_in_its_middle(raster):
    """And beside it, those of its own pixels: seen from near, the volume reaches there."""
    renderer = RaycastRenderer(small_volume(), "direct", sample_distance=1.0)
    inputs = SceneInputs.of(View(35.0, 25.0, 0.0, 0.25), tf_of(random_opacity(0.5)))
    edit = edit_around(127.5, RANGE, 6.0)
    wide = renderer.change(inputs, raster, edit)
    assert wide.shape == (raster.rows, raster.columns, 3)
    square = renderer.change(inputs, 24, edit)
    np.testing.assert_allclose(middle_square(wide), square, atol=2e-5)
    # A region beside the square is the same one of the panned square image.
    shift = 8 / 24
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
        lambda *asked: change_norms(renderer, *asked, 6.0),
        lambda *asked: visibility(renderer, *asked),
    ):
        found, expected = answer(inputs, raster, beside), answer(panned, 24, moved)
        assert np.abs(expected).max() > 0
        np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())


def test_the_parts_of_a_region_add_up():
    renderer = RaycastRenderer(small_volume())
    inputs = SceneInputs.of(VIEW, tf_of(random_opacity(0.5)))
    whole = change_norms(renderer, inputs, 16, Outline(), 0.0)
    lasso = Outline(((0.1, 0.1), (0.9, 0.3), (0.5, 0.95)))
    pixel = Region(7, 8, 8, 9)
    for part in (lasso, pixel):
        mask = part.mask(16)
        inside = change_norms(renderer, inputs, 16, part, 0.0)
        windows = map(windows_of, (~mask, mask))
        outside, _ = (renderer.squared_changes(inputs, 16, w, np.eye(256)) for w in windows)
        np.testing.assert_allclose(
            np.sqrt(inside.astype(float) ** 2 + outside), whole, rtol=1e-4, atol=1e-7
        )


def block_norms(image, blocks):
    """Norm of the colours of each block."""
    side = len(image) // blocks
    parts = image.astype(np.float64).reshape(blocks, side, blocks, side, 3)
    return np.sqrt((parts**2).sum(axis=(1, 3, 4)))


@pytest.mark.parametrize("lighting", ["none", "soft"])
def test_fields_hold_how_the_norm_of_each_block_changes(lighting):
    inputs, width = SceneInputs.of(View(40, 20, 3, 1.0), make_tf()), 6.0
    renderer = RaycastRenderer(byte_volume(), lighting, threads=1, sample_distance=1.0)
    fields = block_fields(renderer, inputs, 16, 4, width)
    edit = edit_around(150.0, (100.0, 200.0), width).astype(np.float64)
    change = renderer.change(inputs, 16, edit.astype(np.float32))
    image = renderer.render(inputs, 16)[..., :3].astype(np.float64)
    # The norm's derivative is the change along the image.
    h = 1e-4
    expected = (block_norms(image + h * change, 4) - block_norms(image - h * change, 4)) / (2 * h)
    ours = fields[..., round(255 * 0.5)]
    np.testing.assert_allclose(ours, expected, atol=2e-2 * np.abs(expected).max())


PART = slice(3, 13), slice(2, 11)
LIGHT = LightDirection(-40.0, 30.0)
VALUES, WIDTH = (60.0, 110.0, 220.0), 6.0
EDITS = np.array([edit_around(value, RANGE, WIDTH) for value in VALUES])

MASK = Mask.of(np.random.default_rng(4).random((9, 12, 10)) < 0.7)

CASES = [*(("none", step) for step in (0.5, 1.0, 2.0)), ("direct", 0.5), ("soft", 0.5)]
"""Lights and sample distances."""


TFS = {
    "random": random_opacity(0.9),
    "faint": random_opacity(1e-3),
    "nearly nothing": random_opacity(4e-6),
    "nothing": np.zeros(256),
    "nearly opaque": np.full(256, 0.99),
    "opaque": np.ones(256),
    "opaque from some value on": (np.arange(256) >= 90).astype(float),
    "one bin": 0.5 * np.eye(256)[100],
}


@pytest.fixture(scope="module")
def volume():
    """Blobs, some voxels of which are missing, and values of which lie beyond the range."""
    small = small_volume()
    missing = np.zeros(small.voxels.shape, bool)
    missing[3:6, 4:7, 2:6] = True
    return Volume(small.voxels, small.spacing, missing=missing).over((30.0, 220.0))


@pytest.fixture
def by_level(monkeypatch):
    """Look the reference's TFs up at the renderer's places, and edit soft light on its own grid."""
    cast = reference_light.cast

    def rounded(*arguments):
        rays = cast(*arguments)
        bins = np.rint(LEVELS_PER_BIN * rays.bins) / LEVELS_PER_BIN
        kept = None if rays.kept is None else np.rint(FADES * rays.kept) / FADES
        return replace(rays, bins=bins, kept=kept)

    monkeypatch.setattr(reference_light, "cast", rounded)
    monkeypatch.setattr(ray_caster, "FINE_FROM", 1)


@pytest.fixture(scope="module")
def renderers(volume):
    return {
        lighting: RaycastRenderer(volume, lighting, LIGHT, threads=1)
        for lighting in ("none", "direct", "soft")
    }


@pytest.mark.parametrize(
    ("lighting", "step", "tf", "others"),
    [
        *((*case, tf, {}) for case in CASES for tf in TFS),
        *(
            (lighting, 0.5, "random", others)
            for lighting in ("none", "direct", "soft")
            for others in ({"interpolates": False}, {"mask": MASK}, {"blur": BLUR})
        ),
        *(("none", *each, {"mask": MASK}) for each in product((0.5, 2.0), ("nothing", "opaque"))),
    ],
)
def test_derivatives_are_those_of_exact_images(
    renderers, volume, lighting, step, tf, others, by_level, monkeypatch
):
    renderer = renderers[lighting]
    renderer.sample_distance = step
    crop = CropBox((0.1, 0.2, 0.0), (0.9, 0.9, 0.7)) if tf == "random" else None
    # Along a face, where soft light's grid has exact shares of the cells that it cuts.
    clip = ClipPlane((0.0, -1.0, 0.0), 0.1) if lighting == "soft" else ClipPlane((1, -2, 0.5), 0.2)
    others = {"blur": 0.0, **others, "crop": crop, "clip": None if crop is None else clip}
    blur = others.pop("blur")
    monkeypatch.setattr(ray_caster, "blur_of", lambda *_: blur)
    monkeypatch.setattr(reference_light, "BLUR", blur)
    monkeypatch.setattr(reference_light, "NODE_BLUR", blur / 2)
    view = replace(VIEW, is_orthographic=crop is not None)
    inputs = SceneInputs.of(view, tf_of(TFS[tf], COLOR), light=LIGHT, **others)
    given = volume, inputs, SIZE, step, lighting
    found = [reference_light.derivative(*given, edit.astype(float)) for edit in EDITS]
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


def test_edits_together_are_as_edits_alone_and_windows_together_as_their_sum(renderers, by_level):
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


def test_by_a_coarse_grid_of_light_all_derivatives_are_of_the_same_image(
    volume, monkeypatch, by_level
):
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
