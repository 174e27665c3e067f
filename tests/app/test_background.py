from __future__ import annotations

import threading

from pytestqt.qtbot import QtBot
from window_fakes import PATIENCE_S

from app.background import BackgroundCall
from model.errors import VolumeError


def test_the_result_arrives(qtbot: QtBot) -> None:
    call = BackgroundCall(threading.current_thread, "test")
    with qtbot.waitSignals([call.done, call.finished], order="strict") as signals:
        call.start()
    call.join()
    assert signals.all_signals_and_args[0].args[0] is not threading.current_thread()


def test_an_error_arrives_as_a_sentence(qtbot: QtBot) -> None:
    def fail() -> None:
        raise VolumeError("a.nrrd: the file is empty.")

    call = BackgroundCall(fail, "test")
    with qtbot.waitSignals([call.failed, call.finished], order="strict") as signals:
        call.start()
    call.join()
    assert signals.all_signals_and_args[0].args == ("a.nrrd: the file is empty.",)


def test_an_abandoned_call_only_finishes(qtbot: QtBot) -> None:
    may_return = threading.Event()
    call = BackgroundCall(lambda: may_return.wait(PATIENCE_S), "test")
    results: list[object] = []
    call.done.connect(results.append)
    call.start()
    call.abandon()
    with qtbot.waitSignal(call.finished):
        may_return.set()
    call.join()
    assert results == []
