from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QObject, Signal
from ramp import make_tf

from app.engines.client import Channel, Clients
from app.engines.messages import Result
from app.engines.requests import IMAGES, IMAGES_B, Image
from app.state.image_scheduler import ImageScheduler
from model.rendering.raster import Raster
from model.scene.view import View

PANE = Raster(1000, 400)


class Client(QObject):
    """Keeps what it is asked for, and answers when the test says so."""

    is_ready = True
    settled = Signal()

    def __init__(self):
        super().__init__()
        self.asked = []
        self.abandoned = []
        self.is_held = False
        self.images = Channel(self, IMAGES, self)
        self.images_b = Channel(self, IMAGES_B, self)

    def open(self, channel):
        """It has the channels of A and B."""

    def submit(self, request):
        self.asked.append(request)
        (self.images if request.channel == IMAGES else self.images_b).accept(request)

    def abandon(self, channel):
        self.abandoned.append(channel)

    def hold(self, is_held):
        self.is_held = is_held

    def answer(self, is_last=True, width=10, channel=None):
        rgba = np.zeros((4, width, 4), np.float32)
        channel, request = channel or self.images, channel.newest if channel else self.asked[-1]
        channel.deliver(Result(request, Image(rgba, 0.1, is_last=is_last)))


names = "generator", "reference", "analyst"
generator, reference, analyst = (pytest.fixture(lambda: Client(), name=each) for each in names)


@pytest.fixture
def scheduler(state, generator, reference, analyst):
    clients = Clients(generator, reference, analyst)
    scheduler = ImageScheduler(state, clients, state)
    scheduler.raster = PANE
    yield scheduler
    scheduler.end()


def turn(state, azimuth):
    state.move_view(View(azimuth=azimuth))


def test_what_is_held_still_becomes_better(state, scheduler, generator, reference):
    turn(state, 10.0)
    for count, is_moving in ((1, True), (2, False)):
        # Not before the last moving images are there.
        scheduler._still.timeout.emit()
        for client in (generator, reference):
            assert [each.quality.live for each in client.asked] == [True, False][:count]
            client.answer(is_last=is_moving)
    turn(state, 11.0)
    assert generator.asked[-1].quality.live and reference.asked[-1].quality.live


def test_at_rest_each_engine_is_asked_once_for_all_pixels(state, scheduler, generator, reference):
    for client in (generator, reference):
        scheduler.send()
        assert len(client.asked) == 1
        client.answer(is_last=False)
        client.answer()
        # It is there: the same is not drawn again.
        scheduler.send()
        assert len(client.asked) == 1
        request = client.asked[0]
        assert (request.inputs, request.quality.pixels) == (state.inputs, PANE)
        assert not request.quality.live
    state.set_view(View(azimuth=50.0))
    for client in (generator, reference):
        assert client.asked[-1].inputs == state.inputs
        assert not client.asked[-1].quality.live


def test_the_next_image_is_asked_for_before_the_last_is_shown(state, scheduler, reference):
    asked = []
    reference.images.answered.connect(lambda _result: asked.append(len(reference.asked)))
    turn(state, 10.0)
    turn(state, 20.0)
    reference.answer()
    assert asked == [2] and reference.asked[-1].inputs == state.inputs


def test_answers_wait_for_the_first_sharp_image_and_no_longer(
    qtbot, state, scheduler, reference, analyst
):
    scheduler.send()
    assert analyst.is_held
    reference.answer(is_last=False)
    assert analyst.is_held
    reference.answer(is_last=False, width=PANE.width)
    assert not analyst.is_held
    state.set_view(View(azimuth=50.0))
    assert analyst.is_held
    # What moves is asked about; so is what takes long.
    turn(state, 60.0)
    assert not analyst.is_held
    scheduler._patience.setInterval(1)
    state.finish_view()
    assert analyst.is_held
    qtbot.waitUntil(lambda: not analyst.is_held)


def test_images_at_rest_make_way(qtbot, state, scheduler, reference, analyst):
    scheduler.send()
    scheduler.make_way(True)
    assert IMAGES in reference.abandoned and not analyst.is_held
    state.set_view(View(azimuth=50.0))
    reference.answer()
    assert reference.asked[-1].quality.live and reference.asked[-1].inputs == state.inputs
    scheduler.make_way(False)
    assert not reference.asked[-1].quality.live and reference.asked[-1].inputs == state.inputs
    # What it makes way for may never come.
    scheduler._later.setInterval(1)
    scheduler.make_way(True)
    count = len(reference.asked)
    qtbot.waitUntil(lambda: len(reference.asked) > count)


def test_what_nobody_sees_is_not_asked_for(state, scheduler, generator, reference):
    scheduler.hidden = frozenset({reference})
    scheduler.send()
    turn(state, 10.0)
    assert not reference.asked and len(generator.asked) == 2
    # Nor what is of a TF of another scale than the volume's.
    scheduler.scale, scheduler.hidden = "log", frozenset()
    state.finish_view()
    assert not reference.asked and len(generator.asked) == 2


def test_two_path_tracers_share_the_time_while_both_images_move(
    state, scheduler, generator, reference
):
    scheduler.generator_follows = True
    scheduler.send()
    reference.asked.clear()
    turn(state, 10.0)
    half = scheduler.stop.live_seconds / 2
    for client in (generator, reference):
        assert client.asked[-1].quality.live and client.asked[-1].inputs.view.azimuth == 10.0
        assert client.asked[-1].stop.live_seconds == half
    assert generator.asked[-1].quality.pixels == PANE
    state.finish_view()
    # The ground truth has more and more samples, the generator one of every pixel.
    assert generator.asked[-1].stop == replace(scheduler.stop, samples=1)
    assert reference.asked[-1].stop == scheduler.stop
    # Out of sight it leaves the drawing to the reference.
    scheduler.hidden = frozenset({generator})
    turn(state, 30.0)
    assert reference.asked[-1].stop.live_seconds == 2 * half


def test_b_is_drawn_in_turn_with_a_and_alone_where_only_its_tf_moves(state, scheduler, reference):
    scheduler.compares = True
    state.tf_input.compare(True)
    b = reference.images_b

    def asked():
        """What was asked since, of A or B, and whether for while something moves."""
        found = [("AB"[r.channel == IMAGES_B], r.quality.live) for r in reference.asked]
        reference.asked.clear()
        return found

    # Both are refined, A first.
    assert asked() == [("A", False), ("B", False)]
    state.tf_input.move(make_tf(140.0))
    # A shows what it did: it waits until nothing moves, and becomes better then.
    assert asked() == [("B", True)] and reference.abandoned == [IMAGES]
    state.tf_input.finish()
    assert asked() == [("A", False), ("B", False)]
    assert b.newest.inputs == state.inputs_of("B")
    for channel in (reference.images, b):
        reference.answer(channel=channel)
    turn(state, 10.0)
    # Each has half of the time.
    half = scheduler.stop.live_seconds / 2
    assert [r.stop.live_seconds for r in reference.asked] == [half, half]
    assert asked() == [("A", True), ("B", True)]
