import threading

from window_fakes import PATIENCE_S

from app.engines.background import BackgroundCall
from model.errors import VolumeError


def test_the_result_arrives(qtbot):
    call = BackgroundCall(threading.current_thread, "test")
    results = []
    call.done.connect(results.append)
    with qtbot.waitSignals([call.done, call.finished], order="strict"):
        call.start()
    call.join()
    assert len(results) == 1
    assert results[0] is not threading.current_thread()


def test_an_error_arrives_as_a_sentence(qtbot):
    def fail():
        raise VolumeError("a.nrrd: the file is empty.")

    call = BackgroundCall(fail, "test")
    errors = []
    call.failed.connect(errors.append)
    with qtbot.waitSignals([call.failed, call.finished], order="strict"):
        call.start()
    call.join()
    assert errors == ["a.nrrd: the file is empty."]


def test_an_abandoned_call_only_finishes(qtbot):
    may_return = threading.Event()
    call = BackgroundCall(lambda: may_return.wait(PATIENCE_S), "test")
    results = []
    call.done.connect(results.append)
    call.start()
    call.abandon()
    with qtbot.waitSignal(call.finished):
        may_return.set()
    call.join()
    assert results == []
