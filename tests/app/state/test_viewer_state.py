from dataclasses import replace

import pytest
from PySide6.QtCore import QObject
from ramp import make_tf

from app.state.viewer_state import ViewerState
from model.scene.crop import CropBox
from model.scene.ranges import fit_to_range
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
    state.show_whole()
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


def test_at_rest_a_refresh_is_at_once_and_the_last_of_a_name_counts(qtbot):
    parent = QObject()
    state = ViewerState(parent)
    said = []
    refresh = state.refreshes.soon(lambda: said.append("at rest"))
    refresh("an argument of a signal")
    assert said == ["at rest"]
    state.move_view(replace(state.view, azimuth=1.0))
    for word in ("first", "second"):
        state.refreshes.ask(said.append, lambda word=word: said.append(word))
    assert said == ["at rest"]
    state.finish_view()
    assert said == ["at rest", "second"]


ONE, OTHER = make_tf(110.0), make_tf(140.0)


def both(state):
    return state.tf_input.of("A"), state.tf_input.of("B")


def test_edits_and_their_undo_are_of_the_pane_with_the_focus(state):
    tf_input, first = state.tf_input, state.transfer_function
    tf_input.compare(True)
    assert both(state) == (first, first) and tf_input.pane == "B"
    tf_input.set(ONE, "one")
    # A drag ends where the focus goes.
    tf_input.move(OTHER)
    tf_input.focus("A")
    assert both(state) == (first, OTHER) and not state.live
    assert state.inputs == state.inputs_of("A") != state.inputs_of("B")
    tf_input.set(ONE, "one")
    tf_input.compare(False)
    # What is undone is seen.
    for expected in ((first, OTHER), (first, ONE), (first, first)):
        state.edits.undo()
        assert both(state) == expected
    assert (tf_input.pane, tf_input.compares) == ("B", True)
    for _ in range(3):
        state.edits.redo()
    assert both(state) == (ONE, OTHER) and tf_input.pane == "A"


def test_copies_and_swaps_are_edits(state):
    tf_input, first = state.tf_input, state.transfer_function
    tf_input.swap()
    assert not state.edits.stack.canUndo()
    tf_input.compare(True)
    tf_input.set(ONE)
    tf_input.swap()
    assert both(state) == (ONE, first) and tf_input.pane == "B"
    tf_input.copy("A")
    assert both(state) == (ONE, ONE) and state.edits.stack.undoText() == "copy A to B"
    state.edits.undo()
    tf_input.copy("B")
    assert both(state) == (first, first) and tf_input.pane == "A"
    state.edits.undo()
    state.edits.undo()
    assert both(state) == (first, ONE)


def test_changes_by_one_key_are_one_edit_of_one_pane(state):
    tf_input, first = state.tf_input, state.transfer_function
    state.edits.clock = lambda: 0.0
    tf_input.compare(True)
    for pane in ("A", "B"):
        tf_input.focus(pane)
        for tf in (ONE, OTHER):
            tf_input.set(tf, "value", "handle 1")
    state.edits.undo()
    assert both(state) == (OTHER, first)


def test_range_and_scale_are_those_of_both(state):
    tf_input = state.tf_input
    tf_input.compare(True)
    tf_input.set(ONE)
    before = both(state)
    # Cut in A's focus, too, and back in full.
    for pane in ("B", "A"):
        tf_input.focus(pane)
        cut = fit_to_range(state.transfer_function, (100.0, 150.0))
        tf_input.set(cut, "range")
        assert both(state) == tuple(fit_to_range(tf, (100.0, 150.0)) for tf in before)
        state.edits.undo()
        assert both(state) == before
    log = ONE.on_scale("log")
    tf_input.set(log, "scale")
    assert both(state) == (log, log)
    tf_input.compare(False)
    state.edits.undo()
    assert both(state) == before and not tf_input.compares


def test_another_volume_has_the_tfs_that_it_had(state):
    state.tf_input.compare(True)
    # None, nor one of another scale than the volume's.
    for known, expected in ((OTHER, OTHER), (None, None), (OTHER.on_scale("log"), None)):
        state.start_volume(make_tf(), ONE, {"tf_b": known, "compares": True})
        assert both(state) == (ONE, expected) and state.tf_input.pane == "A"
        assert state.tf_input.compares == (expected is not None)
