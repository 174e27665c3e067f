"""From the mouse to the pixels: a handle that is dragged, a view that is turned, a region drawn."""

import threading
from dataclasses import dataclass

import numpy as np
import pytest
from mouse_events import pixel
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from ramp import make_tf, make_volume
from rested_window import rested

from app.engines.engines import REAL_BUILDERS
from app.engines.requests import RegionSensitivityRequest
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.view import View

LEFT = Qt.MouseButton.LeftButton
MOVES = 6  # positions of the mouse that a drag passes after the first


@dataclass
class Drag:
    """A mouse that goes from one place of a widget to another, step by step."""

    widget: QWidget
    start: QPoint
    end: QPoint
    steps: int = 0

    def press(self):
        QTest.mousePress(self.widget, LEFT, pos=self.start)

    def step(self):
        self.steps += 1
        QTest.mouseMove(self.widget, self.start + (self.end - self.start) * (self.steps / MOVES))

    def release(self):
        QTest.mouseRelease(self.widget, LEFT, pos=self.end)


def handle(window):
    """Drag the point of the first mode upwards."""
    editor = window.editor
    at = (pixel(editor, 130.0, height) for height in (0.5, 0.8))
    return Drag(editor.area.widget.viewport(), *at)


def turn(window):
    """Turn the view by a drag in its pane."""
    canvas = window.reference.canvas
    rect = canvas.image_rect
    return Drag(canvas, rect.center() - QPoint(40, 0), rect.center() + QPoint(40, 30))


WALKS = {"handle": handle, "view": turn}


def with_a_mode(qtbot, window):
    """Have a TF with a handle where it is dragged."""
    window.state.tf_input.set(make_tf())
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    return window


@pytest.fixture
def window(qtbot, make_window):
    """A window that one fake ray caster draws."""
    window = with_a_mode(qtbot, rested(qtbot, make_window))
    # Questions about the region are another walk.
    qtbot.waitUntil(lambda: window.workspace.sensitivity.visibility is not None)
    return window


@pytest.fixture
def gate(window, builders):
    """Lets the images of the fake ray caster through, one by one."""
    gate = builders.references[-1].gate = threading.Semaphore(0)
    yield gate
    builders.references[-1].gate = None
    gate.release(100)


def watched(window):
    """Requests and values that the reference's pane has shown from now on."""
    shown = []
    window.reference.resultShown.connect(shown.append)
    return shown


def let_go(qtbot, window, drag, shown):
    """End a drag, and return the picture that remains."""
    drag.release()
    qtbot.waitUntil(lambda: window.workspace.is_settled and not window.state.live)
    qtbot.waitUntil(lambda: not shown[-1].request.quality.live)
    return shown[-1]


@pytest.mark.parametrize("walk", WALKS)
def test_one_picture_is_on_its_way_and_the_next_is_of_the_newest_state(
    qtbot, window, builders, gate, walk
):
    engine, shown = builders.references[-1], watched(window)
    asked = []
    window.reference.client.images.asked.connect(asked.append)
    drag = WALKS[walk](window)
    before, drawn = window.state.inputs, len(engine.requests)
    drag.press()
    for _ in range(4):
        drag.step()
    qtbot.waitUntil(lambda: len(engine.requests) == drawn + 1)
    # The last move of a handle follows after a pause.
    qtbot.waitUntil(lambda: window.state.inputs != asked[0].inputs)
    newest = window.state.inputs
    assert newest != before
    # However often the mouse has moved meanwhile.
    assert len(asked) == 1 and asked[0].quality.live and asked[0].inputs != newest
    gate.release()
    qtbot.waitUntil(lambda: len(asked) == 2)
    assert asked[1].inputs == newest
    assert asked[1].quality.pixels.width <= window.workspace.reference.raster.width
    gate.release()
    qtbot.waitUntil(lambda: len(shown) == 2)
    # Nothing moves: what is shown is what there is.
    assert len(asked) == 2 and shown[-1].request.inputs == window.state.inputs
    drag.step()
    gate.release(100)
    last = let_go(qtbot, window, drag, shown)
    assert last.request.inputs == window.state.inputs
    assert last.request.quality.pixels == window.workspace.reference.raster
    numbers = [result.request.sequence for result in shown]
    assert numbers == sorted(numbers)


def test_what_is_taken_back_is_not_shown_any_more(qtbot, window, gate, builders):
    engine, shown = builders.references[-1], watched(window)
    before, drawn = window.state.inputs, len(engine.requests)
    drag = handle(window)
    drag.press()
    drag.step()
    drag.step()
    qtbot.waitUntil(lambda: len(engine.requests) == drawn + 1)
    window.state.tf_input.cancel()
    gate.release(100)
    qtbot.waitUntil(lambda: window.workspace.is_settled and len(shown) > 0)
    qtbot.waitUntil(lambda: shown[-1].request.inputs == before)
    assert not shown[-1].request.quality.live
    drag.release()
    assert window.state.inputs == before
    # What is asked next is all that is shown next.
    count = len(shown)
    window.state.set_view(View(80.0, 10.0))
    qtbot.waitUntil(lambda: shown[-1].request.inputs == window.state.inputs)
    assert {each.request.inputs.opacity_tf for each in shown[count:]} == {before.opacity_tf}


def test_the_last_of_the_ray_casters_pictures_is_the_best(
    qtbot, builders, make_window, monkeypatch
):
    # Kernels are there before a window waits for them.
    RaycastRenderer(make_volume(), "direct").render(SceneInputs.of(View(), make_tf()), 8)
    monkeypatch.setattr(builders, "reference", REAL_BUILDERS.reference)
    window = with_a_mode(qtbot, rested(qtbot, make_window))
    shown = watched(window)
    drag = handle(window)
    drag.press()
    for count in range(MOVES):
        drag.step()
        qtbot.waitUntil(lambda count=count: len(shown) > count)
    newest = window.state.inputs
    qtbot.waitUntil(lambda: shown[-1].request.inputs == newest)
    last = let_go(qtbot, window, drag, shown)
    assert last.request.inputs == newest
    whole = window.workspace.reference.raster
    assert last.request.quality.pixels == whole
    settings = window.workspace.reference.settings
    renderer = RaycastRenderer(make_volume(), settings.lighting)
    expected = renderer.render(newest, whole, settings.smooth_distance)
    np.testing.assert_allclose(last.value, expected, atol=1e-6)
    # The coarse ones came first.
    assert shown[0].request.quality.live


def test_a_region_is_answered_as_it_is_drawn_and_in_full_in_the_end(qtbot, window, builders):
    canvas, answers = window.reference.canvas, window.workspace.sensitivity
    engine = builders.analysts[-1]
    gate = engine.gate = threading.Semaphore(0)
    rect = canvas.image_rect
    QTest.keyClick(window, Qt.Key.Key_R)
    drag = Drag(canvas, rect.center() - QPoint(60, 60), rect.center() + QPoint(60, 60))
    drag.press()
    seen = []
    asked = len(engine.others)
    for _ in range(MOVES):
        drag.step()
        seen = [r for r in engine.others[asked:] if isinstance(r, RegionSensitivityRequest)]
    # One at most is computed at a time, whatever the mouse does.
    assert len(seen) <= 1
    engine.gate = None
    drag.release()
    gate.release(100)
    qtbot.waitUntil(lambda: answers.is_fresh(answers.region))
    qtbot.waitUntil(lambda: not answers.region.request.quality.live)
    assert answers.region.request.region == window.sensitivity_state.outline
    assert answers.region.request.inputs == window.state.inputs
