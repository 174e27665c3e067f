from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QSpinBox
from superqt import QDoubleRangeSlider

from app.window.crop_card import CropCard
from model.scene.crop import CropBox

LEFT, PLAIN = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
DIMENSIONS = (101, 51, 21)
BOX = CropBox((0.2, 0.0, 0.5), (0.6, 1.0, 0.75))


@pytest.fixture
def bar(qtbot, state):
    bar = CropCard(state)
    qtbot.addWidget(bar)
    bar.resize(1200, bar.height())
    bar.set_volume(DIMENSIONS)
    bar.set_shown(True)
    qtbot.waitActive(bar)
    return bar


def at(slider: QDoubleRangeSlider, value: float) -> QPoint:
    """Pixel of a value."""
    knob = 9
    return QPoint(round(knob / 2 + value * (slider.width() - knob)), slider.height() // 2)


def type_into(box: QSpinBox, text: str) -> None:
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def shown(bar: CropCard) -> list[tuple[int, int]]:
    return [(first.value(), last.value()) for first, last in bar.planes]


def test_typed_voxels_are_planes_through_their_centers(qtbot, state, bar):
    with qtbot.waitSignals(
        [state.crop_input.changed, state.crop_input.changeFinished], order="strict"
    ):
        type_into(bar.planes[0][0], "25")
    assert state.crop == CropBox((0.25, 0.0, 0.0), (1.0, 1.0, 1.0))
    type_into(bar.planes[2][1], "10")
    assert state.crop == CropBox((0.25, 0.0, 0.0), (1.0, 1.0, 0.5))
    assert not state.live
    type_into(bar.planes[0][0], "0")
    type_into(bar.planes[2][1], "20")
    assert state.crop is None


def test_planes_between_voxels_stay_until_their_own_number_is_typed(state, bar):
    state.crop_input.set(CropBox((0.123, 0.0, 0.0), (0.9, 1.0, 1.0)))
    assert shown(bar)[0] == (12, 90)
    type_into(bar.planes[0][1], "80")
    assert state.crop == CropBox((0.123, 0.0, 0.0), (0.8, 1.0, 1.0))


def test_an_end_is_dragged_live(qtbot, state, bar):
    slider = bar.sliders[1]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 1.0))
    assert state.crop is None
    QTest.mouseMove(slider, at(slider, 0.5))
    assert state.live
    assert state.crop.high[1] == pytest.approx(0.5, abs=0.02)
    assert shown(bar)[1] == (0, 25)
    # No nearer than a voxel.
    QTest.mouseMove(slider, at(slider, 0.0))
    assert state.crop.high[1] - state.crop.low[1] == pytest.approx(1 / 50)
    with qtbot.waitSignal(state.crop_input.changeFinished):
        QTest.mouseRelease(slider, LEFT, PLAIN, at(slider, 0.0))
    assert not state.live


def test_a_slab_keeps_its_thickness_at_the_border(state, bar):
    state.crop_input.set(BOX)
    slider = bar.sliders[0]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 0.4))
    for target, low in ((0.5, 0.3), (3.0, 0.6), (-3.0, 0.0)):
        QTest.mouseMove(slider, at(slider, target))
        assert state.crop.low[0] == pytest.approx(low, abs=0.02)
        assert state.crop.high[0] - state.crop.low[0] == pytest.approx(0.4)
    QTest.mouseRelease(slider, LEFT, PLAIN, at(slider, -3.0))


def test_hiding_ends_a_drag_and_keeps_the_box(qtbot, state, bar):
    told: list[bool] = []
    bar.shownChanged.connect(told.append)
    slider = bar.sliders[0]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 0.0))
    QTest.mouseMove(slider, at(slider, 0.5))
    with qtbot.waitSignal(state.crop_input.changeFinished):
        QTest.mouseClick(bar.dismiss, LEFT)
    QTest.mouseRelease(slider, LEFT)
    assert told == [False]
    assert not bar.isVisible() and not bar.is_shown
    assert state.crop is not None
    bar.set_shown(True)
    bar.set_shown(True)
    assert told == [False, True]
