from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pytestqt.qtbot import QtBot
from ramp import make_tf

from app.state.viewer_state import HOME_VIEW, ViewerState
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.tf_editing import recolor_stop
from model.scene.transfer_function import TransferFunction
from model.scene.view import View


def test_a_moving_view_is_announced_at_each_step_and_finished_once(
    qtbot: QtBot, state: ViewerState
) -> None:
    steps = [View(azimuth=a) for a in (1.0, 2.0, 3.0)]
    signals = [state.viewChanged] * 3 + [state.viewChangeFinished]
    with qtbot.waitSignals(signals, order="strict"):
        for view in steps:
            state.move_view(view)
            assert state.live
        state.finish_view()
    assert state.view == steps[-1]
    assert not state.live


def test_finishing_a_view_at_rest_says_nothing(qtbot: QtBot, state: ViewerState) -> None:
    with qtbot.assertNotEmitted(state.viewChangeFinished):
        state.finish_view()
        state.set_view(HOME_VIEW)


def test_a_drag_becomes_one_undo_step(state: ViewerState) -> None:
    before = state.transfer_function
    for mean in (140.0, 150.0, 160.0):
        state.tf_input.move(make_tf(mean))
    assert state.live
    assert state.edits.stack.count() == 0
    state.tf_input.finish("drag")
    assert not state.live
    assert state.edits.stack.count() == 1
    assert state.transfer_function == make_tf(160.0)
    state.edits.undo()
    assert state.transfer_function == before
    state.edits.redo()
    assert state.transfer_function == make_tf(160.0)


def test_a_drag_back_to_where_it_began_is_no_edit(qtbot: QtBot, state: ViewerState) -> None:
    before = state.transfer_function
    state.tf_input.move(make_tf(140.0))
    state.tf_input.move(before)
    # What was drawn meanwhile is not yet the final image.
    with qtbot.waitSignal(state.inputsChangeFinished):
        state.tf_input.finish("drag")
    assert not state.live and state.edits.stack.count() == 0


def test_a_cancelled_drag_restores_what_was(qtbot: QtBot, state: ViewerState) -> None:
    before = state.transfer_function
    state.tf_input.move(make_tf(140.0))
    with qtbot.waitSignal(state.tf_input.changeFinished):
        state.tf_input.cancel()
    assert state.transfer_function == before
    assert state.edits.stack.count() == 0


def test_undo_in_the_middle_of_a_drag_takes_the_drag_back(state: ViewerState) -> None:
    before = state.transfer_function
    state.tf_input.move(make_tf(140.0))
    state.edits.undo()
    assert state.transfer_function == before
    state.edits.redo()
    assert state.transfer_function == make_tf(140.0)


def test_only_edits_with_the_same_key_merge(state: ViewerState) -> None:
    for mean, key in ((141.0, "a"), (142.0, "a"), (143.0, "b"), (144.0, None), (145.0, None)):
        state.tf_input.set(make_tf(mean), "edit", key)
    assert state.edits.stack.count() == 4
    for expected in (144.0, 143.0, 142.0):
        state.edits.undo()
        assert state.transfer_function == make_tf(expected)
    state.edits.undo()
    assert state.transfer_function == make_tf()


def test_reset_can_be_undone(state: ViewerState) -> None:
    state.tf_input.set(make_tf(120.0), "edit")
    state.reset_transfer_function()
    assert state.transfer_function == make_tf()
    state.edits.undo()
    assert state.transfer_function == make_tf(120.0)


def test_another_volume_forgets_the_undo_steps(state: ViewerState) -> None:
    state.tf_input.set(make_tf(120.0), "edit")
    state.start_volume(make_tf(150.0), make_tf(110.0))
    assert state.transfer_function == make_tf(110.0)
    assert not state.edits.stack.canUndo()
    state.reset_transfer_function()
    assert state.transfer_function == make_tf(150.0)


def test_a_saved_file_is_the_tf(state: ViewerState, tmp_path: Path) -> None:
    saved = make_tf(111.1, 123.4)
    state.tf_input.set(saved, "edit")
    state.save_transfer_function(tmp_path / "tf.json")
    assert TransferFunction.load(tmp_path / "tf.json") == saved


def test_the_end_of_a_drag_announces_nothing_new(state: ViewerState) -> None:
    changed: list[TransferFunction] = []
    finished: list[TransferFunction] = []
    state.tf_input.changed.connect(changed.append)
    state.tf_input.changeFinished.connect(finished.append)
    state.tf_input.move(make_tf(140.0))
    state.tf_input.finish("drag")
    assert changed == [make_tf(140.0)]
    assert finished == [make_tf(140.0)]
    state.edits.undo()
    state.edits.redo()
    assert len(changed) == len(finished) == 3


def test_a_drag_of_the_light_is_one_undo_step_while_there_is_light(state: ViewerState) -> None:
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


def test_a_crop_is_undone_and_redone_among_the_edits(qtbot: QtBot, state: ViewerState) -> None:
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
    # A drag that ends where it began is none.
    state.crop_input.move(third)
    state.crop_input.move(half)
    state.crop_input.finish()
    assert state.edits.stack.undoText() == "crop" and state.edits.stack.canRedo()


def test_edits_of_a_key_merge_for_a_second_only(state: ViewerState) -> None:
    # Four values typed two seconds apart are four steps; a held key's are one.
    times = iter((0.0, 2.0, 4.0, 6.0, 6.4, 7.3, 8.2))
    state.edits.clock = lambda: next(times)
    for mean in range(141, 148):
        state.tf_input.set(make_tf(float(mean)), "set value", "value 0")
    assert state.edits.stack.count() == 4
    for expected in (143.0, 142.0, 141.0):
        state.edits.undo()
        assert state.transfer_function == make_tf(expected)


def test_redo_ends_a_drag_of_light_and_crop(state: ViewerState) -> None:
    state.start_light(LightDirection())
    state.light_input.set(LightDirection(20.0, 10.0))
    state.edits.undo()
    state.light_input.move(LightDirection(-40.0, 0.0))
    state.edits.redo()
    assert state.light == LightDirection(-40.0, 0.0) and not state.live
