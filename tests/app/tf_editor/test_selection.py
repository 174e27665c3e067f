from __future__ import annotations

from pytestqt.qtbot import QtBot
from ramp import make_tf

from app.tf_editor.selection import Selected, Selection


def test_one_handle_at_a_time(qtbot: QtBot) -> None:
    selection = Selection()
    with qtbot.waitSignals([selection.changed] * 2):
        selection.select("opacity", 1)
        selection.select("color", 2)
    assert selection.selected == Selected("color", 2)
    assert selection.index("color") == 2
    assert selection.index("opacity") is None


def test_selecting_again_is_no_change(qtbot: QtBot) -> None:
    selection = Selection()
    selection.select("opacity", 1)
    with qtbot.assertNotEmitted(selection.changed):
        selection.select("opacity", 1)


def test_a_handle_that_is_gone_is_dropped() -> None:
    selection = Selection()
    selection.select("opacity", 1)
    selection.fit(make_tf(130.0, 170.0))
    assert selection.index("opacity") == 1
    selection.fit(make_tf(130.0))
    assert selection.selected is None


def test_several_of_one_kind() -> None:
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
