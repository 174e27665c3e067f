"""The crop box as plain data."""

from __future__ import annotations

import pytest

from model.errors import TfscopeError
from model.scene.crop import CropBox


def test_text_gives_the_planes_axis_by_axis() -> None:
    box = CropBox.parse("0,0.5,0.25,1,0.1,0.9")
    assert box == CropBox((0.0, 0.25, 0.1), (0.5, 1.0, 0.9))
    assert box.numbers().tolist() == [0.0, 0.25, 0.1, 0.5, 1.0, 0.9]
    assert CropBox().is_whole and not box.is_whole


@pytest.mark.parametrize(
    "text", ["", "0,1", "0,1,0,1,0,x", "0,1,0,1,0,1.5", "0.5,0.5,0,1,0,1", "0.6,0.2,0,1,0,1"]
)
def test_a_bad_box_is_refused_in_one_sentence(text: str) -> None:
    with pytest.raises(TfscopeError, match=r"crop box"):
        CropBox.parse(text)
