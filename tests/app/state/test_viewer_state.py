from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot
from ramp import make_tf

from app.state.viewer_state import HOME_VIEW, Session
from model.errors import TransferFunctionError
from model.scene.transfer_function import TransferFunction
from model.scene.view import View


def test_a_moving_view_is_announced_at_each_step_and_finished_once(
    qtbot: QtBot, session: Session
) -> None:
    steps = [View(azimuth=a) for a in (1.0, 2.0, 3.0)]
    signals = [session.viewChanged] * 3 + [session.viewChangeFinished]
    with qtbot.waitSignals(signals, order="strict"):
        for view in steps:
            session.move_view(view)
            assert session.live
        session.finish_view()
    assert session.view == steps[-1]
    assert not session.live


def test_finishing_a_view_at_rest_says_nothing(qtbot: QtBot, session: Session) -> None:
    with qtbot.assertNotEmitted(session.viewChangeFinished):
        session.finish_view()
        session.set_view(HOME_VIEW)


def test_a_drag_becomes_one_undo_step(session: Session) -> None:
    before = session.transfer_function
    for mean in (140.0, 150.0, 160.0):
        session.preview(make_tf(mean))
    assert session.live
    assert session.undo_stack.count() == 0
    session.finish_preview("drag")
    assert not session.live
    assert session.undo_stack.count() == 1
    assert session.transfer_function == make_tf(160.0)
    session.undo()
    assert session.transfer_function == before
    session.redo()
    assert session.transfer_function == make_tf(160.0)


def test_a_drag_back_to_where_it_began_is_no_edit(session: Session) -> None:
    before = session.transfer_function
    session.preview(make_tf(140.0))
    session.preview(before)
    session.finish_preview("drag")
    assert session.undo_stack.count() == 0


def test_a_cancelled_drag_restores_what_was(qtbot: QtBot, session: Session) -> None:
    before = session.transfer_function
    session.preview(make_tf(140.0))
    with qtbot.waitSignal(session.transferFunctionChangeFinished):
        session.cancel_preview()
    assert session.transfer_function == before
    assert session.undo_stack.count() == 0


def test_undo_in_the_middle_of_a_drag_takes_the_drag_back(session: Session) -> None:
    before = session.transfer_function
    session.preview(make_tf(140.0))
    session.undo()
    assert session.transfer_function == before
    session.redo()
    assert session.transfer_function == make_tf(140.0)


def test_only_edits_with_the_same_key_merge(session: Session) -> None:
    for mean, key in ((141.0, "a"), (142.0, "a"), (143.0, "b"), (144.0, None), (145.0, None)):
        session.commit(make_tf(mean), "edit", key)
    assert session.undo_stack.count() == 4
    for expected in (144.0, 143.0, 142.0):
        session.undo()
        assert session.transfer_function == make_tf(expected)
    session.undo()
    assert session.transfer_function == make_tf()


def test_reset_can_be_undone(session: Session) -> None:
    session.commit(make_tf(120.0), "edit")
    session.reset_transfer_function()
    assert session.transfer_function == make_tf()
    session.undo()
    assert session.transfer_function == make_tf(120.0)


def test_another_volume_forgets_the_undo_steps(session: Session) -> None:
    session.commit(make_tf(120.0), "edit")
    session.start_volume(make_tf(150.0), make_tf(110.0))
    assert session.transfer_function == make_tf(110.0)
    assert not session.undo_stack.canUndo()
    session.reset_transfer_function()
    assert session.transfer_function == make_tf(150.0)


def test_a_saved_file_opens_as_it_was_and_can_be_undone(session: Session, tmp_path: Path) -> None:
    path = tmp_path / "tf.json"
    saved = make_tf(111.1, 123.4)
    session.commit(saved, "edit")
    session.save_transfer_function(path)
    session.reset_transfer_function()
    assert session.open_transfer_function(path)
    assert session.transfer_function == saved
    session.undo()
    assert session.transfer_function == make_tf()


def test_a_file_of_another_range_is_fitted(session: Session, tmp_path: Path) -> None:
    path = tmp_path / "tf.json"
    other = make_tf(150.0)
    other = TransferFunction(
        replace(other.opacity, scalar_range=(0.0, 400.0)),
        replace(other.color, scalar_range=(0.0, 400.0)),
    )
    other.save(path)
    assert not session.open_transfer_function(path)
    assert session.scalar_range == (100.0, 200.0)
    assert session.transfer_function.opacity.modes[0].mean == 150.0


def test_a_bad_file_changes_nothing(session: Session, tmp_path: Path) -> None:
    path = tmp_path / "tf.json"
    path.write_text("{")
    with pytest.raises(TransferFunctionError, match=r"tf\.json"):
        session.open_transfer_function(path)
    assert session.transfer_function == make_tf()
    assert session.undo_stack.count() == 0
