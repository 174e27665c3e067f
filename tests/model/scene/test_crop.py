"""The crop box as plain data."""

import pytest

from model.errors import TfscopeError
from model.scene.crop import CropBox


def test_text_gives_the_planes_axis_by_axis():
    box = CropBox.parse("0,0.5,0.25,1,0.1,0.9")
    assert box == CropBox((0.0, 0.25, 0.1), (0.5, 1.0, 0.9))
    assert box.numbers().tolist() == [0.0, 0.25, 0.1, 0.5, 1.0, 0.9]
    assert CropBox().is_whole and not box.is_whole


@pytest.mark.parametrize(
    "text", ["", "0,1", "0,1,0,1,0,x", "0,1,0,1,0,1.5", "0.5,0.5,0,1,0,1", "0.6,0.2,0,1,0,1"]
)
def test_a_bad_box_is_refused_in_one_sentence(text):
    with pytest.raises(TfscopeError, match=r"crop box"):
        CropBox.parse(text)


def test_a_plane_moves_alone_and_stops_before_its_opposite():
    box = CropBox((0.1, 0.2, 0.3), (0.9, 0.8, 0.7))
    assert box.with_plane(1, 0, 0.5) == CropBox((0.1, 0.5, 0.3), (0.9, 0.8, 0.7))
    assert box.with_plane(2, 1, 1.7).high == (0.9, 0.8, 1.0)
    assert box.with_plane(0, 0, -3.0).low == (0.0, 0.2, 0.3)
    assert box.with_plane(0, 0, 0.95, least=0.25).low[0] == pytest.approx(0.65)
    assert box.with_plane(0, 1, 0.0, least=0.25).high[0] == pytest.approx(0.35)


@pytest.mark.parametrize("side", [0, 1])
def test_a_box_shorter_than_the_length_to_keep_stays_in_the_volume(side):
    thin = CropBox((0.0, 0.0, 0.0), (1.0, 0.1, 1.0)).with_plane(1, side, 1.0 - side, least=0.5)
    assert (thin.low[1], thin.high[1]) == pytest.approx((0.0, 0.5 if side else 0.1))


def test_the_shortest_box_may_be_anywhere():
    # 0.105 - 0.1 is a little less than 0.005.
    assert CropBox.parse("0.1,0.105,0,1,0,1").high[0] == 0.105
