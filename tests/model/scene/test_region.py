import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.errors import RenderError
from model.scene.crop import CropBox
from model.scene.region import Outline, Region, windows_of


def test_a_rectangle_has_its_pixels():
    mask = Region(2, 1, 5, 3).mask(8)
    assert np.argwhere(mask).tolist() == [[r, c] for r in (1, 2) for c in (2, 3, 4)]
    np.testing.assert_array_equal(Outline.rectangle(2 / 8, 1 / 8, 5 / 8, 3 / 8).mask(8), mask)
    assert Region.whole(4).mask(4).all() and Outline().mask(4).all()
    # Smaller than a pixel is that pixel, and partly outside is what is inside.
    for x, y in ((0.01, 0.01), (0.52, 0.31), (0.999, 0.999)):
        mask = Outline.rectangle(x - 1e-4, y - 1e-4, x + 1e-4, y + 1e-4).mask(16)
        assert np.argwhere(mask).tolist() == [[int(y * 16), int(x * 16)]]
    mask = Outline.rectangle(-0.5, -0.5, 0.25, 0.25).mask(8)
    assert np.argwhere(mask).max() == 1 and mask.sum() == 4
    with pytest.raises(RenderError, match="outside the image"):
        Outline.rectangle(1.2, 0.1, 1.5, 0.4).mask(8)


def test_a_lasso_has_the_pixels_whose_centres_are_inside():
    angles = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    circle = Outline(
        tuple(zip(0.5 + 0.3 * np.cos(angles), 0.4 + 0.3 * np.sin(angles), strict=True))
    )
    y, x = (np.mgrid[:64, :64] + 0.5) / 64
    expected = (x - 0.5) ** 2 + (y - 0.4) ** 2 < 0.3**2
    assert (circle.mask(64) != expected).mean() < 0.01
    assert circle.moved(0.1, 0.2).mask(64)[38, 38]


def test_an_outline_refers_to_the_square_in_the_middle_of_a_wider_image():
    square = Outline.rectangle(0.25, 0.5, 0.5, 1.0)
    wide, high = square.mask((8, 20)), square.mask((20, 8))
    np.testing.assert_array_equal(wide[:, 6:14], square.mask(8))
    np.testing.assert_array_equal(high[6:14], square.mask(8))
    assert wide.sum() == high.sum() == square.mask(8).sum()
    beside = Outline.rectangle(1.25, 0.0, 3.0, 0.5)
    assert np.argwhere(beside.mask((8, 20))).tolist() == [
        [r, c] for r in range(4) for c in range(16, 20)
    ]
    assert Outline().mask((8, 20)).all() and Region(15, 0, 20, 8).mask((8, 20)).sum() == 40
    assert square.is_in_square and not beside.is_in_square


@given(st.integers(1, 12), st.data())
def test_windows_cover_a_mask_once(size, data):
    bits = data.draw(st.lists(st.booleans(), min_size=size * size, max_size=size * size))
    mask = np.array(bits).reshape(size, size)
    found = np.zeros((size, size), int)
    for top, bottom, left, right in windows_of(mask):
        found[top:bottom, left:right] += 1
    np.testing.assert_array_equal(found, mask)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0, 1.5))
def test_an_outline_can_be_kept_inside(x, y, side):
    outline = Outline.rectangle(x, y, x + side, y + side)
    kept = outline.kept_inside()
    for size in (1, 7, 64):
        assert kept.mask(size).any()
    assert outline.kept_inside((1.25, 0.5)).mask((8, 20)).any()
    if x >= 0 and x + side <= 1 and y >= 0 and y + side <= 1 and min(x, y) < 0.9 and side > 0.1:
        assert kept == outline


def test_a_plane_moves_alone_and_stops_before_its_opposite():
    box = CropBox((0.1, 0.2, 0.3), (0.9, 0.8, 0.7))
    assert box.with_plane(1, 0, 0.5) == CropBox((0.1, 0.5, 0.3), (0.9, 0.8, 0.7))
    assert box.with_plane(2, 1, 1.7).high == (0.9, 0.8, 1.0)
    assert box.with_plane(0, 0, -3.0).low == (0.0, 0.2, 0.3)
    assert box.with_plane(0, 0, 0.95, least=0.25).low[0] == pytest.approx(0.65)
    assert box.with_plane(0, 1, 0.0, least=0.25).high[0] == pytest.approx(0.35)
    # A box shorter than the length to keep stays in the volume.
    for side, high in ((0, 0.1), (1, 0.5)):
        thin = CropBox((0.0, 0.0, 0.0), (1.0, 0.1, 1.0))
        thin = thin.with_plane(1, side, 1.0 - side, least=0.5)
        assert (thin.low[1], thin.high[1]) == pytest.approx((0.0, high))
