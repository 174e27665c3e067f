import numpy as np
import pytest

from app.tf_editor.unit_axis import OpacityScale


@pytest.mark.parametrize("logarithmic", [False, True])
def test_opacities_come_back_from_their_heights(logarithmic):
    scale = OpacityScale(logarithmic)
    opacities = np.array([0.0, 1e-5, 0.001, 0.02, 0.5, 1.0])
    heights = scale.heights(opacities)
    assert (heights[0], heights[-1]) == (0.0, pytest.approx(1.0))
    assert (np.diff(heights) > 0).all()
    assert [scale.opacity(height) for height in heights] == pytest.approx(list(opacities))
    assert np.isfinite(scale.opacity(1e9)) and np.isfinite(scale.opacity(-1e9))


def test_a_hundredth_has_room_on_the_logarithmic_scale():
    assert OpacityScale(True).height(0.01) > 0.25
    assert [text for _, text in OpacityScale(True).ticks()] == ["0", "", ".01", ".1", "1"]
