"""Places of the names of regions."""

from itertools import combinations

import pytest
from PySide6.QtCore import QPointF, QRectF

from app.sensitivity_view.region_layer import name_corners

PLATE = QRectF(-5, -14, 70, 19)


def test_a_name_stands_above_its_region_or_below_at_the_upper_edge():
    regions = [QRectF(100, 100, 80, 60), QRectF(300, 0, 80, 60)]
    assert name_corners(regions, [PLATE] * 2) == [QPointF(106, 93), QPointF(306, 78)]


@pytest.mark.parametrize(
    "regions",
    [
        [QRectF(100, 100, 80, 60)] * 6,
        [QRectF(100 + 9 * step, 100 + 5 * step, 150, 60) for step in range(5)],
        [QRectF(0, 0, 400, 400)] * 4,
        [QRectF(100, 5, 30, 20), QRectF(120, 5, 30, 20), QRectF(90, 50, 60, 20)],
    ],
)
def test_no_name_lies_over_another(regions):
    corners = name_corners(regions, [PLATE] * len(regions))
    boxes = [PLATE.translated(corner) for corner in corners]
    assert not any(a.intersects(b) for a, b in combinations(boxes, 2))


def test_a_name_is_not_under_the_caption():
    caption, region = QRectF(8, 8, 200, 24), QRectF(60, 36, 120, 90)
    (corner,) = name_corners([region], [PLATE], [caption])
    assert not PLATE.translated(corner).intersects(caption)
    assert corner.y() > region.bottom()
