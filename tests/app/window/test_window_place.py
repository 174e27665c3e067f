import pytest
from PySide6.QtCore import QRect, QSize

from app.window.window_memory import first_size, fitting_place

LAPTOP, SECOND = QRect(0, 25, 1366, 743), QRect(1366, 0, 1920, 1080)


@pytest.mark.parametrize(
    ("free", "size"),
    [
        # Logical pixels, the title bar aside: 1366 x 768 at 125 %, 1920 x 1080 at 150
        # and 200 %, 1280 x 720, large ones.
        ((1093, 590), (1000, 558)),
        ((1280, 690), (1024, 640)),
        ((960, 510), (960, 478)),
        ((1280, 680), (1024, 640)),
        ((1920, 1040), (1440, 832)),
        ((3840, 2100), (1440, 900)),
        ((1280, 1000), (1024, 800)),
    ],
)
def test_it_opens_at_four_fifths_of_the_screen_within_limits(free, size):
    assert first_size(QSize(*free)) == QSize(*size)


def test_a_place_on_a_screen_stays():
    place = QRect(1500, 100, 1000, 700)
    assert fitting_place(place, [LAPTOP, SECOND], LAPTOP) == place


def test_a_place_on_a_screen_that_is_gone_is_centred_on_one_that_is_there():
    place = fitting_place(QRect(1500, 100, 1600, 900), [LAPTOP], LAPTOP)
    assert place.size() == QSize(1366, 743)
    assert place.center() == LAPTOP.center()
    small = fitting_place(QRect(1500, 100, 1000, 640), [LAPTOP], LAPTOP)
    assert small.size() == QSize(1000, 640) and LAPTOP.contains(small)
    assert (small.center() - LAPTOP.center()).manhattanLength() <= 1
