"""Figures: where images, captions, legend and scale bar are."""

import numpy as np
import pytest
from ramp import make_tf

from app.window.figure import FigureLook, Subject, figure, panels, pixels_of
from model.rendering.scale_bar import Scale
from model.scene.inputs import SceneInputs
from model.scene.view import View

SCALE = Scale((0.577, 0.577, 0.577), 50.0, "mm", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
INPUTS = SceneInputs.of(View(), make_tf())
BLACK, WHITE = (0, 0, 0), (255, 255, 255)


def plain(level, height, width):
    image = np.full((height, width, 4), level, np.float32)
    image[..., 3] = 1.0
    return image


def made(look, which, **images):
    subject = Subject("K", SCALE)
    drawn = {name: (image, 1.0) for name, image in images.items()}
    return pixels_of(figure(look, drawn, which, INPUTS, subject)).astype(int)


pytestmark = pytest.mark.usefixtures("qapp")


@pytest.mark.parametrize("size", [(600, 600), (1000, 500), (500, 1000)])
@pytest.mark.parametrize(("background", "level"), [(BLACK, 0.0), (WHITE, 1.0)])
def test_the_scale_bar_is_as_long_as_the_scale_says(size, background, level):
    width, height = size
    image = plain(level, height, width)
    without = made(FigureLook(width, height, background), "reference", reference=image)
    shown = made(
        FigureLook(width, height, background, scale_bar=True), "reference", reference=image
    )
    assert (without == round(255 * level)).all()
    changed = np.abs(shown - without).max(axis=-1) > 128
    rows, columns = np.nonzero(changed)
    assert rows.min() > 0.9 * height and columns.max() < width / 2
    bar = SCALE.bar(INPUTS.view)
    length = bar.share * min(size)
    # The longest row of pixels is the bar.
    longest = changed.sum(axis=1).max()
    assert longest == pytest.approx(length, abs=4)


def test_both_are_squares_side_by_side():
    look = FigureLook(1212, 600, WHITE, True, True)
    left, right = panels(look, "both")
    assert (left.width(), left.height()) == (right.width(), right.height()) == (600, 600)
    pixels = made(look, "both", generator=plain(0.2, 128, 128), reference=plain(0.6, 600, 600))
    assert (pixels[300, 10:590] == 51).mean() > 0.9
    assert (pixels[300, 625:900] == 153).mean() > 0.9
    assert (pixels[300, 604:608] == 255).all()
    # Captions at the upper left of each, the bar in the first, the legend in the last.
    for place, level in ((left, 51), (right, 153)):
        corner = pixels[:60, place.left() : place.left() + 200]
        assert (np.abs(corner - level) > 60).any()
    assert (np.abs(pixels[540:, :300] - 51) > 60).any()
    assert not (np.abs(pixels[200:520, 10:590] - 51) > 60).any()
    assert (np.abs(pixels[250:, 1000:1200] - 153) > 60).any()


def test_the_difference_is_brightest_where_it_is_largest():
    truth = plain(0.5, 300, 300)
    drawn = truth.copy()
    drawn[100:150, 100:150, :3] += 0.3
    pixels = made(
        FigureLook(300, 300, None, True, True), "difference", generator=drawn, reference=truth
    )
    inside, outside = pixels[125, 125], pixels[60, 60]
    assert inside.sum() > outside.sum() + 60
    assert np.abs(pixels[240:, 150:] - outside).max() > 100
