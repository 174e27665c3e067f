import numpy as np
import pytest

from model.scene.color_maps import COLOR_MAPS, color_tf_of_map, map_colors, reversed_colors


@pytest.mark.parametrize("name", COLOR_MAPS)
def test_a_color_tf_is_near_its_map_everywhere(name):
    color = color_tf_of_map(name, (-5.0, 12.0))
    assert len(color.stops) == 9
    assert (color.stops[0][0], color.stops[-1][0]) == (-5.0, 12.0)
    np.testing.assert_allclose(color.sample(count=101), map_colors(name, 101), atol=0.08)


def test_viridis_is_viridis():
    # Ends as published with matplotlib.
    colors = map_colors("Viridis", 2)
    np.testing.assert_allclose(colors, [[0.267, 0.005, 0.329], [0.993, 0.906, 0.144]], atol=1e-3)


def test_reversing_mirrors_and_twice_changes_nothing():
    color = color_tf_of_map("Batlow", (1e9, 1e9 + 1))
    mirrored = reversed_colors(color)
    np.testing.assert_allclose(mirrored.sample(), color.sample()[::-1], atol=1e-6)
    assert reversed_colors(mirrored) == color
