from __future__ import annotations

import threading
from dataclasses import replace

import pytest
from PySide6.QtCore import QObject
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot
from ramp import make_tf
from window_fakes import PATIENCE_S, FakeEngine

from app.engines.client import EngineClient
from app.state.brightness import Brightness
from app.state.preferences import Preferences
from app.window import small_pictures
from app.window.small_pictures import SmallPictures
from model.scene.inputs import SceneInputs
from model.scene.view import View

SIZE = 8


def level(image: QImage) -> int:
    return image.pixelColor(SIZE // 2, SIZE // 2).red()


def test_the_reference_draws_while_the_ray_caster_is_compiled(
    qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(small_pictures, "PATIENCE_MS", 1)
    owner, compiled = QObject(), threading.Event()
    analyst, reference = (EngineClient(name, owner) for name in ("analyst", "reference"))
    engines = FakeEngine(), FakeEngine()

    def compile_first() -> FakeEngine:
        assert compiled.wait(PATIENCE_S)
        return engines[0]

    analyst.start(compile_first, "")
    reference.start(lambda: engines[1], "")
    brightness = Brightness(Preferences(None), owner)
    pictures = SmallPictures("presets", SIZE, analyst, reference, brightness, owner)
    inputs = SceneInputs.of(View(), make_tf())
    wanted = [inputs, replace(inputs, view=View(90.0))]
    try:
        with qtbot.waitSignal(pictures.drawn) as drawn:
            pictures.ask(wanted)
        assert drawn.args is not None
        assert [level(image) for image in drawn.args[0]] == pytest.approx([0, 26], abs=1)
        assert not engines[0].others
        # The ray caster's follow: they agree with everything else that it draws.
        with qtbot.waitSignal(pictures.drawn):
            compiled.set()
        assert len(engines[0].others) == len(engines[1].others) == 1
        # Once it is there, the reference is not asked; the pictures are as bright as the image.
        brightness.set(2.0)
        with qtbot.waitSignal(pictures.drawn) as brightest:
            pictures.ask(wanted)
        assert brightest.args is not None
        assert [level(image) for image in brightest.args[0]] == pytest.approx([0, 46], abs=1)
        qtbot.wait(20)
        assert (len(engines[0].others), len(engines[1].others)) == (2, 1)
        # In path-traced light, traced ones follow.
        with qtbot.waitSignals([pictures.drawn, pictures.drawn]):
            pictures.ask(wanted, traced=True)
        asked = engines[0].others[2:]
        assert [each.traced for each in asked] == [False, True]
        assert len(engines[1].others) == 1
    finally:
        compiled.set()
        for client in (analyst, reference):
            client.stop()
            client.join()
