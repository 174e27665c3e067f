from __future__ import annotations

from collections.abc import Callable

import pytest
from pytestqt.qtbot import QtBot

from app.image_view.reference_controls import BrightnessSlider
from app.state.brightness import BRIGHTEST, DARKEST, Brightness
from app.state.preferences import Preferences
from app.window.main_window import MainWindow
from model.rendering.brightness import LIT_BRIGHTNESS
from model.scene.light import LightDirection


def test_slider_and_brightness_follow_one_another(qtbot: QtBot) -> None:
    preferences = Preferences(None)
    brightness = Brightness(preferences, preferences)
    sliders = [BrightnessSlider(brightness) for _ in range(2)]
    for slider in sliders:
        qtbot.addWidget(slider)
    one, other = (slider.slider for slider in sliders)
    assert brightness.value == 1 and one.value() == 0 and not sliders[0].reset.isEnabled()
    one.setValue(8)
    assert brightness.value == 2
    assert other.value() == 8 and sliders[1].number.text() == "2.00×"
    brightness.set(100.0)
    assert brightness.value == BRIGHTEST and one.value() == one.maximum()
    one.setValue(one.minimum())
    assert brightness.value == DARKEST
    sliders[1].reset.click()
    assert brightness.value == 1 and one.value() == 0
    assert not brightness.is_chosen
    # Every step of the slider is one of the brightness, and comes back as itself.
    for step in range(one.minimum(), one.maximum() + 1):
        one.setValue(step)
        assert brightness.value == pytest.approx(2 ** (step / 8), abs=6e-4)
        assert brightness.step == step


def test_what_is_not_chosen_follows_the_light(qtbot: QtBot) -> None:
    preferences = Preferences(None)
    brightness = Brightness(preferences, preferences)
    slider = BrightnessSlider(brightness)
    qtbot.addWidget(slider)
    brightness.set_lighting("exact", "direct")
    assert brightness.value == LIT_BRIGHTNESS and slider.number.text() == "2.00×"
    assert not slider.reset.isEnabled()
    # A model that was trained without light is shown as it is, and changed by the same factor.
    assert brightness.of("learned") == 1
    brightness.set(3.0)
    assert (brightness.of("exact"), brightness.of("learned")) == (3, 1.5)
    brightness.set_lighting("learned", "direct")
    assert brightness.of("learned") == 3
    brightness.set(None)
    brightness.set_lighting("exact", "none")
    assert brightness.value == 1
    brightness.set(1.0)
    brightness.set_lighting("exact", "soft")
    assert brightness.value == 1 and slider.reset.isEnabled()
    slider.reset.click()
    assert brightness.value == LIT_BRIGHTNESS


def test_a_drag_is_one_undo_step_and_so_is_a_reset(
    qtbot: QtBot, make_window: Callable[..., MainWindow]
) -> None:
    window = make_window()
    brightness, stack = window.brightness, window.state.edits.stack
    slider = BrightnessSlider(brightness)
    qtbot.addWidget(slider)
    usual = brightness.value
    slider.slider.setSliderDown(True)
    for step in (3, 9, 16):
        slider.slider.setValue(step)
    assert brightness.value == 4 and stack.count() == 0
    slider.slider.setSliderDown(False)
    assert stack.count() == 1 and stack.undoText() == "brightness"
    slider.reset.click()
    assert brightness.value == usual and stack.count() == 2
    window.state.edits.undo()
    assert brightness.value == 4
    window.state.edits.undo()
    assert brightness.value == usual and not brightness.is_chosen
    window.state.edits.redo()
    assert brightness.value == 4


def test_the_kind_of_light_is_undone_among_the_edits(
    make_window: Callable[..., MainWindow],
) -> None:
    window = make_window(model=None)
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
    fingerprint = window.workspace.opened.fingerprint  # type: ignore[union-attr]
    assert window.preferences.volume(fingerprint).lighting == "auto"
    # What is kept for no later run is no edit.
    reference.choose(keep=False, lighting="none")
    assert not state.edits.stack.canUndo()
