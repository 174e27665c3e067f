"""Pictures in the menu of lights."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from PySide6.QtGui import QAction
from pytestqt.qtbot import QtBot
from window_fakes import FakeBuilders

from app.engines.requests import ImageRequest
from app.state.light_pictures import LIGHTS, PIXELS
from app.window.main_window import MainWindow
from model import kernel_cache
from model.scene.view import View

Maker = Callable[..., MainWindow]


def actions(window: MainWindow) -> dict[str, QAction]:
    menu = window.reference_controls.light.menu()
    texts = {"none": "None", "direct": "Direct", "soft": "Soft", "shadows": "Shad", "path": "Path"}
    return {
        name: next(each for each in menu.actions() if each.text().startswith(text))
        for name, text in texts.items()
    }


def test_each_light_has_a_picture_of_what_is_seen(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = make_window(model=None)
    lights = window.workspace.reference.lights
    before = len(builders.references)
    assert all(each.icon().isNull() for each in actions(window).values())
    window.reference_controls.light.menu().aboutToShow.emit()
    # There is room for each before it is there.
    assert not any(each.icon().isNull() for each in actions(window).values())
    qtbot.waitUntil(lambda: tuple(lights.pictures) == LIGHTS)
    assert [each.lighting for each in builders.settings[before:]] == list(LIGHTS)
    drawn = builders.references[before:]
    assert all(each.closed for each in drawn)
    for engine in drawn:
        (request,) = engine.requests
        assert isinstance(request, ImageRequest) and request.quality.size == PIXELS
        assert request.inputs.view == window.state.for_picture(window.state.view)
    # As long as nothing changes they are there at once.
    window.reference_controls.light.menu().aboutToShow.emit()
    assert len(builders.references) == before + len(LIGHTS)
    window.state.set_view(View(70, 20))
    window.reference_controls.light.menu().aboutToShow.emit()
    qtbot.waitUntil(lambda: len(builders.references) == before + 2 * len(LIGHTS))
    qtbot.waitUntil(lambda: tuple(lights.pictures) == LIGHTS)


def test_nothing_is_compiled_for_a_picture(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    builders.prepared = {"direct", "path"}
    window = make_window(model=None)
    window.workspace.reference.choose(lighting="shadows")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    lights = window.workspace.reference.lights
    window.reference_controls.light.menu().aboutToShow.emit()
    qtbot.waitUntil(lambda: set(lights.pictures) == {"direct", "shadows", "path"})
    assert actions(window)["soft"].icon().isNull()


def test_a_light_that_fails_has_none(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = make_window(model=None)
    lights = window.workspace.reference.lights
    builders.failing = "soft"
    window.reference_controls.light.menu().aboutToShow.emit()
    qtbot.waitUntil(lambda: set(lights.pictures) == set(LIGHTS) - {"soft"})
    assert window.notice.isHidden()


def test_what_is_prepared_is_known_by_the_stamp(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert not kernel_cache.is_prepared("uint8", "direct")
    kernel_cache.stamp().parent.mkdir(parents=True)
    kernel_cache.stamp().touch()
    assert kernel_cache.path_traced_seconds() == math.inf
    kernel_cache.stamp().write_text("0.180")
    assert kernel_cache.path_traced_seconds() == 0.18
    assert kernel_cache.is_prepared("uint8", "direct")
    assert not kernel_cache.is_prepared("int32", "direct")
