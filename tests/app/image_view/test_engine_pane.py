import threading
from dataclasses import replace

from window_fakes import FakeEngine, make_request

from app.state.at_work import PATIENCE_MS
from model.scene.view import View


def red(pane):
    """Sequence number of the image that is shown."""
    return pane.canvas.image.pixelColor(0, 0).red()


def test_images_are_shown_brighter_at_once(qtbot, pane):
    pane.client.start(FakeEngine, "Loading …")
    pane.brightness.set(2.0)
    with qtbot.waitSignal(pane.client.settled):
        pane.client.submit(make_request(7))
    assert red(pane) == 14
    pane.brightness.set(0.5)
    assert red(pane) == 4
    # Of a failed engine, the message stays.
    pane.client.fail("It failed.")
    pane.brightness.set(1.0)
    assert red(pane) == 7 and pane.canvas.message == "It failed."


def test_an_image_that_is_not_up_to_date_says_so_once_the_next_takes_long(qtbot, pane):
    engine = FakeEngine(gate=threading.Semaphore(1))
    pane.client.start(lambda: engine, "Loading …")
    with qtbot.waitSignal(pane.client.settled):
        pane.client.submit(make_request(1))
    assert pane.status != "drawing …"
    # A finer image of the same inputs: what is shown is right.
    pane.client.submit(make_request(2))
    assert pane.status != "drawing …" and not pane._patience.isActive()
    turned = replace(make_request(3), inputs=replace(make_request(3).inputs, view=View(80.0)))
    pane.client.submit(turned)
    assert pane.status != "drawing …"
    qtbot.waitUntil(lambda: pane.status == "drawing …", timeout=PATIENCE_MS + 1000)
    engine.gate.release(2)
    qtbot.waitUntil(lambda: red(pane) == 3)
    assert pane.status != "drawing …"
    # Under another light, an image of the same inputs is another one.
    gate = threading.Semaphore(0)
    pane.client.start(lambda: FakeEngine(gate=gate), "")
    pane.client.submit(replace(turned, sequence=4))
    qtbot.waitUntil(lambda: pane.status == "drawing …", timeout=PATIENCE_MS + 1000)
    pane.client.fail("It failed.")
    assert pane.status != "drawing …"
    gate.release()
