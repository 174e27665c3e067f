from dataclasses import replace

from ramp import make_tf

from app.tf_editor.handles import Selected, Selection
from model.scene.tf_editing import add_opacity_handle, move_opacity_handle
from model.scene.transfer_function import OpacityTF


def test_a_handle_that_is_gone_is_dropped():
    selection = Selection()
    selection.select("opacity", 1)
    selection.fit(make_tf(130.0, 170.0))
    assert selection.index("opacity") == 1
    selection.fit(make_tf(130.0))
    assert selection.selected is None


def test_several_of_one_kind():
    selection = Selection()
    selection.select_all("opacity", (1, 0))
    assert (selection.indices("opacity"), selection.index("opacity")) == ((0, 1), 0)
    selection.toggle("opacity", 0)
    assert selection.selected == Selected("opacity", 1)
    selection.toggle("color", 2)
    assert selection.indices("opacity") == ()
    assert selection.indices("color") == (2,)
    selection.select_all("opacity", (0, 1))
    selection.fit(make_tf(130.0))
    assert selection.indices("opacity") == (0,)


def test_a_handle_that_was_added_elsewhere_is_selected_until_it_is_undone(qtbot):
    selection = Selection()
    before = make_tf()
    selection.fit(before)
    selection.select("opacity", 0)
    opacity, index = add_opacity_handle(before.opacity, 0.9, 0.3)
    selection.fit(replace(before, opacity=opacity))
    assert selection.selected == Selected("opacity", index)
    # It is edited, and all of that undone.
    moved = replace(before, opacity=move_opacity_handle(opacity, index, 0.9, 0.4))
    for tf in (moved, replace(before, opacity=opacity)):
        selection.fit(tf)
        assert selection.selected == Selected("opacity", index)
    with qtbot.waitSignal(selection.changed):
        selection.fit(before)
    assert selection.selected == Selected("opacity", 0)
    # After what was selected by hand is removed, nothing is selected.
    selection.fit(replace(before, opacity=opacity))
    selection.select("opacity", index)
    selection.fit(before)
    assert selection.selected is None
    # Another TF altogether is no addition.
    selection.select("color", 0)
    selection.fit(replace(before, opacity=OpacityTF((0.0, 1.0), points=((0.0, 0.1), (1.0, 0.2)))))
    assert selection.selected == Selected("color", 0)
