"""Pre-integrated classification: exact along a ramp, however narrow the TF's peak is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from tests.reference_raycaster import render

RANGE = (0.0, 255.0)
WHITE = ColorTF(RANGE, ((0.0, 1.0, 1.0, 1.0),))
RAINBOW = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (100.0, 0.9, 0.8, 0.1), (255.0, 1.0, 0.3, 0.2)))
MODES = OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.2), GaussianMode(220.0, 30.0, 0.5)))
VIEW = View(35.0, 25.0, 7.0, 0.9)
SLOPE = 14.0
"""Values per voxel of the ramps: a bin is far narrower than a sample distance."""


def constant(opacity: float) -> OpacityTF:
    return OpacityTF(RANGE, points=((0.0, opacity),))


def peak(center: float, opacity: float, width: float = 1.0) -> OpacityTF:
    """A TF of one bin: a triangle that ends at the neighbouring bins."""
    points = ((center - width, 0.0), (center, opacity), (center + width, 0.0))
    return OpacityTF(RANGE, points=points)


def ramp(shift: float = 0.0, falling: bool = False) -> Volume:
    """Values that rise along y, the way of the central ray; two corners fix the range."""
    values = SLOPE * (np.arange(18.0) + shift)
    scalars = np.empty((5, 18, 5), np.float32)
    scalars[:] = (values[::-1] if falling else values)[:, None]
    scalars[0, 0, 0], scalars[-1, -1, -1] = RANGE
    return Volume(scalars)


def central(
    volume: Volume, opacity_tf: OpacityTF, color_tf: ColorTF = WHITE, **options
) -> NDArray[np.float32]:
    """The pixel whose ray runs straight along y."""
    return RaycastRenderer(volume, **options).render(SceneInputs(View(), opacity_tf, color_tf), 9)[
        4, 4
    ]


def integrated(opacity_tf: OpacityTF) -> float:
    """Opacity of a ramp over the whole range, by the sum of its extinction."""
    pieces = 1 << 20
    values = (np.arange(pieces) + 0.5) * 255 / pieces
    return 1 - np.exp(np.log1p(-opacity_tf(values)).sum() * 255 / pieces / SLOPE)


@pytest.mark.parametrize("step", [0.3, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("falling", [False, True])
def test_a_peak_of_one_bin_does_not_depend_on_a_shift_below_a_step(
    step: float, falling: bool
) -> None:
    opacity_tf = peak(130.0, 0.9)
    expected = integrated(opacity_tf)
    shifts = np.linspace(0, 1, 9)
    options = {"sample_distance": step}
    found = [
        central(ramp(s, falling), opacity_tf, preintegrated=True, **options)[3] for s in shifts
    ]
    # The last step's share of a peak, whose levels are sixteenths of a bin, is rounded.
    np.testing.assert_allclose(found, expected, rtol=0.015)
    # The test's own control: by samples alone the peak comes and goes.
    sampled = [central(ramp(s, falling), opacity_tf, **options)[3] for s in shifts]
    assert np.abs(np.array(sampled) - expected).max() > expected / 2


@pytest.mark.parametrize("opacity_tf", [peak(130.0, 1.0), peak(90.3, 0.5, 0.4), peak(60, 0.7, 9)])
def test_any_peak_is_its_integral(opacity_tf: OpacityTF) -> None:
    # What a renderer sees of a TF: 256 values, linear in between.
    bins = np.arange(256.0)
    seen = OpacityTF(RANGE, points=tuple(zip(bins.tolist(), opacity_tf(bins), strict=True)))
    found = central(ramp(0.2), opacity_tf, sample_distance=1.0, preintegrated=True)[3]
    assert found == pytest.approx(integrated(seen), rel=2e-3, abs=1e-7)


def test_a_peak_takes_the_colour_that_it_stands_at() -> None:
    color_tf = ColorTF(RANGE, ((0.0, 0.0, 1.0, 0.25), (255.0, 1.0, 0.0, 0.25)))
    pixel = central(ramp(0.4), peak(102.0, 0.8), color_tf, sample_distance=1.0, preintegrated=True)
    assert pixel[3] > 0.05
    np.testing.assert_allclose(pixel[:3] / pixel[3], [0.4, 0.6, 0.25], atol=2e-3)


def test_what_lies_in_front_hides_what_lies_behind() -> None:
    # Two peaks of opacity 1 in one ramp; an opaque bin holds enough to hide the rest.
    points = ((60.0, 0.0), (61.0, 1.0), (100.0, 1.0), (101.0, 0.0), (180.0, 0.0), (181.0, 1.0))
    color_tf = ColorTF(RANGE, ((120.0, 1.0, 0.0, 0.0), (121.0, 0.0, 0.0, 1.0)))
    opacity_tf = OpacityTF(RANGE, points=points)
    rising = central(ramp(), opacity_tf, color_tf, preintegrated=True)
    falling = central(ramp(falling=True), opacity_tf, color_tf, preintegrated=True)
    np.testing.assert_allclose(rising, [1, 0, 0, 1], atol=1e-3)
    np.testing.assert_allclose(falling, [0, 0, 1, 1], atol=1e-3)


@pytest.mark.parametrize("step", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("opacity", [1e-6, 0.2, 1.0])
def test_a_homogeneous_slab_absorbs_exponentially_to_its_last_face(
    step: float, opacity: float
) -> None:
    scalars = np.full((33, 9, 33), 128, np.uint8)
    scalars[0, 0, 0], scalars[-1, -1, -1] = 0, 255
    renderer = RaycastRenderer(Volume(scalars), sample_distance=step, preintegrated=True)
    renderer.skip_empty = False
    alpha = renderer.render(SceneInputs(View(), constant(opacity), WHITE), 33)[16, 16, 3]
    assert alpha == pytest.approx(1 - (1 - opacity) ** 8, rel=1e-5)


@pytest.mark.parametrize(
    ("value", "center", "width"), [(128, 128, 1), (128, 130, 5), (126, 130, 5)]
)
def test_a_homogeneous_region_has_the_opacity_of_its_own_value(
    value: int, center: float, width: float
) -> None:
    scalars = np.full((9, 9, 9), value, np.uint8)
    scalars[0, 0, 0], scalars[-1, -1, -1] = 0, 255
    opacity_tf = peak(center, 0.2, width)
    found = central(Volume(scalars), opacity_tf, preintegrated=True)[3]
    assert found == pytest.approx(1 - (1 - float(opacity_tf(value))) ** 8, rel=0.02)


@pytest.mark.parametrize("view", [VIEW, View(200.0, -60.0, -8.0, 0.3), View(77.0, 0.0, 0.0, 0.02)])
def test_a_smooth_tf_gives_the_image_of_fine_steps(volume: Volume, view: View) -> None:
    fine = render(volume, view, MODES.sample(RANGE), RAINBOW.sample(RANGE), 24, 0.02)
    assert fine[..., 3].max() > 0.2
    renderer = RaycastRenderer(volume, preintegrated=True)
    errors = []
    for step in (0.5, 0.25):
        renderer.sample_distance = step
        errors.append(np.abs(renderer.render(SceneInputs(view, MODES, RAINBOW), 24) - fine))
    assert errors[0].max() < 0.02
    assert errors[0].mean() < 1e-3
    # Half the step, a quarter of the error: values are linear between samples, in truth nearly.
    assert errors[1].mean() < errors[0].mean() / 3


def test_skipping_and_termination_change_less_than_half_a_step_of_8_bits(volume: Volume) -> None:
    big = Volume(np.pad(volume.scalars, ((0, 20), (17, 3), (30, 0))), volume.spacing)
    opacity_tf = OpacityTF(RANGE, points=((60.0, 0.0), (61.0, 0.7), (62.0, 0.0), (255.0, 0.95)))
    renderer = RaycastRenderer(big, preintegrated=True)
    for step in (0.25, 1.0, 4.0):
        renderer.sample_distance = step
        for view in (VIEW, View(200.0, -60.0, 0.0, 0.2)):
            renderer.skip_empty = renderer.terminate_early = True
            fast = renderer.render(SceneInputs(view, opacity_tf, RAINBOW), 24)
            renderer.skip_empty = renderer.terminate_early = False
            whole = renderer.render(SceneInputs(view, opacity_tf, RAINBOW), 24)
            assert np.abs(fast - whole).max() < 1 / 510


def test_the_opacity_image_and_the_frame_are_the_same_picture(volume: Volume) -> None:
    renderer = RaycastRenderer(volume, preintegrated=True)
    image = renderer.render(SceneInputs(VIEW, MODES, RAINBOW), 24)
    np.testing.assert_allclose(
        renderer.opacity_image(SceneInputs(VIEW, MODES, RAINBOW), 24), image[..., 3], atol=1e-6
    )
    frame = renderer.frame(SceneInputs(VIEW, MODES, RAINBOW), 24)
    np.testing.assert_allclose(frame.rgba, image, atol=1e-6)
    visible = np.isfinite(frame.depth)
    np.testing.assert_array_equal(visible, image[..., 3] >= 1 / 255)
    plain = RaycastRenderer(volume).frame(SceneInputs(VIEW, MODES, RAINBOW), 24).depth
    both = visible & np.isfinite(plain)
    # Two samples apart at most, half a voxel of 1.2 units each.
    assert both.any()
    assert np.abs(frame.depth[both] - plain[both]).max() < 1.3


def test_an_empty_tf_gives_the_background(volume: Volume) -> None:
    renderer = RaycastRenderer(volume, preintegrated=True)
    assert not renderer.render(SceneInputs(VIEW, OpacityTF(RANGE), RAINBOW), 16).any()
    renderer.skip_empty = False
    assert not renderer.render(SceneInputs(VIEW, OpacityTF(RANGE), RAINBOW), 16).any()
