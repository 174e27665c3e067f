"""The renderer's sensitivity against differences of a second ray caster in float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.opacity_correction import NEARLY_OPAQUE
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.raycast.tables import LEVELS_PER_BIN
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.exact import region_sensitivity, sensitivity_field
from tests.reference_raycaster import cast, composite, correct

RANGE = (0.0, 255.0)
VIEW = View(35.0, 25.0, 7.0, 0.6)
SIZE = 14
REGION = Region(2, 3, 11, 13)

Array = NDArray[np.float64]


def colors() -> ColorTF:
    rng = np.random.default_rng(4)
    stops = ((float(value), *rng.random(3).tolist()) for value in np.linspace(*RANGE, 9))
    return ColorTF(RANGE, tuple(stops))


COLOR = colors()


def tf_of(opacity: Array, color: ColorTF = COLOR) -> TransferFunction:
    """A TF with these opacities at the 256 values."""
    values = np.linspace(*RANGE, 256).tolist()
    points = tuple(zip(values, np.asarray(opacity).tolist(), strict=True))
    return TransferFunction(OpacityTF(RANGE, points=points), color)


def small_volume() -> Volume:
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (9, 12, 10)), indexing="ij")
    values = np.exp(-((x - 0.2) ** 2 + y**2 + (z + 0.3) ** 2) / 0.5)
    values += 0.6 * np.exp(-((x + 0.5) ** 2 + (y - 0.4) ** 2 + (z - 0.4) ** 2) / 0.2)
    values += 0.1 * np.sin(3 * x + 3 * y) * np.cos(4 * z)
    values = (values - values.min()) / np.ptp(values)
    return Volume(np.rint(255 * values).astype(np.uint8), (1.2, 0.8, 1.0))


@pytest.fixture(scope="module")
def renderer() -> RaycastRenderer:
    return RaycastRenderer(small_volume(), threads=2)


@pytest.fixture
def at_step(renderer: RaycastRenderer, request: pytest.FixtureRequest) -> RaycastRenderer:
    renderer.sample_distance = getattr(request, "param", 0.5)
    return renderer


steps = pytest.mark.parametrize("at_step", [0.5, 1.0, 2.0], indirect=True)


class Reference:
    """The norm of a region in float64, as a function of the TF."""

    def __init__(self, renderer: RaycastRenderer, region: Region = REGION) -> None:
        self.step = renderer.sample_distance
        rays = cast(small_volume(), VIEW, SIZE, self.step)
        within = slice(region.top, region.bottom), slice(region.left, region.right)
        bins, self.shares = rays.bins[within], rays.shares[within]
        # The renderer's tables hold some values per bin of the TF, the nearest of which counts.
        self.bins = np.rint(LEVELS_PER_BIN * bins) / LEVELS_PER_BIN

    def norm(self, per_sample: Array) -> float:
        image = composite(
            self.bins, self.shares, per_sample, COLOR.sample(RANGE).astype(np.float64)
        )
        return float(np.sqrt((image[..., :3] ** 2).sum()))

    def differences(self, opacity: Array, below: float = 1e-6, above: float = 1e-6) -> Array:
        """The derivative by differences; one-sided where one of the two steps is 0."""
        return self._differences(opacity, lambda o: self.norm(correct(o, self.step)), below, above)

    def per_sample_differences(self, per_sample: Array) -> Array:
        """The derivative by the opacities of a sample, from below."""
        return self._differences(per_sample, self.norm, 1e-6, 0.0)

    def _differences(self, values: Array, norm, below: float, above: float) -> Array:
        slopes = np.empty(256)
        for i in range(256):
            lower, upper = values.copy(), values.copy()
            lower[i] -= below
            upper[i] += above
            slopes[i] = (norm(upper) - norm(lower)) / (below + above)
        return slopes


def sensitivity(renderer: RaycastRenderer, opacity: Array) -> NDArray[np.float32]:
    return region_sensitivity(renderer, SceneInputs.of(VIEW, tf_of(opacity)), SIZE, REGION)


def assert_close(found: Array, expected: Array, tolerance: float = 5e-4) -> None:
    assert found.dtype == np.float32
    scale = np.abs(expected).max()
    assert scale > 0
    np.testing.assert_allclose(found / scale, expected / scale, atol=tolerance)


def random_opacity(highest: float) -> Array:
    values = highest * np.random.default_rng(1).random(256)
    return values.astype(np.float32).astype(np.float64)


@steps
@pytest.mark.parametrize("highest", [0.9, 0.05, 1e-3, 4e-6])
def test_any_tf(at_step: RaycastRenderer, highest: float) -> None:
    opacity = random_opacity(highest)
    difference = 1e-4 * highest * max(highest, 1e-3)
    expected = Reference(at_step).differences(opacity, difference, difference)
    assert_close(sensitivity(at_step, opacity), expected)


@steps
def test_a_nearly_opaque_tf(at_step: RaycastRenderer) -> None:
    opacity = np.full(256, np.float32(0.99), np.float64)
    assert_close(sensitivity(at_step, opacity), Reference(at_step).differences(opacity))


@pytest.mark.parametrize("at_step", [1.0], indirect=True)
def test_an_opaque_tf_is_exact_at_a_step_of_one_voxel(at_step: RaycastRenderer) -> None:
    opacity = np.ones(256)
    expected = Reference(at_step).differences(opacity, above=0.0)
    assert_close(sensitivity(at_step, opacity), expected)


@pytest.mark.parametrize("at_step", [2.0], indirect=True)
def test_an_opaque_tf_has_no_derivative_at_longer_steps(at_step: RaycastRenderer) -> None:
    # 1 - (1 - a)^2 is flat at a = 1.
    assert not sensitivity(at_step, np.ones(256)).any()


@pytest.mark.parametrize("at_step", [0.5], indirect=True)
def test_an_opaque_tf_at_shorter_steps_counts_as_the_last_one_below(
    at_step: RaycastRenderer,
) -> None:
    by_sample = Reference(at_step).per_sample_differences(np.ones(256))
    expected = by_sample * 0.5 * (1 - NEARLY_OPAQUE) ** -0.5
    assert_close(sensitivity(at_step, np.ones(256)), expected)


@pytest.mark.parametrize("at_step", [1.0], indirect=True)
def test_opaque_from_some_value_on(at_step: RaycastRenderer) -> None:
    opacity = (np.arange(256) >= 90).astype(np.float64)
    found, reference = sensitivity(at_step, opacity), Reference(at_step)
    # Up from 0, down from 1.
    assert_close(found[:90], reference.differences(opacity, below=0.0)[:90])
    assert_close(found[90:], reference.differences(opacity, above=0.0)[90:])


@pytest.mark.parametrize("at_step", [0.25, 0.5], indirect=True)
def test_a_tf_of_one_bin(at_step: RaycastRenderer) -> None:
    opacity = np.zeros(256)
    opacity[100] = 0.5
    expected = Reference(at_step).differences(opacity, below=0.0)
    expected[100] = Reference(at_step).differences(opacity)[100]
    found = sensitivity(at_step, opacity)
    assert_close(found, expected)
    # What is transparent can be made visible: it counts, too.
    assert np.count_nonzero(found) > 100


def test_a_black_region_has_none(at_step: RaycastRenderer) -> None:
    for tf in (tf_of(np.zeros(256)), tf_of(np.ones(256), ColorTF(RANGE, ((0.0, 0.0, 0.0, 0.0),)))):
        found = region_sensitivity(at_step, SceneInputs.of(VIEW, tf), SIZE, REGION)
        np.testing.assert_array_equal(found, 0)
        field = sensitivity_field(at_step, SceneInputs.of(VIEW, tf), SIZE, 5)
        np.testing.assert_array_equal(field, 0)


def test_a_region_beside_the_volume_has_none(at_step: RaycastRenderer) -> None:
    far = View(35.0, 25.0, 7.0, 3.0)
    corner = Region(0, 0, 2, 2)
    assert not region_sensitivity(
        at_step, SceneInputs.of(far, tf_of(np.ones(256))), SIZE, corner
    ).any()
    assert region_sensitivity(
        at_step, SceneInputs.of(far, tf_of(np.ones(256))), SIZE, Region(0, 0, 14, 14)
    ).any()


def test_brightening_a_dark_region_raises_its_norm(at_step: RaycastRenderer) -> None:
    # Black is the lowest norm there is: more opacity of a bright value is more light.
    white = ColorTF(RANGE, ((0.0, 1.0, 1.0, 1.0),))
    dark = np.full(256, 0.01)
    found = region_sensitivity(at_step, SceneInputs.of(VIEW, tf_of(dark, white)), SIZE, REGION)
    assert (found >= 0).all() and found.max() > 0
    image = at_step.render(SceneInputs(VIEW, tf_of(dark, white).opacity, white), SIZE)
    brighter = at_step.render(SceneInputs(VIEW, tf_of(dark + 1e-3, white).opacity, white), SIZE)
    rows, columns = slice(REGION.top, REGION.bottom), slice(REGION.left, REGION.right)
    norms = [np.linalg.norm(i[rows, columns, :3].astype(np.float64)) for i in (image, brighter)]
    assert norms[1] - norms[0] == pytest.approx(1e-3 * found.sum(), rel=0.05)


@pytest.mark.parametrize("block", [1, 4, 5, 14])
def test_blocks_add_up_to_the_whole_image(at_step: RaycastRenderer, block: int) -> None:
    tf = tf_of(random_opacity(0.5))
    field = sensitivity_field(at_step, SceneInputs.of(VIEW, tf), SIZE, block)
    count = -(-SIZE // block)
    assert (field.shape, field.dtype) == ((count, count, 256), np.float32)
    at_step.skip_empty = at_step.terminate_early = False
    image = at_step.render(SceneInputs(VIEW, tf.opacity, tf.color), SIZE)[..., :3].astype(
        np.float64
    )
    at_step.skip_empty = at_step.terminate_early = True
    total = np.zeros(256)
    for row, column in np.ndindex(count, count):
        top, left = row * block, column * block
        norm = np.linalg.norm(image[top : top + block, left : left + block])
        total += norm * field[row, column]
    whole = region_sensitivity(at_step, SceneInputs.of(VIEW, tf), SIZE, Region(0, 0, SIZE, SIZE))
    # Half the square's derivative is a sum over pixels; the norm divides it by itself.
    assert_close((total / np.linalg.norm(image)).astype(np.float32), whole, 1e-4)


def test_a_block_is_a_region(at_step: RaycastRenderer) -> None:
    tf = tf_of(random_opacity(0.5))
    field = sensitivity_field(at_step, SceneInputs.of(VIEW, tf), SIZE, 5)
    for row, column in ((0, 1), (1, 1), (1, 2), (2, 2)):
        left, top = 5 * column, 5 * row
        region = Region(left, top, min(left + 5, SIZE), min(top + 5, SIZE))
        expected = region_sensitivity(at_step, SceneInputs.of(VIEW, tf), SIZE, region)
        np.testing.assert_allclose(field[row, column], expected, rtol=1e-4, atol=1e-6)


def test_energies_are_those_of_the_image(at_step: RaycastRenderer) -> None:
    tf = TransferFunction(OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.4),)), COLOR)
    windows = np.array([[0, 14, 0, 14], [3, 9, 2, 5], [0, 1, 0, 1]])
    _, energies = at_step.differentiate(SceneInputs(VIEW, tf.opacity, tf.color), SIZE, windows)
    image = at_step.render(SceneInputs(VIEW, tf.opacity, tf.color), SIZE)[..., :3].astype(
        np.float64
    )
    for (top, bottom, left, right), energy in zip(windows, energies, strict=True):
        expected = (image[top:bottom, left:right] ** 2).sum()
        assert energy == pytest.approx(expected, rel=5e-3, abs=1e-5)


@pytest.mark.parametrize(
    "region",
    [
        Region(-1, 0, 4, 4),
        Region(0, -1, 4, 4),
        Region(0, 0, 15, 4),
        Region(0, 0, 4, 15),
        Region(4, 0, 4, 4),
        Region(0, 5, 4, 4),
    ],
)
def test_regions_outside_the_image_or_empty_are_refused(
    renderer: RaycastRenderer, region: Region
) -> None:
    with pytest.raises(RenderError, match="empty or outside the image of 14 x 14 pixels"):
        region_sensitivity(renderer, SceneInputs.of(VIEW, tf_of(np.ones(256))), SIZE, region)


@pytest.mark.parametrize("block", [0, -3, 15])
def test_blocks_that_do_not_fit_are_refused(renderer: RaycastRenderer, block: int) -> None:
    with pytest.raises(RenderError, match="give 1 to 14"):
        sensitivity_field(renderer, SceneInputs.of(VIEW, tf_of(np.ones(256))), SIZE, block)


def test_a_region_is_read_from_text() -> None:
    assert Region.parse("100,80, 140,120") == Region(100, 80, 140, 120)
    for text in ("", "1,2,3", "1,2,3,4,5", "1,2,3,x", "1.5,2,3,4"):
        with pytest.raises(RenderError, match="is not a region; give left,top,right,bottom"):
            Region.parse(text)
