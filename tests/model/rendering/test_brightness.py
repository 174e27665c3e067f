import colorsys

import numpy as np
import pytest

from model.rendering.brightness import brighten


@pytest.mark.parametrize("brightness", [0.25, 0.5, 1.0, 2.0, 4.0])
def test_dark_colours_have_the_factor_and_full_ones_stay(brightness):
    greys = np.linspace(0, 1, 101, dtype=np.float32)
    colors = np.repeat(greys[:, None], 3, axis=1)
    brighten(colors, brightness)
    level = colors[:, 0]
    assert level[0] == 0 and level[-1] == pytest.approx(1)
    assert level[1] / greys[1] == pytest.approx(brightness, rel=0.05)
    assert (np.diff(level) > 0).all()
    # Darker by the inverse is the way back.
    brighten(colors, 1 / brightness)
    np.testing.assert_allclose(colors[:, 0], greys, atol=1e-6)


def test_hues_and_saturations_stay():
    colors = np.random.default_rng(3).random((50, 3)).astype(np.float32)
    before = [colorsys.rgb_to_hsv(*map(float, color)) for color in colors]
    brighten(colors, 2.0)
    after = [colorsys.rgb_to_hsv(*map(float, color)) for color in colors]
    np.testing.assert_allclose(np.array(after)[:, :2], np.array(before)[:, :2], atol=1e-5)
    assert colors.max() <= 1
