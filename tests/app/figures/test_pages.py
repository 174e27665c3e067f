import numpy as np

from app.figures.pages import EMPTY, mosaic


def test_pictures_stand_in_rows_and_columns_with_gaps():
    images = np.random.default_rng(0).uniform(0, 1, (2, 3, 4, 5, 3)).astype(np.float32)
    images[1, 1] = np.nan
    picture = mosaic(images)
    assert picture.shape == (2 * 4 + 4, 3 * 5 + 8, 3)
    np.testing.assert_array_equal(picture[:4, 9:14], images[0, 1])
    np.testing.assert_array_equal(picture[8:, 18:], images[1, 2])
    assert (picture[4:8] == np.float32(EMPTY)).all()
    assert (picture[8:, 9:14] == np.float32(EMPTY)).all()
