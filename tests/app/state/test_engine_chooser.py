from __future__ import annotations

import pytest

from app.state.engine_chooser import REST_SIZE, EngineChooser
from app.state.exactness import STOPS, USUAL
from app.state.pace import LIVE_SECONDS, Pace
from app.state.sensitivity_state import SensitivityState
from model.rendering.raster import Raster


@pytest.fixture
def chooser() -> EngineChooser:
    """Of a volume with a model, unlit."""
    chooser = EngineChooser(SensitivityState())
    chooser.exact_source, chooser.learned_size, chooser.picture = "exact", 128, Raster(512, 512)
    return chooser


def choose(chooser: EngineChooser, **choices: object) -> None:
    chooser._asked.choose(**choices)


def test_the_exact_engine_comes_first_and_answers_alone_while_dragging(
    chooser: EngineChooser,
) -> None:
    assert chooser.order("signed", live=False) == ["exact", "learned"]
    assert chooser.order("signed", live=True) == ["exact"]
    assert chooser.order("field", live=True) == ["exact"]


def test_the_user_chooses(chooser: EngineChooser) -> None:
    choose(chooser, engine="learned")
    assert chooser.order("signed", live=True) == ["learned"]
    chooser.learned_size = None
    assert chooser.order("signed", live=False) == []
    choose(chooser, engine="exact")
    assert chooser.order("field", live=False) == ["exact"]
    choose(chooser, shown=False)
    assert chooser.order("field", live=False) == []


def test_where_the_ray_caster_is_slow_the_generator_comes_first(chooser: EngineChooser) -> None:
    chooser.pace.note(("exact", "field"), 512, 2.0)
    assert chooser.order("field", live=False) == ["learned", "exact"]
    assert chooser.order("field", live=True) == ["learned"]
    assert chooser.order("signed", live=True) == ["exact"]
    chooser.learned_size = None
    assert chooser.order("field", live=True) == ["exact"]


def test_where_neither_keeps_up_the_exact_one_answers_with_fewer_pixels(
    chooser: EngineChooser,
) -> None:
    for name, size in (("exact", 512), ("learned", 128)):
        chooser.pace.note((name, "field"), size, 2.0)
    assert chooser.order("field", live=False) == ["learned", "exact"]
    assert chooser.order("field", live=True) == ["exact"]
    assert chooser.quality("exact", "field", live=True).size < 128


def test_the_first_answer_with_what_is_loaded_for_it_counts_no_more_than_once() -> None:
    pace = Pace()
    pace.note("field", 100, 15.0)
    assert pace.expected("field", 100) == pytest.approx(15.0)
    pace.note("field", 100, 0.05)
    assert pace.expected("field", 100) == pytest.approx(0.05)
    pace.note("field", 100, 0.15)
    assert pace.expected("field", 100) == pytest.approx(0.1)
    pace.forget()
    assert pace.expected("field", 100) is None


def test_the_generators_size_of_change_is_made_on_demand_only(chooser: EngineChooser) -> None:
    assert chooser.order("change", live=False) == ["exact"]
    choose(chooser, engine="learned")
    assert chooser.order("change", live=False) == ["learned"]


def test_sizes(chooser: EngineChooser) -> None:
    assert chooser.quality("learned", "field", live=True).size == 128
    assert chooser.quality("exact", "field").size == 512
    assert chooser.quality("exact", "signed").size == REST_SIZE
    assert chooser.quality("exact", "visibility", live=True).size <= 128
    chooser.picture = Raster(96, 96)
    assert chooser.quality("exact", "signed").size == 96
    assert chooser.quality("exact", "field", live=True).size <= 96


def test_the_ray_casters_answers_are_as_wide_as_the_reference(chooser: EngineChooser) -> None:
    chooser.picture = Raster(1280, 320)
    assert chooser.quality("exact", "field").pixels == Raster(1280, 320)
    assert chooser.quality("exact", "signed").pixels == Raster(4 * REST_SIZE, REST_SIZE)
    live = chooser.quality("exact", "field", live=True)
    assert live.pixels == Raster(4 * live.size, live.size)
    assert chooser.quality("learned", "field").pixels == Raster(128, 128)


def test_live_sizes_follow_the_time_they_take() -> None:
    pace = Pace()
    assert pace.live_size("field", 256, LIVE_SECONDS) == 128
    pace.note("field", 128, LIVE_SECONDS / 8)
    assert pace.live_size("field", 256, LIVE_SECONDS) == 256
    assert pace.live_size("field", 200, LIVE_SECONDS) == 192
    assert pace.expected("field", 256) == pytest.approx(LIVE_SECONDS / 2)
    for _ in range(8):
        pace.note("field", 128, 8 * LIVE_SECONDS)
    assert pace.live_size("field", 256, LIVE_SECONDS) == 64
    assert pace.live_size("field", 32, LIVE_SECONDS) == 32
    assert pace.expected("other", 256) is None


def test_who_wants_speed_gets_smaller_live_answers(chooser: EngineChooser) -> None:
    chooser.pace.note(("exact", "field"), 256, LIVE_SECONDS)
    assert chooser.quality("exact", "field", live=True).size == 256
    chooser.patience = STOPS["fast"].patience
    few = chooser.quality("exact", "field", live=True).size
    assert few**2 / 256**2 <= STOPS["fast"].live_seconds / STOPS[USUAL].live_seconds
    # At rest nothing is traded.
    assert chooser.quality("exact", "field").size == 512
    assert STOPS[USUAL].patience == 1
