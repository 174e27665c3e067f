import numpy as np
import pytest

from model.errors import TransferFunctionError
from model.latent.tf_frame import TFFrame
from model.scene.transfer_function import GaussianMode, OpacityTF

FRAME = TFFrame((0.0, 1000.0), (200.0, 800.0))
RAMP = np.linspace(0.2, 0.7, 256)


def test_a_tf_fills_the_window():
    tf = FRAME.opacity_tf(RAMP)
    assert tf.scalar_range == (0.0, 1000.0)
    assert tf([200.0, 500.0, 800.0]) == pytest.approx([0.2, 0.45, 0.7], abs=1e-6)
    # Nothing below, where the background is; the last opacity above.
    assert tf([0.0, 199.9, 900.0]) == pytest.approx([0.0, 0.0, 0.7], abs=1e-6)
    assert FRAME.opacities(tf) == pytest.approx(RAMP, abs=1e-6)


def test_a_frame_of_the_whole_range_adds_no_step():
    frame = TFFrame((0.0, 1000.0), (0.0, 1000.0))
    assert len(frame.opacity_tf(RAMP).points) == 256
    assert frame.stretched(RAMP[None])[0] == pytest.approx(RAMP, abs=1e-6)


def test_stretched_tfs_are_the_sampled_ones():
    rng = np.random.default_rng(0)
    smooth = np.cumsum(rng.normal(0, 0.01, (5, 256)), axis=1) % 1
    for opacities, stretched in zip(smooth, FRAME.stretched(smooth), strict=True):
        assert stretched == pytest.approx(FRAME.opacity_tf(opacities).sample(), abs=1e-5)


def test_opacities_are_clipped_and_windows_checked():
    assert FRAME.opacity_tf(RAMP + 5)(500.0) == 1.0
    with pytest.raises(TransferFunctionError):
        TFFrame((0.0, 1.0), (0.5, 0.5))


def test_what_lies_outside_the_window_is_lost():
    tf = OpacityTF((0.0, 1000.0), (GaussianMode(50.0, 20.0, 0.9),))
    assert FRAME.opacities(tf).max() < 1e-6
