import itertools
import time
from dataclasses import replace

import pytest
from PySide6.QtCore import QObject
from ramp import make_tf

from app.state.viewer_state import INTERVAL_S, ViewerState
from model.scene.crop import CropBox
from model.scene.scene import LightDirection
from model.scene.tf_editing import recolor_stop


def test_a_drag_of_the_light_is_one_undo_step_while_there_is_light(state):
    first, last = LightDirection(-30.0, 30.0), LightDirection(20.0, 10.0)
    state.start_light(first)
    assert not state.edits.stack.canUndo()
    for azimuth in (-10.0, 0.0):
        state.light_input.move(LightDirection(azimuth, 20.0))
    state.light_input.move(last)
    state.light_input.finish()
    assert state.edits.stack.undoText() == "move light"
    state.edits.undo()
    assert state.light == first and not state.edits.stack.canUndo()
    state.edits.redo()
    assert state.light == last
    # Light that was switched off meanwhile stays off.
    state.start_light(None)
    state.edits.undo()
    assert state.light is None


def test_a_crop_is_undone_and_redone_among_the_edits(qtbot, state):
    tf = state.transfer_function
    edited = replace(tf, color=recolor_stop(tf.color, 0, (1.0, 0.0, 0.0)))
    half, third = CropBox((0.5, 0.0, 0.0)), CropBox((0.5, 0.3, 0.0))
    state.tf_input.set(edited, "preset")
    state.crop_input.move(CropBox((0.2, 0.0, 0.0)))
    state.crop_input.move(half)
    assert state.live
    state.crop_input.finish()
    state.crop_input.set(third)
    state.crop_input.set(None)
    assert not state.live
    assert state.edits.stack.undoText() == "whole volume"
    seen = []
    for _ in range(3):
        with qtbot.waitSignal(state.crop_input.changeFinished):
            state.edits.undo()
        seen.append(state.crop)
    assert seen == [third, half, None]
    assert state.transfer_function == edited
    state.edits.undo()
    assert state.transfer_function == tf
    for _ in range(2):
        state.edits.redo()
    assert state.crop == half and state.transfer_function == edited


@pytest.mark.parametrize(
    ("keys", "times", "left"),
    [
        (("a", "a", "b", None, None), (0.0,) * 5, (144.0, 143.0, 142.0)),
        # Values typed two seconds apart are steps of their own; a held key's are one.
        (("a",) * 7, (0.0, 2.0, 4.0, 6.0, 6.4, 7.3, 8.2), (143.0, 142.0, 141.0)),
    ],
)
def test_edits_of_a_key_merge_for_a_second_only(state, keys, times, left):
    clock = iter(times)
    state.edits.clock = lambda: next(clock)
    for number, key in enumerate(keys):
        state.tf_input.set(make_tf(141.0 + number), "edit", key)
    assert state.edits.stack.count() == 4
    for expected in left:
        state.edits.undo()
        assert state.transfer_function == make_tf(expected)


def test_while_something_moves_refreshes_are_few_and_show_the_newest(qtbot):
    parent = QObject()
    state = ViewerState(parent)
    shown = []
    times = []

    def note():
        times.append(time.monotonic())

    state.inputsChanged.connect(state.calm.soon(lambda: shown.append(state.view.azimuth)))
    state.inputsChanged.connect(state.calm.soon(note))

    def turn():
        state.move_view(replace(state.view, azimuth=state.view.azimuth + 0.01))
        return len(shown) >= 4

    qtbot.waitUntil(turn)
    assert shown == sorted(shown) and len(times) == 4
    assert all(b - a > 0.9 * INTERVAL_S for a, b in itertools.pairwise(times))
    turn()
    state.finish_view()
    assert shown[-1] == state.view.azimuth


def test_at_rest_a_refresh_is_at_once_and_the_last_of_a_name_counts(qtbot):
    parent = QObject()
    state = ViewerState(parent)
    said = []
    refresh = state.calm.soon(lambda: said.append("at rest"))
    refresh("an argument of a signal")
    assert said == ["at rest"]
    state.move_view(replace(state.view, azimuth=1.0))
    for word in ("first", "second"):
        state.calm.ask(said.append, lambda word=word: said.append(word))
    assert said == ["at rest"]
    state.finish_view()
    assert said == ["at rest", "second"]
