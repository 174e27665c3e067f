"""On a machine that is ten times as slow, nothing on screen is old while something moves."""

import threading
import time
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from window_fakes import PATIENCE_S, FakeEngine

from app.engines.engines import REAL_BUILDERS
from app.engines.requests import UNWATCHED
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer

PIXEL_S, ANSWER_S = 8e-6, 0.2
"""Ten times what a pixel takes on two cores, and what an answer of the analyst does."""

OLDEST_S, DRAG_S = 1.0, 3.0


@dataclass
class Slow:
    """Work that takes a known time, and how much longer it took, as the machine is busy."""

    widths: list[int] = field(default_factory=list)
    overrun: float = 0.0

    def work(self, seconds):
        begun = time.monotonic()
        # One after the other, as on a core that all share.
        time.sleep(seconds)
        self.overrun = max(self.overrun, time.monotonic() - begun - seconds)


@pytest.fixture
def slow(builders, monkeypatch):
    """Have images and answers take long, without work for this machine."""
    slow, core = Slow(), threading.Lock()

    def render(_self, _inputs, size, *_, **_named):
        raster = Raster.of(size)
        with core:
            slow.widths.append(raster.width)
            slow.work(PIXEL_S * raster.columns * raster.rows)
        return np.ones((*raster.shape, 4), np.float32)

    class SlowAnalyst(FakeEngine):
        def visibility(self, request, watch=UNWATCHED):
            with core:
                slow.work(ANSWER_S)
            return super().visibility(request)

    monkeypatch.setattr(RaycastRenderer, "render", render)
    monkeypatch.setattr(builders, "reference", REAL_BUILDERS.reference)
    monkeypatch.setattr(builders, "analyst", lambda *_: SlowAnalyst())
    return slow


@pytest.mark.slow
def test_nothing_on_screen_is_older_than_a_second_while_something_moves(qtbot, slow, make_window):
    window = make_window(model=None, size=None, lighting="direct", drawing="raycast")
    asker, state = window.workspace.sensitivity, window.state
    qtbot.waitUntil(
        lambda: asker.visibility is not None and window.workspace.is_settled,
        timeout=1000 * PATIENCE_S,
    )
    begun = time.monotonic()
    states = [(state.inputs, begun)]
    born = {"image": begun, "area": begun}
    oldest, looked, gap = dict.fromkeys(born, 0.0), begun, 0.0

    def show(what, inputs):
        born[what] = next((at for one, at in states if one == inputs), born[what])

    def move():
        nonlocal looked, gap
        now = time.monotonic()
        gap, looked = max(gap, now - looked), now
        for what, at in born.items():
            oldest[what] = max(oldest[what], now - at)
        state.move_view(replace(state.view, azimuth=state.view.azimuth + 0.01))
        states.append((state.inputs, now))
        return now - begun > DRAG_S

    def note(result):
        show("image", result.request.inputs)

    window.reference.resultShown.connect(note)
    asker.answered.connect(
        lambda what: what == "visibility" and show("area", asker.visibility.request.inputs)
    )
    slow.widths.clear()
    qtbot.waitUntil(move, timeout=1000 * PATIENCE_S)
    state.finish_view()
    # What this machine itself was late is not the window's.
    late = 3 * (gap + slow.overrun)
    assert oldest["image"] < OLDEST_S + late and oldest["area"] < OLDEST_S + late
    whole = window.workspace.reference.raster.width
    assert max(slow.widths) < whole / 2
