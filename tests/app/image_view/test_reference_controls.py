import math

import pytest
from PySide6.QtCore import QPoint, Qt

from app.image_view.reference_controls import DIAMETER, REACH, BrightnessSlider, LightBall, light_at
from app.state.edits import BRIGHTEST, DARKEST
from app.state.viewer_state import ViewerState
from model.rendering.brightness import LIT_BRIGHTNESS
from model.scene.scene import LightDirection, LightRange


def test_slider_and_brightness_follow_one_another(qtbot):
    state = ViewerState()
    brightness = state.brightness
    sliders = [BrightnessSlider(brightness) for _ in range(2)]
    for slider in sliders:
        qtbot.addWidget(slider)
    one, other = (slider.slider for slider in sliders)
    assert brightness.of("exact") == 1 and one.value() == 0 and not sliders[0].reset.isEnabled()
    one.setValue(8)
    assert brightness.of("exact") == 2
    assert other.value() == 8 and sliders[1].number.text() == "2.00×"
    brightness.set(100.0)
    assert brightness.of("exact") == BRIGHTEST and one.value() == one.maximum()
    one.setValue(one.minimum())
    assert brightness.of("exact") == DARKEST
    sliders[1].reset.click()
    assert brightness.of("exact") == 1 and one.value() == 0
    assert brightness.value is None
    # Every step of the slider is one of the brightness, and comes back as itself.
    for step in range(one.minimum(), one.maximum() + 1):
        one.setValue(step)
        assert brightness.of("exact") == pytest.approx(2 ** (step / 8), abs=6e-4)
        assert brightness.step == step


def test_what_is_not_chosen_follows_the_light(qtbot):
    state = ViewerState()
    brightness = state.brightness
    slider = BrightnessSlider(brightness)
    qtbot.addWidget(slider)
    brightness.set_lighting("exact", "direct")
    assert brightness.of("exact") == LIT_BRIGHTNESS and slider.number.text() == "2.00×"
    assert not slider.reset.isEnabled()
    # A model that was trained without light is shown as it is, and changed by the same factor.
    assert brightness.of("learned") == 1
    brightness.set(3.0)
    assert (brightness.of("exact"), brightness.of("learned")) == (3, 1.5)
    brightness.set_lighting("learned", "direct")
    assert brightness.of("learned") == 3
    brightness.set(None)
    brightness.set_lighting("exact", "none")
    assert brightness.of("exact") == 1
    brightness.set(1.0)
    brightness.set_lighting("exact", "soft")
    assert brightness.of("exact") == 1 and slider.reset.isEnabled()
    slider.reset.click()
    assert brightness.of("exact") == LIT_BRIGHTNESS


def test_a_drag_is_one_undo_step_and_so_is_a_reset(qtbot, make_window):
    window = make_window()
    brightness, stack = window.brightness, window.state.edits.stack
    slider = BrightnessSlider(brightness)
    qtbot.addWidget(slider)
    usual = brightness.of("exact")
    slider.slider.setSliderDown(True)
    for step in (3, 9, 16):
        slider.slider.setValue(step)
    assert brightness.of("exact") == 4 and stack.count() == 0
    slider.slider.setSliderDown(False)
    assert stack.count() == 1 and stack.undoText() == "brightness"
    slider.reset.click()
    assert brightness.of("exact") == usual and stack.count() == 2
    window.state.edits.undo()
    assert brightness.of("exact") == 4
    window.state.edits.undo()
    assert brightness.of("exact") == usual and brightness.value is None
    window.state.edits.redo()
    assert brightness.of("exact") == 4


def test_the_kind_of_light_is_undone_among_the_edits(window):
    reference, state = window.workspace.reference, window.state
    reference.choose(lighting="direct")
    state.light_input.set(LightDirection(40.0, 20.0))
    reference.choose(lighting="none")
    assert state.light is None and reference.settings.lighting == "none"
    state.edits.undo()
    assert reference.settings.lighting == "direct"
    assert state.light == LightDirection(40.0, 20.0)
    state.edits.undo()
    assert state.light == LightDirection()
    state.edits.undo()
    assert reference.choices.lighting == "auto" and not state.edits.stack.canUndo()
    fingerprint = window.workspace.opened.fingerprint
    assert window.preferences.volume(fingerprint).lighting == "auto"
    # What is kept for no later run is no edit.
    reference.choose(keep=False, lighting="none")
    assert not state.edits.stack.canUndo()


LIMITS = LightRange()


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.5, 0.3), (-0.6, 0.6), (0.1, -0.7)])
def test_the_light_shines_straight_onto_the_point(x, y):
    right, up, back = light_at(x, y, LIMITS).towards()
    assert (right, up) == (pytest.approx(x, abs=1e-9), pytest.approx(y, abs=1e-9))
    assert back == pytest.approx(math.sqrt(1 - x * x - y * y), abs=1e-9)


@pytest.mark.parametrize(("x", "y"), [(5.0, 0.0), (0.0, -3.0), (1.0, 1.0), (-1.0, 0.0)])
def test_beyond_the_rim_the_light_stays_in_its_range(x, y):
    light = light_at(x, y, LIMITS)
    assert abs(light.azimuth) <= LIMITS.max_azimuth
    assert abs(light.elevation) <= LIMITS.max_elevation


@pytest.fixture
def ball(qtbot):
    """A ball over a movable light from straight ahead."""
    state = ViewerState()
    state.light_input.set(LightDirection(0.0, 0.0))
    ball = LightBall(state)
    qtbot.addWidget(ball)
    state.setParent(ball)
    ball.set_light(LightDirection(), LIMITS)
    ball.show()
    return ball


MIDDLE = QPoint(DIAMETER // 2, DIAMETER // 2)


def test_dragging_moves_the_light_live_and_then_finally(qtbot, ball):
    state = ball._state
    # From anywhere: it is the movement that counts.
    start = MIDDLE + QPoint(5, -7)
    qtbot.mousePress(ball, Qt.MouseButton.LeftButton, pos=start)
    assert state.light == LightDirection(0.0, 0.0) and not state.live
    qtbot.mouseMove(ball, start + QPoint(round(REACH / 2), 0))
    assert state.live and state.light is not None
    assert state.light.azimuth == pytest.approx(30, abs=0.5)
    assert state.light.elevation == pytest.approx(0, abs=0.5)
    with qtbot.waitSignal(state.light_input.changeFinished):
        qtbot.mouseRelease(ball, Qt.MouseButton.LeftButton)
    assert not state.live
    qtbot.mouseDClick(ball, Qt.MouseButton.LeftButton)
    assert state.light == LightDirection()
    # A click puts the light there.
    qtbot.mouseClick(ball, Qt.MouseButton.LeftButton, pos=MIDDLE - QPoint(0, DIAMETER // 4))
    assert (state.light.azimuth, state.light.elevation) == pytest.approx((0, 28), abs=3)
