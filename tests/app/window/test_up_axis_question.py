from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from pytestqt.qtbot import QtBot
from ramp import make_volume
from window_fakes import FakeBuilders

from app.engines.messages import UpAxisRequest
from app.window.main_window import MainWindow
from model.scene.orientation import AXES

WindowMaker = Callable[..., MainWindow]


def reopen(qtbot: QtBot, window: MainWindow, name: str) -> None:
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.open_volume(Path(name))


def test_it_is_asked_once_with_pictures(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window()
    bar = window.up_axis_bar
    assert bar.isVisible()
    qtbot.waitUntil(lambda: not bar.button("-y").icon().isNull())
    asked = [r for r in builders.analysts[-1].others if isinstance(r, UpAxisRequest)]
    assert 1 + len(asked[-1].more) == len(AXES)
    bar.button("-y").click()
    assert window.state.up_axis == "-y" and bar.isHidden()
    builders.volumes["other"] = make_volume("other", 300.0)
    reopen(qtbot, window, "other")
    assert bar.isVisible() and window.state.up_axis == "+z"
    reopen(qtbot, window, "ramp")
    assert bar.isHidden() and window.state.up_axis == "-y"


def test_who_leaves_it_is_not_asked_again(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window()
    window.up_axis_bar.dismissed.emit()
    reopen(qtbot, window, "ramp")
    assert window.up_axis_bar.isHidden()


def test_a_file_that_says_it_is_believed(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    builders.volumes["ramp"] = replace(make_volume(), up="+y")
    window = make_window()
    assert window.up_axis_bar.isHidden() and window.state.up_axis == "+y"
    window.state.set_up_axis("-x")
    reopen(qtbot, window, "ramp")
    assert window.state.up_axis == "-x"
