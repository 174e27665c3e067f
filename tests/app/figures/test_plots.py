import numpy as np
import pyqtgraph as pg
import pytest

from app.figures import plots
from model.latent.latent_map import blended_code

COLORS = np.zeros((256, 3))
VALUES = np.linspace(-100, 300, 256)


@pytest.mark.parametrize("largest", [3.9e-4, 0.02, 0.5, 7.0])
def test_numbers_of_the_right_axis_are_those_of_the_sensitivity(largest):
    responses = largest * np.sin(np.linspace(0, 9, 256))
    content = plots.TFPlot("t", (-100, 300), np.zeros(256), COLORS, responses=responses)
    plot = plots.Page("t", [400], [250]).tf(0, 0, content)
    curves = [item for item in plot.items if isinstance(item, pg.PlotDataItem)]
    (drawn,) = (c for c in curves if np.nanmax(np.abs(c.yData)) > 0)
    np.testing.assert_array_equal(drawn.xData, VALUES)
    (ticks,) = plot.getAxis("right")._tickLevels
    assert plots.RESPONSES_PER_AXIS / 2 <= len(ticks) <= 2 * plots.RESPONSES_PER_AXIS
    scale = np.abs(drawn.yData).max() / np.abs(responses).max()
    for place, text in ticks:
        assert place == pytest.approx(float(text) * scale, rel=0.01, abs=1e-9)
    np.testing.assert_allclose(drawn.yData, responses * scale)


def test_the_blob_of_a_place_has_the_weights_of_its_interpolation():
    radius, place = 0.3, (0.2, -0.1)
    page = plots.Page("t", [400], [400])
    plot = page.map(0, 0, "m", np.zeros((3, 2)), None, [(*place, radius)])
    (blob,) = (item for item in plot.items if isinstance(item, pg.ImageItem))
    alpha = blob.image[..., 3].astype(float)
    middle = alpha[32, 32]
    # Two samples, one of them at the place: the other's share of the mean is its weight.
    for column in (40, 48, 60):
        distance = (column - 32) / 32 * radius
        places = np.array([place, (place[0] + distance, place[1])], dtype=np.float32)
        codes = np.array([[0.0], [1.0]], dtype=np.float32)
        share = float(blended_code(codes, places, place, radius).code[0])
        weight = share / (1 - share)
        assert alpha[32, column] / middle == pytest.approx(weight, abs=0.01)
    assert alpha[0, 0] == 0


def test_pictures_stand_in_rows_and_columns_with_gaps():
    images = np.random.default_rng(0).uniform(0, 1, (2, 3, 4, 5, 3)).astype(np.float32)
    images[1, 1] = np.nan
    picture = plots.mosaic(images)
    assert picture.shape == (2 * 4 + 4, 3 * 5 + 8, 3)
    np.testing.assert_array_equal(picture[:4, 9:14], images[0, 1])
    np.testing.assert_array_equal(picture[8:, 18:], images[1, 2])
    assert (picture[4:8] == np.float32(plots.EMPTY)).all()
    assert (picture[8:, 9:14] == np.float32(plots.EMPTY)).all()
