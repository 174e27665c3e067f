from dataclasses import replace

import numpy as np
import pytest
from editor_events import NONE, click, drag
from mouse_events import pixel
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from ramp import make_tf

from model.scene.tf_editing import add_opacity_handle
from model.scene.transfer_function import ColorTF

SHIFT = Qt.KeyboardModifier.ShiftModifier
STOPS = ((100.0, 0, 0, 0), (130.0, 1, 0, 0), (150.0, 0, 1, 0), (170.0, 0, 0, 1), (200.0, 1, 1, 1))


@pytest.fixture
def editor(editor, state):
    tf = state.transfer_function
    state.start_volume(replace(tf, color=ColorTF((100.0, 200.0), STOPS)), None)
    editor.area.widget.setFocus()
    return editor


def press_key(editor, key, modifier=NONE):
    QTest.keyClick(editor.area.widget, key, modifier)


def means(state):
    return [mode.mean for mode in state.transfer_function.opacity.modes]


def stops(state):
    return [stop[0] for stop in state.transfer_function.color.stops]


def test_modes_selected_together_are_dragged_together_with_their_colors(editor, state):
    click(editor, pixel(editor, 130.0, 0.5))
    click(editor, pixel(editor, 170.0, 0.5), SHIFT)
    assert editor.selection.indices("opacity") == (0, 1)
    assert editor.card.heading == "Mode 2 of 2, 2 selected"
    drag(editor, pixel(editor, 170.0, 0.5), pixel(editor, 180.0, 0.7))
    assert np.diff(means(state)) == pytest.approx(40.0)
    assert means(state)[0] == pytest.approx(140.0, abs=0.3)
    assert stops(state) == pytest.approx([100.0, means(state)[0], 150.0, means(state)[1], 200.0])
    assert state.edits.stack.count() == 1
    state.edits.undo()
    assert (means(state), stops(state)) == ([130.0, 170.0], [s[0] for s in STOPS])
    click(editor, pixel(editor, 130.0, 0.5))
    assert editor.selection.indices("opacity") == (0,)


def test_a_frame_with_shift_selects_and_keys_act_on_all(editor, state):
    before = state.transfer_function
    drag(editor, pixel(editor, 110.0, 0.9), pixel(editor, 190.0, 0.3), SHIFT)
    assert editor.selection.indices("opacity") == (0, 1)
    press_key(editor, Qt.Key.Key_Up)
    press_key(editor, Qt.Key.Key_Right)
    assert [m.amplitude for m in state.transfer_function.opacity.modes] == pytest.approx([0.51] * 2)
    assert state.edits.stack.count() == 1
    press_key(editor, Qt.Key.Key_Delete)
    assert means(state) == []
    state.edits.undo()
    state.edits.undo()
    assert state.transfer_function == before


def test_tab_reaches_every_handle_and_arrows_change_what_it_is(editor, state):
    reached = []
    for _ in range(2 * 3 + 5):
        press_key(editor, Qt.Key.Key_Tab)
        selection = editor.selection
        reached.append((selection.kind, selection.current, selection.flank))
    modes = [("opacity", index, flank) for index in (0, 1) for flank in (None, 0, 1)]
    assert reached == modes + [("color", index, None) for index in range(5)]
    press_key(editor, Qt.Key.Key_Backtab, SHIFT)
    assert editor.selection.index("color") == 3
    editor.selection.clear()
    for key in [Qt.Key.Key_Tab] * 3 + [Qt.Key.Key_Right] * 2:
        press_key(editor, key)
    mode = state.transfer_function.opacity.modes[0]
    assert (mode.mean, mode.width) == (130.0, pytest.approx(8.0 + 200 / 256))
    assert state.edits.stack.count() == 1


def test_enter_opens_a_stops_color_and_insert_adds(editor, state, monkeypatch):
    opened = []
    monkeypatch.setattr(editor.color, "choose_color", opened.append)
    editor.selection.select("color", 1)
    press_key(editor, Qt.Key.Key_Return)
    assert opened == [1]
    press_key(editor, Qt.Key.Key_Insert)
    assert stops(state)[2] == 140.0
    press_key(editor, Qt.Key.Key_Escape)
    press_key(editor, Qt.Key.Key_Insert)
    assert means(state)[2] == 150.0


def test_the_menu_converts_and_replaces_in_one_step_each(editor, state):
    before = state.transfer_function
    editor.selection.select("opacity", 0, 1)
    menu = editor.menu
    menu.to_curve()
    curve = state.transfer_function.opacity
    # The new handles were not chosen: none is selected.
    assert editor.selection.indices("opacity") == ()
    assert 4 < len(curve.points) < 40
    np.testing.assert_allclose(curve.sample(), before.opacity.sample(), atol=0.03)
    menu.start_curve()
    assert not state.transfer_function.opacity.sample().any()
    menu.use_color_map("Grey")
    greys = state.transfer_function.color.sample()
    np.testing.assert_allclose(greys, np.linspace(0, 1, 256)[:, None].repeat(3, 1), atol=0.01)
    menu.reverse_colors()
    np.testing.assert_allclose(state.transfer_function.color.sample(), greys[::-1], atol=1e-6)
    menu.menu.aboutToShow.emit()
    menu.presets.aboutToShow.emit()
    preset = menu.presets.list.item(1)
    menu.presets.take(preset)
    assert state.edits.stack.undoText() == f"preset {preset.text()}"
    assert state.edits.stack.count() == 5
    for _ in range(5):
        state.edits.undo()
    assert state.transfer_function == before


def test_the_selection_follows_edits_of_the_handles_and_ends_with_their_tf(editor, state):
    selection, tf_input = editor.selection, state.tf_input
    before = state.transfer_function
    selection.select("opacity", 0)
    # Added elsewhere, a handle is selected until that is undone.
    opacity, index = add_opacity_handle(before.opacity, 150.0, 0.3)
    tf_input.set(replace(before, opacity=opacity), "add mode")
    assert selection.index("opacity") == index
    state.edits.undo()
    assert selection.current is None
    state.edits.redo()
    assert selection.index("opacity") == index
    # As stops go and come, the others stay selected.
    few = replace(state.transfer_function, color=ColorTF((100.0, 200.0), STOPS[::2]))
    for chosen, left in ((3, None), (2, 1)):
        selection.select("color", chosen)
        tf_input.set(few, "fewer")
        assert selection.index("color") == left
        state.edits.undo()
        assert selection.index("color") == (left and chosen)
    # Another TF has other handles, however many; so have B's, and what returns.
    other = make_tf(110.0, 120.0)
    for change in (
        lambda: tf_input.exchange(other, "preset"),
        state.edits.undo,
        state.edits.redo,
        lambda: (tf_input.compare(True), tf_input.exchange(before, "file")),
        lambda: tf_input.focus("A"),
        tf_input.swap,
        lambda: tf_input.copy("A"),
        state.edits.undo,
        lambda: tf_input.start(other),
    ):
        selection.select("opacity", 1)
        change()
        assert selection.current is None
