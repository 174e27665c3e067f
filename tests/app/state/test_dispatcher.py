"""Requests to the engines, by the times that their images take."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QObject

from app.engines.client import Channel
from app.engines.messages import Result
from app.engines.requests import IMAGES, Request
from app.state.dispatcher import (
    FIRST_SIZE,
    LONGEST_SECONDS,
    REST_SECONDS,
    Dispatcher,
)
from app.state.exactness import STOPS
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.view import View

PANE = Raster(1000, 400)
STAND_IN = "stand-in"


class Client(QObject):
    """Keeps what it is asked for, and answers when the test says so."""

    is_ready = True
    is_held = False
    by_raycast = False

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[Request] = []
        self.abandoned: list[str] = []
        self.channels: dict[str, Channel] = {}
        self.images = Channel(self, IMAGES, self)  # type: ignore[arg-type]

    def open(self, channel: Channel) -> None:
        self.channels[channel.name] = channel

    def submit(self, request: Request) -> None:
        self.asked.append(request)

    def abandon(self, channel: str) -> None:
        self.abandoned.append(channel)

    def answer(self, seconds_per_pixel: float) -> Request:
        """Answer the newest request, at a speed."""
        request = self.asked[-1]
        pixels = request.quality.pixels
        coarse = request.quality.coarseness
        seconds = seconds_per_pixel * pixels.width * pixels.height / coarse
        result = Result(request, object(), None, seconds)  # type: ignore[arg-type]
        self.channels[request.channel].deliver(result)
        return request


@pytest.fixture
def clients() -> list[Client]:
    return [Client(), Client(), Client()]


@pytest.fixture
def dispatcher(state: ViewerState, clients: list[Client]) -> Dispatcher:
    generator, reference, analyst = clients
    stand_in = Channel(analyst, STAND_IN, analyst)  # type: ignore[arg-type]
    dispatcher = Dispatcher(state, generator, reference, stand_in, state)  # type: ignore[arg-type]
    dispatcher.change(raster=PANE)
    return dispatcher


def test_every_pixel_of_the_pane_is_drawn_in_the_end(
    dispatcher: Dispatcher, clients: list[Client]
) -> None:
    generator, reference, _ = clients
    # Twice as long as an image at rest may take.
    slow = 2 * REST_SECONDS / (PANE.width * PANE.height)
    dispatcher.send()
    first = reference.answer(slow)
    assert first.quality.pixels.width < PANE.width
    while reference.asked[-1] is not first:
        first = reference.answer(slow)
    assert first.quality.pixels == PANE
    assert not first.quality.live
    # The generator has one size: it is asked once.
    assert len(generator.asked) == 1
    # The next image begins with what can be drawn in time.
    dispatcher.send()
    pixels = reference.asked[-1].quality.pixels
    assert slow * pixels.width * pixels.height <= REST_SECONDS


def test_what_takes_minutes_is_left_coarse(dispatcher: Dispatcher, clients: list[Client]) -> None:
    reference = clients[1]
    slow = 2.1 * LONGEST_SECONDS / (PANE.width * PANE.height)
    dispatcher.change(begins_coarse=True)
    dispatcher.send()
    coarse = reference.answer(slow)
    for _ in range(10):
        newest = reference.answer(slow)
    pixels = newest.quality.pixels
    assert coarse.quality.pixels.width < pixels.width < PANE.width
    assert LONGEST_SECONDS / 8 < slow * pixels.width * pixels.height <= LONGEST_SECONDS / 2
    # Unless the user has chosen the number of pixels.
    dispatcher.change(is_fixed=True, begins_coarse=False)
    dispatcher.send()
    assert reference.asked[-1].quality.pixels == PANE


def test_the_ray_casters_sharp_image_comes_before_vtks(
    dispatcher: Dispatcher, clients: list[Client]
) -> None:
    _, reference, stand_in = clients
    dispatcher.change(may_stand_in=True)
    slow = 2 * REST_SECONDS / (PANE.width * PANE.height)
    dispatcher.send()
    assert stand_in.asked[-1].quality.pixels == PANE
    # No coarse image of VTK's takes the place of the sharp one.
    assert reference.answer(slow).quality.pixels == PANE
    assert len(reference.asked) == 1


def test_a_held_reference_leaves_the_first_image_to_the_ray_caster(
    dispatcher: Dispatcher, clients: list[Client]
) -> None:
    generator, reference, stand_in = clients
    dispatcher.change(may_stand_in=True)
    reference.is_held, reference.is_ready, stand_in.is_ready = True, False, False
    dispatcher.send()
    first = stand_in.answer(1e-7)
    assert first.quality.pixels.width * first.quality.pixels.height <= 1.1 * FIRST_SIZE**2
    # All pixels follow at once, and nothing more after them.
    assert stand_in.answer(1e-7).quality.pixels == PANE
    assert len(stand_in.asked) == 2
    # The newest of its own requests is what it draws once it begins.
    reference.is_held, reference.is_ready = False, True
    assert reference.asked[-1].sequence > stand_in.asked[-1].sequence
    # A model that comes later has nothing else drawn anew.
    before = len(reference.asked), len(stand_in.asked)
    dispatcher.send(generator_only=True)
    assert (len(reference.asked), len(stand_in.asked)) == before
    assert generator.asked[-1].inputs == reference.asked[-1].inputs


def test_a_drag_calls_off_what_is_being_refined(
    state: ViewerState, dispatcher: Dispatcher, clients: list[Client]
) -> None:
    _, reference, stand_in = clients
    dispatcher.change(may_stand_in=True)
    dispatcher.send()
    count = len(reference.asked)
    state.move_view(View(azimuth=10.0))
    assert IMAGES in reference.abandoned
    assert stand_in.asked[-1].stands_in
    # The image that was under way comes late: nothing finer of the old view is asked for.
    reference.answer(1e-5)
    assert len(reference.asked) == count
    state.finish_view()
    assert len(reference.asked) == count + 1


def drag(state: ViewerState, clients: list[Client]) -> Client:
    """Move the view by a little, and return who is asked for a live image."""
    counts = [len(client.asked) for client in clients]
    state.move_view(View(azimuth=state.view.azimuth + 1.0))
    (drawer,) = [
        client for client, count in zip(clients[1:], counts[1:], strict=True)
        if len(client.asked) > count
    ]  # fmt: skip
    assert drawer.asked[-1].quality.live
    return drawer


def test_path_traced_light_is_seen_while_something_moves_where_it_is_denoised(
    state: ViewerState, dispatcher: Dispatcher, clients: list[Client]
) -> None:
    _, reference, stand_in = clients
    dispatcher.change(may_stand_in=True, begins_coarse=True)
    dispatcher.change(most_samples=8)
    state.move_view(View(azimuth=10.0))
    # Noisy as it would be, soft light is seen in its place.
    assert stand_in.asked[-1].quality.live and not reference.asked
    dispatcher.change(draws_live=True)
    state.move_view(View(azimuth=20.0))
    moved = reference.asked[-1]
    assert moved.quality.live and moved.quality.samples == 1
    assert moved.inputs.view.azimuth == 20
    # At a pixel's pace, as many as ten images a second have.
    for azimuth in range(30, 60):
        reference.answer(1e-6)
        state.move_view(View(azimuth=float(azimuth)))
    pixels = reference.asked[-1].quality.pixels
    assert 0.05 < 1e-6 * pixels.width * pixels.height <= 0.1
    state.finish_view()
    assert len(stand_in.asked) == 1


def test_the_generator_of_path_traced_light_draws_what_the_reference_does_once(
    state: ViewerState, dispatcher: Dispatcher, clients: list[Client]
) -> None:
    generator, reference, _ = clients
    dispatcher.change(begins_coarse=True, draws_live=True, generator_follows=True)
    dispatcher.change(most_samples=8)
    # While something moves it draws alone, at its own pace, and the reference stops.
    for azimuth in range(10, 40):
        state.move_view(View(azimuth=float(azimuth)))
        generator.answer(1e-6)
    assert not reference.asked
    assert reference.abandoned
    pixels = generator.asked[-1].quality.pixels
    assert 0.06 < 1e-6 * pixels.width * pixels.height < 0.13
    state.finish_view()
    for _ in range(12):
        reference.answer(1e-7)
    # The ground truth has more and more samples, the generator one of every pixel.
    assert reference.asked[-1].quality.samples == 8
    assert generator.asked[-1].quality.samples == 1
    assert generator.asked[-1].quality.pixels == PANE
    # Alone in sight, it is drawn all the same.
    dispatcher.change(hidden=frozenset({reference}))  # type: ignore[arg-type]
    state.move_view(View(azimuth=20.0))
    state.finish_view()
    assert generator.asked[-1].inputs.view.azimuth == 20
    assert not generator.asked[-1].quality.live


@pytest.mark.parametrize("lit", [False, True])
def test_an_image_that_moves_takes_as_long_as_is_chosen(
    state: ViewerState, dispatcher: Dispatcher, clients: list[Client], lit: bool
) -> None:
    dispatcher.change(begins_coarse=lit)
    widths = []
    for step in STOPS.values():
        dispatcher.change(exactness=step)
        for _ in range(4):
            drag(state, clients).answer(1e-6)
        pixels = drag(state, clients).asked[-1].quality.pixels
        coarse = clients[1].asked[-1].quality.coarseness
        widths.append(pixels.width)
        seconds = 1e-6 * pixels.width * pixels.height / coarse
        assert seconds <= step.live_seconds
        state.finish_view()
        if lit:
            # The first one at rest is coarse.
            clients[1].answer(1e-6)
        assert clients[1].asked[-1].quality.error == step.error
    assert widths == sorted(widths) and widths[0] < widths[-1]
