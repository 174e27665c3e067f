from __future__ import annotations

import pytest

from app.state.engine_chooser import REST_SIZE, EngineChooser
from app.state.exactness import STOPS, USUAL
from app.state.pace import LIVE_SECONDS, Pace
from app.state.sensitivity_state import SensitivityState
from model.rendering.raster import Raster

SLOW = ("exact", 512), ("learned", 128)
BOTH, EXACT, LEARNED = ["exact", "learned"], ["exact"], ["learned"]


@pytest.fixture
def chooser() -> EngineChooser:
    """Of a volume with a model, unlit."""
    chooser = EngineChooser(SensitivityState())
    chooser.exact_source, chooser.learned_size, chooser.picture = "exact", 128, Raster(512, 512)
    return chooser


@pytest.mark.parametrize(
    ("engine", "has_model", "slow", "measure", "rest", "live"),
    [
        ("auto", True, 0, "signed", BOTH, EXACT),
        ("auto", True, 0, "field", BOTH, EXACT),
        # Of the generator, it is made on demand only.
        ("auto", True, 0, "change", EXACT, EXACT),
        ("learned", True, 0, "change", LEARNED, []),
        ("learned", True, 0, "signed", LEARNED, LEARNED),
        ("learned", False, 0, "signed", [], []),
        ("exact", False, 0, "field", EXACT, EXACT),
        # Where the ray caster is slow, the generator comes first.
        ("auto", True, 1, "field", BOTH[::-1], LEARNED),
        ("auto", True, 1, "signed", BOTH, EXACT),
        ("auto", False, 1, "field", EXACT, EXACT),
        # Where neither keeps up, the exact one answers with fewer pixels.
        ("auto", True, 2, "field", BOTH[::-1], EXACT),
    ],
)
def test_who_answers(
    chooser: EngineChooser,
    engine: str,
    has_model: bool,
    slow: int,
    measure: str,
    rest: list[str],
    live: list[str],
) -> None:
    chooser._asked.choose(engine=engine)
    if not has_model:
        chooser.learned_size = None
    for name, size in SLOW[:slow]:
        chooser.pace.note((name, "field"), size, 2.0)
    assert chooser.order(measure, live=False) == rest
    assert chooser.order(measure, live=True) == live
    if slow:
        assert chooser.quality("exact", "field", live=True).size < 128
    chooser._asked.choose(shown=False)
    assert chooser.order("field", live=False) == []


def test_the_first_answer_with_what_is_loaded_for_it_counts_no_more_than_once() -> None:
    pace = Pace()
    for seconds, expected in ((15.0, 15.0), (0.05, 0.05), (0.15, 0.1)):
        pace.note("field", 100, seconds)
        assert pace.expected("field", 100) == pytest.approx(expected)
    pace.forget()
    assert pace.expected("field", 100) is None


def test_the_ray_casters_answers_are_as_wide_as_the_reference(chooser: EngineChooser) -> None:
    chooser.picture = Raster(1280, 320)
    assert chooser.quality("exact", "field").pixels == Raster(1280, 320)
    assert chooser.quality("exact", "signed").pixels == Raster(4 * REST_SIZE, REST_SIZE)
    live = chooser.quality("exact", "field", live=True)
    assert live.pixels == Raster(4 * live.size, live.size)
    assert chooser.quality("learned", "field").pixels == Raster(128, 128)


def test_live_sizes_follow_the_time_they_take(chooser: EngineChooser) -> None:
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
    # Who wants speed gets smaller ones; at rest nothing is traded.
    chooser.pace.note(("exact", "field"), 256, LIVE_SECONDS)
    assert chooser.quality("exact", "field", live=True).size == 256
    chooser.patience = STOPS["fast"].patience
    few = chooser.quality("exact", "field", live=True).size
    assert few**2 / 256**2 <= STOPS["fast"].live_seconds / STOPS[USUAL].live_seconds
    assert chooser.quality("exact", "field").size == 512
