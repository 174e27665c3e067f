"""The bar's length is measured in the pictures of the ray caster."""

import numpy as np
import pytest
from drawing import RANGE, WHITE, drawn

from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.scale_bar import WIDEST, Scale
from model.scene.clip_plane import ClipPlane, ShownPart
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF
from model.scene.view import View
from model.scene.volume import FileFacts, Volume

SPACING = 0.25


def dots(depth):
    """Two dots at voxels 10 and 30 along x, in a plane of constant y: 5 mm apart."""
    voxels = np.zeros((41, 41, 41), np.uint8)
    voxels[20, depth, [10, 30]] = 255
    return Volume(voxels, (SPACING,) * 3, file=FileFacts(spacing_unit="mm"))


def distance(volume, view, raster):
    """How far apart both are in the picture, in pixels."""
    opacity = OpacityTF(RANGE, points=((0.0, 0.0), (100.0, 0.0), (255.0, 1.0)))
    inputs = SceneInputs(view, opacity, WHITE)
    image = drawn(RaycastRenderer, volume, inputs, raster, threads=1)[..., 3]
    columns = np.arange(raster.width)
    middle = raster.width // 2
    left, right = (
        (columns[half] * image.sum(axis=0)[half]).sum() / image.sum(axis=0)[half].sum()
        for half in (slice(0, middle), slice(middle, None))
    )
    return float(right - left)


@pytest.mark.parametrize("raster", [Raster(300, 300), Raster(400, 200), Raster(200, 400)])
@pytest.mark.parametrize("distance_of_view", [0.5, 1.3])
def test_the_bar_is_as_long_as_it_says_in_the_middle_plane(raster, distance_of_view):
    view, volume = View(distance=distance_of_view), dots(20)
    bar = Scale.of(volume).bar(view)
    assert bar is not None and bar.share <= WIDEST
    number, unit = bar.text.split()
    assert unit == "mm"
    pixels_per_mm = bar.share * raster.shorter / float(number)
    assert distance(volume, view, raster) / 5 == pytest.approx(pixels_per_mm, rel=0.02)


def test_nearer_things_are_larger_than_the_bar_says():
    view, raster = View(distance=0.5), Raster(300, 300)
    bar = Scale.of(dots(20)).bar(view)
    pixels = 5 * bar.share * raster.shorter / float(bar.text.split()[0])
    assert distance(dots(2), view, raster) > 1.1 * pixels
    # Unless the middle of what is shown is there.
    volume = dots(2)
    shown = np.array([[0.25, 0.05, 0.5], [0.75, 0.05, 0.5]])
    span = Scale.of(volume, shown).span(view)
    assert span is not None
    assert distance(volume, view, raster) * span / 300 == pytest.approx(5, rel=0.02)
    crop = CropBox((0.0, 0.0, 0.0), (1.0, 0.1, 1.0))
    for part in (ShownPart(crop), ShownPart(clip=ClipPlane((0.0, 1.0, 0.0), -0.8 / 3**0.5))):
        assert Scale.of(volume).span(view, part) == pytest.approx(span)
    # Close to the eye there is none.
    shown = np.array([[0.5, 0.02, 0.5]])
    assert Scale.of(dots(20), shown).bar(View(distance=0.1)) is None


@pytest.mark.parametrize(
    ("spacing", "unit", "shown"),
    [
        (0.004, "mm", "µm"), (4000.0, "nm", "µm"), (300.0, "mm", "m"), (30.0, "mm", "mm"),
        (2.0, "parsec", "parsec"), (2.0, "", "units"), (1.0, "", "voxels"),
    ],
)  # fmt: skip
def test_lengths_have_the_unit_that_reads_best(spacing, unit, shown):
    volume = Volume(dots(20).voxels, (spacing,) * 3, file=FileFacts(spacing_unit=unit))
    bar = Scale.of(volume).bar(View())
    number, name = bar.text.split()
    assert name == shown
    assert float(number) > 0 and 0.4 * WIDEST < bar.share <= WIDEST
