from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from PySide6.QtCore import QObject

from app.engines import requests
from app.engines.messages import Result
from app.state.sensitivity_asker import REST_SIZE, SensitivityAsker
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster

SLOW = ("exact", 512), ("learned", 128)
BOTH, EXACT, LEARNED = ["exact", "learned"], ["exact"], ["learned"]
OLDEST, SHARE = 0.5, 0.2
UNPAID = 0.015
"""Part of a drag that its last answers may take more: what follows it makes up for them."""


class Client(QObject):
    """Keeps what it is asked for on its channels until the test has it answered."""

    def __init__(self):
        super().__init__()
        self.channels = {}
        self.waiting = {}

    def open(self, channel):
        self.channels[channel.name] = channel

    def submit(self, request):
        self.waiting[request.channel] = request
        self.channels[request.channel].accept(request)

    def abandon(self, channel):
        self.waiting.pop(channel, None)


@dataclass
class Asking:
    """An asker whose engines take as long as the test says."""

    state: ViewerState
    asked: SensitivityState = field(default_factory=SensitivityState)
    now: float = 100.0
    exact: Client = field(default_factory=Client)
    learned: Client = field(default_factory=Client)
    cost: Callable[[requests.Request], float] = lambda _request: 0.01

    def __post_init__(self):
        self.asker = SensitivityAsker(
            self.state, self.asked, {"exact": self.exact, "learned": self.learned},
            self.state, lambda: self.now,
        )  # fmt: skip
        self.asked.choose(whole_curve=True)
        self.asker.start_volume((100.0, 200.0), "exact")
        self.asker.show(Raster(720, 512))
        self.asker.ask()

    def answer(self, note=lambda: None):
        """Answer all that waits, and return the seconds that it took.

        What is noted is noted just before an answer replaces the one before.
        """
        began = self.now
        while client := next((one for one in (self.exact, self.learned) if one.waiting), None):
            name, request = next(iter(client.waiting.items()))
            del client.waiting[name]
            seconds = self.cost(request)
            self.now += seconds
            note()
            client.channels[name].deliver(Result(request, requests.Image(np.ones(1), seconds)))
        return self.now - began

    def drag(self, seconds, picture):
        """Turn the view; return the answers' share and the greatest age of a shown one."""
        began, spent, ages = self.now, 0.0, [0.0]
        while self.now < began + seconds:
            self.turn()
            self.now += picture
            ages.append(self.age(began))
            shown = requests.ImageRequest(self.state.inputs, requests.Quality(180, live=True))
            self.turn()
            self.asker.follow_image(Result(shown, requests.Image(np.ones(1), picture)))
            if self.exact.waiting:
                # The next picture, which was asked for at once, is drawn first.
                self.now += picture
                spent += self.answer(lambda: ages.append(self.age(began)))
        return spent / (self.now - began), max(ages)

    def turn(self):
        """Move the view to where it tells the time."""
        self.state.move_view(replace(self.state.view, azimuth=self.now))

    def age(self, began):
        """Age of the oldest answer that is shown, since what it shows was there last."""
        shown = self.asker.region, self.asker.visibility, self.asker.field
        times = [answer.request.inputs.view.azimuth for answer in shown if answer is not None]
        return self.now - min(max(time, began) for time in times)


@pytest.fixture
def asking(state):
    """Of a volume without a model."""
    asking = Asking(state)
    yield asking
    asking.asker.stop()


def costs(pixel, fixed):
    """Time of answers, in part by their pixels: a derivative's is the longest."""
    weights = {
        requests.RegionSensitivityRequest: 1.0,
        requests.ValueSensitivityRequest: 0.5,
        requests.VisibilityRequest: 0.3,
    }

    def cost(request):
        pixels = request.quality.pixels
        return weights[type(request)] * (pixel * pixels.width * pixels.height + fixed)

    return cost


@pytest.mark.parametrize("picture", [0.02, 0.07, 0.12])
@pytest.mark.parametrize(
    ("pixel", "fixed"), [(2e-8, 2e-4), (5e-7, 1e-3), (3e-6, 2e-3), (9e-6, 2e-3), (1e-6, 0.018)]
)
def test_while_something_moves_answers_take_a_fifth_and_none_gets_old(
    asking, picture, pixel, fixed
):
    asking.cost = costs(pixel, fixed)
    asking.asked.keep(140.0)
    asking.answer()
    share, oldest = asking.drag(6.0, picture)
    assert share <= SHARE + UNPAID
    assert oldest <= OLDEST
    # What is cheap has as many pixels as at rest, and is there with nearly each picture.
    answer = asking.asker.region
    assert answer is not None and answer.request.quality.live
    sizes = {2e-8: 256, 9e-6: 48}
    assert answer.request.quality.size == sizes.get(pixel, answer.request.quality.size)
    asking.state.finish_view()
    asking.answer()
    assert asking.asker.is_fresh(asking.asker.region)
    assert asking.asker.region is not None and not asking.asker.region.request.quality.live


@pytest.mark.parametrize(("fixed", "most"), [(0.08, SHARE + UNPAID), (0.15, 0.32)])
def test_where_the_smallest_answers_take_too_long_none_gets_older_than_a_second(
    asking, fixed, most
):
    asking.cost = costs(1e-6, fixed)
    asking.answer()
    share, oldest = asking.drag(20.0, 0.05)
    assert share <= most
    assert OLDEST < oldest <= 1.0


def test_where_the_mouse_rests_in_a_drag_the_answers_follow(asking, qtbot):
    asking.cost = costs(3e-6, 1e-3)
    asking.answer()
    asking.drag(1.0, 0.05)
    asking.turn()
    shown = requests.ImageRequest(asking.state.inputs, requests.Quality(180, live=True))
    asking.asker.follow_image(Result(shown, requests.Image(np.ones(1), 0.05)))
    assert not asking.exact.waiting
    asking.now += OLDEST
    # No other image comes.
    qtbot.waitUntil(lambda: bool(asking.exact.waiting))
    asking.answer()
    assert asking.asker.is_fresh(asking.asker.region)


def test_while_something_moves_a_curve_that_nobody_sees_is_not_asked_for(asking):
    asking.asked.choose(whole_curve=False)
    asking.answer()
    before = asking.asker.region
    assert before is not None and asking.asker.is_fresh(before)
    asking.drag(1.0, 0.05)
    assert asking.asker.region is before
    answer = asking.asker.visibility
    assert answer is not None and answer.request.quality.live
    asking.state.finish_view()
    asking.answer()
    assert asking.asker.is_fresh(asking.asker.region)
    # Nor does anything stay of who is not asked.
    asking.asked.choose(whole_curve=True)
    asking.asker.set_learned(128)
    asking.answer()
    assert set(asking.asker.regions) == set(BOTH)
    asking.drag(1.0, 0.05)
    assert set(asking.asker.regions) == set(EXACT)


@pytest.mark.parametrize(
    ("engine", "has_model", "slow", "question", "rest", "live"),
    [
        ("automatic", True, 0, "signed", BOTH, EXACT),
        ("automatic", True, 0, "field", BOTH, EXACT),
        # Of the generator, it is made on demand only.
        ("automatic", True, 0, "change", EXACT, EXACT),
        ("learned", True, 0, "change", LEARNED, []),
        ("learned", True, 0, "signed", LEARNED, LEARNED),
        ("learned", False, 0, "signed", [], []),
        ("exact", False, 0, "field", EXACT, EXACT),
        # Where the ray caster is slow, the generator comes first.
        ("automatic", True, 1, "field", BOTH[::-1], LEARNED),
        ("automatic", True, 1, "signed", BOTH, EXACT),
        ("automatic", False, 1, "field", EXACT, EXACT),
        # Where neither keeps up, the exact one answers with fewer pixels.
        ("automatic", True, 2, "field", BOTH[::-1], EXACT),
    ],
)
def test_who_answers(asking, engine, has_model, slow, question, rest, live):
    asker = asking.asker
    asking.asked.keep(140.0)
    asking.asked.choose(engine=engine)
    if question != "field":
        asking.asked.choose(measure=question)
        question = "region"
    if has_model:
        asker.set_learned(128)
    for name, size in SLOW[:slow]:
        asker.pace.note((name, "field"), size, 2.0)
    assert asker.order(question) == rest
    assert asker.order(question, live=True) == live
    # A model whose image is hidden answers only where it was chosen.
    asker.see_model(False)
    assert ("learned" in asker.order(question)) == (engine == "learned" and has_model)
    asking.asked.choose(shown=False)
    assert asker.order(question) == []


def test_answers_at_rest_are_as_wide_as_the_reference(asking):
    asker = asking.asker
    asker.show(Raster(1280, 320))
    asker.set_learned(128)
    assert asker.quality("exact", "field").pixels == Raster(1280, 320)
    assert asker.quality("exact", "region").pixels == Raster(4 * REST_SIZE, REST_SIZE)
    assert asker.quality("learned", "field").pixels == Raster(128, 128)
    # The numbers of a region that takes long hardly depend on its pixels.
    asker.pace.note(("exact", "signed"), REST_SIZE, 6.0)
    assert asker.quality("exact", "region").size < REST_SIZE
    assert asker.quality("exact", "field").size == 320
    # The exact answers stay while the model's image is hidden and shown again.
    asking.asked.keep(140.0)
    asking.answer()
    for is_seen, who in ((False, EXACT), (True, BOTH)):
        exact = asker.regions["exact"], asker.fields["exact"]
        asker.see_model(is_seen)
        assert (asker.regions.get("exact"), asker.fields.get("exact")) == exact
        asking.answer()
        assert set(asker.regions) == set(asker.fields) == set(who)
