from __future__ import annotations

from pathlib import Path

from pytestqt.qtbot import QtBot
from ramp import make_tf, make_volume

from app.engines.requests import BatchRequest
from app.window.main_window import MainWindow
from model.scene.view import AXES


def reopen(qtbot: QtBot, window: MainWindow, name: str) -> None:
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.opening.open(Path(name))


def test_it_is_asked_once_with_pictures(qtbot, make_window, builders):
    window = make_window()
    bar = window.up_axis_card
    assert bar.isVisible()
    # Before there are pictures it is as high as with them.
    height = bar.sizeHint().height()

    def asked() -> list[BatchRequest]:
        return [r for r in builders.analysts[-1].others if r.channel == "up axis"]

    def level(axis: str) -> int:
        return bar.button(axis).icon().pixmap(8, 8).toImage().pixelColor(4, 4).red()

    # The fake's images are each brighter than the one before.
    qtbot.waitUntil(lambda: level(AXES[-1]) > level(AXES[1]) > 0)
    # The reference may have drawn the first ones.
    qtbot.waitUntil(lambda: bool(asked()))
    assert 1 + len(asked()[-1].more) == len(AXES)
    assert bar.sizeHint().height() == height
    # The pictures follow the TF.
    window.state.tf_input.set(make_tf(), "preset")
    qtbot.waitUntil(lambda: asked()[-1].inputs.opacity_tf == make_tf().opacity)
    bar.button("-y").click()
    assert window.state.up_axis == "-y" and bar.isHidden()
    builders.volumes["other"] = make_volume("other", 300.0)
    reopen(qtbot, window, "other")
    assert bar.isVisible() and window.state.up_axis == "+z"
    reopen(qtbot, window, "ramp")
    assert bar.isHidden() and window.state.up_axis == "-y"
    # Who leaves it, or chooses an axis elsewhere, is not asked again.
    for name, answer in (
        ("third", window.up_axis_card.leave.click),
        ("fourth", lambda: window.state.set_up_axis("-x")),
    ):
        builders.volumes[name] = make_volume(name, 400.0 + len(name))
        reopen(qtbot, window, name)
        assert bar.isVisible()
        answer()
        axis = window.state.up_axis
        reopen(qtbot, window, "ramp")
        reopen(qtbot, window, name)
        assert bar.isHidden() and window.state.up_axis == axis
