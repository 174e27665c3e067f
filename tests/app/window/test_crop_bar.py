from __future__ import annotations

from collections.abc import Callable

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.state.viewer_state import ViewerState
from app.window.crop_bar import CropBar
from app.window.main_window import MainWindow
from app.window.span_slider import SpanSlider
from model.scene.crop import CropBox

LEFT = Qt.MouseButton.LeftButton
DIMENSIONS = (101, 51, 21)


@pytest.fixture
def bar(qtbot: QtBot, state: ViewerState) -> CropBar:
    bar = CropBar(state)
    qtbot.addWidget(bar)
    bar.resize(1200, 34)
    bar.set_volume(DIMENSIONS)
    bar.set_shown(True)
    qtbot.waitExposed(bar)
    return bar


def at(slider: SpanSlider, value: float) -> QPoint:
    return QPoint(round(slider.x_of(value)), slider.height() // 2)


def drag(slider: SpanSlider, start: QPoint, end: QPoint) -> None:
    QTest.mousePress(slider, LEFT, pos=start)
    QTest.mouseMove(slider, end)
    QTest.mouseRelease(slider, LEFT, pos=end)


def test_typed_voxels_are_planes_through_their_centers(bar: CropBar, state: ViewerState) -> None:
    bar.planes[0][0].setValue(25)
    bar.planes[2][1].setValue(15)
    assert state.crop == CropBox((0.25, 0.0, 0.0), (1.0, 1.0, 0.75))
    bar.whole.click()
    assert state.crop is None and not bar.whole.isEnabled()


def test_a_plane_stops_before_its_opposite(bar: CropBar, state: ViewerState) -> None:
    bar.planes[1][0].setValue(30)
    bar.planes[1][1].setValue(10)
    assert state.crop is not None
    assert (state.crop.low[1], state.crop.high[1]) == pytest.approx((30 / 50, 31 / 50))
    assert bar.planes[1][1].value() == 31


def test_an_end_is_dragged_live_and_finished_once(
    qtbot: QtBot, bar: CropBar, state: ViewerState
) -> None:
    slider = bar.sliders[0]
    live: list[bool] = []
    state.cropChanged.connect(lambda _crop: live.append(state.live))
    start, end = at(slider, 1.0) + QPoint(4, 0), at(slider, 0.5) + QPoint(4, 0)
    with qtbot.waitSignal(state.cropChangeFinished) as finished:
        drag(slider, start, end)
    assert live == [True]
    assert finished.args is not None
    assert finished.args[0].high[0] == pytest.approx(0.5, abs=0.01)
    assert not state.live


def test_the_middle_moves_the_slab_and_keeps_its_thickness(
    bar: CropBar, state: ViewerState
) -> None:
    state.set_crop(CropBox((0.4, 0.0, 0.0), (0.6, 1.0, 1.0)))
    slider = bar.sliders[0]
    drag(slider, at(slider, 0.5), at(slider, 1.5))
    assert state.crop is not None
    assert (state.crop.low[0], state.crop.high[0]) == pytest.approx((0.8, 1.0))


def test_keys_move_an_end_by_voxels(bar: CropBar, state: ViewerState) -> None:
    slider = bar.sliders[0]
    slider.setFocus(Qt.FocusReason.TabFocusReason)
    for _ in range(3):
        QTest.keyClick(slider, Qt.Key.Key_Right)
    assert state.crop is not None and state.crop.low[0] == pytest.approx(0.03)
    QTest.keyClick(slider, Qt.Key.Key_Tab)
    QTest.keyClick(slider, Qt.Key.Key_PageDown)
    assert state.crop.high[0] == pytest.approx(0.9)


def test_it_follows_what_is_cropped_elsewhere(bar: CropBar, state: ViewerState) -> None:
    state.set_crop(CropBox((0.0, 0.2, 0.0), (1.0, 0.6, 1.0)))
    assert [box.value() for box in bar.planes[1]] == [10, 30]
    assert bar.sliders[1].span == (0.2, 0.6)


def test_the_window_shows_it_with_its_handles(
    qtbot: QtBot, make_window: Callable[..., MainWindow]
) -> None:
    window = make_window()
    assert window.crop_bar.isHidden()
    window.crop_bar.set_shown(True)
    assert window.crop_bar.isVisible()
    handles = window.crop_handles[1]
    assert handles.handles
    window.crop_bar.planes[0][0].setValue(1)
    assert window.state.crop is not None and window.state.crop.low[0] == pytest.approx(1 / 3)
    assert "crop" in window.generator.canvas.hint
