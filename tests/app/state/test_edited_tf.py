from ramp import make_tf

from model.scene.ranges import fit_to_range

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
