import numpy as np
import pytest
from drawing import VIEW, drawn, rms

from model.rendering.raycast.classification import LEVELS_PER_BIN
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF
from model.scene.volume import Volume
from tests.reference_raycaster import cast, composite, correct, render

SIZE = 64
KINDS = RaycastRenderer, VtkRenderer
RANGES = [
    (40.0, 60.0), (49.75, 51.0), (-100.0, 45.0), (90.0, 1090.0), (-900.0, 1000.0), (0.0, 100.0),
]  # fmt: skip
"""Narrow, between two voxels, cut off at one end, beyond one end, wide, and the voxels' own."""


def ramp(dtype="float32", count=11):
    """A volume that rises from 0 to 100 along x, in a few steps; linear between them."""
    return Volume(np.broadcast_to(np.linspace(0, 100, count), (12, 14, count)).astype(dtype))


def noise(dtype):
    """Voxels without any relation to their neighbours, from 0 to 100."""
    voxels = np.random.default_rng(5).integers(0, 101, (9, 10, 11))
    voxels[0, 0, :2] = 0, 100
    return Volume(voxels.astype(dtype))


def inputs_over(scalar_range, view=VIEW, opacity=0.3):
    """A TF whose colour tells the value, and that shows all values, the ends' the most."""
    lo, hi = scalar_range
    middle = (lo + hi) / 2
    points = ((lo, opacity), (middle, opacity / 4), (hi, opacity / 2))
    return SceneInputs(
        view,
        OpacityTF(scalar_range, points=points),
        ColorTF(scalar_range, ((lo, 0.0, 0.2, 1.0), (middle, 0.2, 1.0, 0.3), (hi, 1.0, 0.1, 0.0))),
    )


@pytest.mark.parametrize("dtype", ["uint8", "float32"])
@pytest.mark.parametrize("chosen", RANGES)
@pytest.mark.parametrize("make", [ramp, noise])
def test_what_lies_between_voxels_is_what_it_is_over_any_range(dtype, chosen, make):
    volume = make(dtype).over(chosen)
    inputs = inputs_over(chosen)
    opacity, color = inputs.opacity_tf.sample(), inputs.color_tf.sample()
    # VTK leaves out the last step of each ray, so it is to be a short one.
    expected = render(volume, VIEW, opacity, color, SIZE, 0.13)
    assert expected[..., 3].max() > 0.3
    ours, vtk = (drawn(kind, volume, inputs, SIZE, sample_distance=0.13) for kind in KINDS)
    assert np.abs(ours - expected).max() < 1e-3
    assert rms(vtk - expected) < 0.006


@pytest.mark.parametrize("chosen", [(40.0, 60.0), (-900.0, 1000.0)])
def test_a_range_decides_about_tfs_and_not_about_light(chosen):
    # The same TF, once over the voxels' range and once over a chosen one, in 1, 2 or 50 bins.
    volume = ramp("float32", 40)
    lo, hi = max(chosen[0], 0.0), min(chosen[1], 100.0)
    opacity = ((chosen[0], 0.1), (lo, 0.1), (hi, 0.3), (chosen[1], 0.3))
    color = ((lo, 0.2, 0.4, 0.9), (hi, 0.9, 0.6, 0.1))
    for kind in KINDS:
        images = []
        for each in (volume, volume.over(chosen)):
            tf = OpacityTF(each.scalar_range, points=tuple(dict(opacity).items()))
            inputs = SceneInputs(VIEW, tf, ColorTF(each.scalar_range, color))
            # From the side: the volume's gradient runs across the view.
            light = LightDirection(-45.0, 45.0)
            images.append(drawn(kind, each, inputs, SIZE, lighting="direct", light=light))
        assert images[0][..., :3].max() > 0.1
        assert rms(images[0] - images[1]) < 0.006


def test_the_derivative_is_that_of_a_float64_ray_caster_over_a_narrow_range():
    chosen = (49.75, 51.0)
    volume, values = noise("uint8").over(chosen), np.linspace(*chosen, TF_SAMPLES)
    base = 0.3 + 0.1 * np.sin(np.linspace(0, 20, TF_SAMPLES))
    edit = np.cos(np.linspace(0, 9, TF_SAMPLES))
    color = inputs_over(chosen).color_tf
    points = tuple(zip(values.tolist(), base.tolist(), strict=True))
    inputs = SceneInputs(VIEW, OpacityTF(chosen, points=points), color)
    rays = cast(volume, VIEW, SIZE, 0.5)
    bins = np.rint(LEVELS_PER_BIN * rays.bins) / LEVELS_PER_BIN

    def image(amount):
        per_sample = correct(base + amount * edit, 0.5)
        return composite(bins, rays.shares, per_sample, color.sample())[..., :3]

    expected = (image(1e-4) - image(-1e-4)) / 2e-4
    renderer = RaycastRenderer(volume)
    # Of all rays, a few have a sample so near the middle between two levels that either counts.
    difference = np.abs(renderer.change(inputs, SIZE, edit) - expected).max(axis=-1)
    assert np.abs(expected).max() > 0.1
    assert np.quantile(difference, 0.99) < 2e-3 and difference.max() < 0.02
    everything = np.array([[0, SIZE, 0, SIZE]])
    gradients, energies = renderer.differentiate(inputs, SIZE, everything)
    assert energies[0] == pytest.approx((image(0) ** 2).sum(), rel=1e-3)
    assert gradients[0] @ edit == pytest.approx((image(0) * expected).sum(), rel=5e-3)
    renderer.close()
