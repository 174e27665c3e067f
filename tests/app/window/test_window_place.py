import pytest
from PySide6.QtCore import QSize

from app.window.window_memory import first_size


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
