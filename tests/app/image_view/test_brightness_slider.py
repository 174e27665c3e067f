from __future__ import annotations

import pytest
from pytestqt.qtbot import QtBot

from app.image_view.brightness_slider import BrightnessSlider
from app.state.brightness import BRIGHTEST, DARKEST, Brightness
from app.state.preferences import Preferences
from model.rendering.brightness import LIT_BRIGHTNESS


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
    brightness.set_lighting("exact", "global")
    assert brightness.value == 1 and slider.reset.isEnabled()
    slider.reset.click()
    assert brightness.value == LIT_BRIGHTNESS
