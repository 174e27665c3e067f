from dataclasses import replace

import numpy as np
import pytest
from ramp import make_tf, make_volume

from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import FAR_DISTANCE_RADII, View
from model.scene.visibility_hint import nothing_visible, why_nothing

SHOWN = SceneInputs.of(View(), make_tf(150.0))


def explain(inputs, aspect=1.0):
    """Explain an image of a volume with the values 100 to 120 and 180 to 200."""
    volume = make_volume()
    counts, edges = volume.histogram(64)
    middle = (edges[:-1] + edges[1:]) / 2
    counts[(middle > 120) & (middle < 180)] = 0
    return why_nothing(inputs, volume.scalar_range, counts, edges, aspect)


def with_mode(mean, scalar_range=(100.0, 200.0)):
    opacity = OpacityTF(scalar_range, (GaussianMode(mean, 5.0, 0.8),))
    color = ColorTF(scalar_range, ((mean, 1.0, 1.0, 1.0),))
    return SceneInputs(View(), opacity, color)


@pytest.mark.parametrize(("level", "nothing"), [(0.0, True), (0.005, True), (0.007, False)])
def test_one_pixel_that_is_seen_is_not_nothing(level, nothing):
    rgba = np.zeros((8, 9, 4), np.float32)
    rgba[3, 4, 3] = level
    rgba[0, 0] = (1.0, 1.0, 1.0, np.nan)
    assert nothing_visible(rgba) is nothing


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        (replace(SHOWN, opacity_tf=OpacityTF((100.0, 200.0))), "transparent at every scalar value"),
        # 5 sqrt(ln 100) = 10.7 on either side of the mode
        (with_mode(150.0), "from 139.6 to 160.4, which no voxel has"),
        (with_mode(330.0, (100.0, 400.0)), "lie between 100 and 200"),
    ],
)
def test_a_tf_that_shows_nothing(inputs, said):
    found = explain(inputs)
    assert found.cause == "tf" and said in found.text


def test_values_that_hardly_any_voxel_has():
    edges = np.linspace(0, 10, 11)
    counts = np.array([10**6, 0, 0, 0, 0, 0, 0, 0, 0, 3])
    inputs = replace(SHOWN, opacity_tf=OpacityTF((0, 10), points=((9, 0.0), (10, 1.0))))
    found = why_nothing(inputs, (0.0, 10.0), counts, edges)
    assert "3 voxels of 1,000,003" in found.text


def test_voxels_beyond_the_tfs_range_look_like_its_ends():
    # Clamped to 150, all voxels above it are shown.
    points = replace(SHOWN, opacity_tf=OpacityTF((130.0, 150.0), points=((149, 0.0), (150, 1.0))))
    assert "voxel" not in explain(points).text


@pytest.mark.parametrize(
    ("view", "aspect", "outside"),
    [
        (View(pan_x=2.1), 1.0, True),
        (View(pan_x=2.1), 1.5, False),
        (View(pan_y=-2.1), 1.5, True),
        (View(pan_y=1.9), 1.0, False),
        (View(distance=200.0), 1.0, True),
        (View(distance=0.2, pan_x=9.0), 1.0, False),
    ],
)
def test_a_view_that_misses_the_volume(view, aspect, outside):
    found = explain(replace(with_mode(190.0), view=view), aspect)
    assert ("left the image" in found.text or "too small" in found.text) is outside
    if outside:
        assert found.cause == "view"


def test_the_sphere_at_the_edge_agrees_with_a_projected_one():
    """Project points of the sphere's silhouette by hand at a distance of 0.5."""
    distance = 0.5 * FAR_DISTANCE_RADII
    angles = np.linspace(0, np.pi, 20001)
    radius = np.max(np.sin(angles) / (distance - np.cos(angles))) / np.tan(np.radians(15))
    for pan, outside in ((radius + 1.001, True), (radius + 0.999, False)):
        view = View(distance=0.5, pan_y=-float(pan))
        found = explain(replace(with_mode(190.0), view=view))
        assert ("left the image" in found.text) is outside


def test_a_crop_box_is_named_when_the_rest_is_in_order():
    crop = CropBox((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    assert explain(replace(with_mode(190.0), crop=crop)).cause == "crop"
    assert explain(replace(with_mode(190.0), crop=CropBox())).cause == "tf"
    assert explain(replace(with_mode(190.0), view=View(distance=0.3))).cause == "view"
