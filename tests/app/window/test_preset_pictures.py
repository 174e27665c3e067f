from __future__ import annotations

import pytest

from app.engines.requests import BatchRequest
from app.tf_editor.preset_menu import PICTURE


def test_each_preset_shows_the_volume_and_can_be_taken(qtbot, make_window, builders):
    window = make_window(model=None)
    menu, state = window.editor.menu.presets, window.state
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.brightness.set(1.0)
    menu.aboutToShow.emit()

    def asked() -> list[BatchRequest]:
        return [r for r in builders.analysts[-1].others if r.channel == "presets"]

    qtbot.waitUntil(lambda: bool(asked()))
    request, entries = asked()[-1], menu.actions()
    assert len(entries) == 1 + len(request.more)
    # From the same side, with all that is shown in the middle of the square.
    assert request.inputs.view.basis() == pytest.approx(state.view.basis())
    assert request.inputs.view == state.for_picture(state.view)

    def level(number: int) -> int:
        image = entries[number].icon().pixmap(PICTURE, PICTURE).toImage()
        return image.pixelColor(PICTURE // 2, PICTURE // 2).red()

    # The fake's pictures are each .1 brighter than the one before.
    qtbot.waitUntil(lambda: level(3) > 0)
    assert [level(n) for n in (0, 1, 3)] == pytest.approx([0, 26, 76], abs=1)
    entries[2].trigger()
    assert state.transfer_function.opacity == request.more[1].opacity_tf
    assert state.edits.stack.undoText() == f"preset {entries[2].text()}"
    # All of them leave the range as it is.
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.editor.range.set_range((120.0, 160.0))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    menu.aboutToShow.emit()
    # Another analyst, of the new range.
    qtbot.waitUntil(lambda: bool(asked()))
    for inputs in (asked()[-1].inputs, *asked()[-1].more):
        assert inputs.opacity_tf.scalar_range == (120.0, 160.0)
    for number in range(len(menu.actions())):
        menu.actions()[number].trigger()
        assert state.scalar_range == (120.0, 160.0)
