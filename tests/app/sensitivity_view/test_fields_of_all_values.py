"""Fields in blocks and their scale over all values in the window, on fake engines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot
from window_fakes import FakeBuilders

from app.engines.requests import BlockFieldsRequest, FieldRangeRequest
from app.image_view.image_canvas import to_qimage
from app.sensitivity_view.field_menu import FieldMenu
from app.window.main_window import MainWindow
from model.rendering.raster import middle_square
from model.scene.tf_perturbation import edit_over
from model.scene.view import View
from model.sensitivity.block_fields import field_bins, over_pixels, pixels_of_block
from model.sensitivity.display import overlay, scale_of, shown_field, shown_responses
from model.sensitivity.global_scale import overlay_globally

WindowMaker = Callable[..., MainWindow]


@pytest.fixture
def window(qtbot: QtBot, make_window: WindowMaker) -> MainWindow:
    window = make_window()
    dispatcher = window.workspace.sensitivity
    qtbot.waitUntil(lambda: dispatcher.region_agreement is not None)
    return window


def of_kind(requests: list[Any], kind: type) -> list[Any]:
    return [request for request in requests if type(request) is kind]


def unit_of(size: int, blocks: int, width: float) -> float:
    return float(shown_responses(np.ones(1), pixels_of_block(size, blocks), width)[0])


def both_covered(window: MainWindow) -> bool:
    covers = window.sensitivity.exact, window.sensitivity.learned
    return all("blocks" in cover.caption for cover in covers)


def test_blocks_of_all_values_are_asked_once_and_chosen_by_the_mouse(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    state = window.sensitivity_state
    state.choose(style="blocks", blocks=8)
    engines = builders.generators[-1], builders.analysts[-1]
    assert not any(of_kind(e.others, BlockFieldsRequest) for e in engines)
    state.pin(150.0)
    qtbot.waitUntil(lambda: both_covered(window))
    width = state.choices.width
    # The fakes' fields are the value's number in the left half.
    place = round(255 * 0.5)
    field = np.zeros((8, 8))
    field[:, :4] = place
    field *= unit_of(16, 8, width)
    image = window.sensitivity.learned.image_of(window.state.inputs)
    assert image is not None
    expected = overlay(image, over_pixels(field, 16), scale_of(field), "signed")
    learned = window.generator.canvas
    qtbot.waitUntil(lambda: learned.cover == to_qimage(expected.astype(np.float32)))
    assert "8 × 8 blocks" in window.sensitivity.exact.caption
    # Another value needs no engine, another view does.
    state.pin(190.0)
    qtbot.waitUntil(lambda: window.sensitivity.learned.scale > scale_of(field))
    assert [len(of_kind(e.others, BlockFieldsRequest)) for e in engines] == [1, 1]
    window.state.set_view(View(50, 10, 0, 1))
    dispatcher = window.workspace.sensitivity
    qtbot.waitUntil(
        lambda: all(a.is_of(window.state.inputs) for a in dispatcher.answers.block_fields.values())
    )
    assert [len(of_kind(e.others, BlockFieldsRequest)) for e in engines] == [2, 2]


def test_colours_over_all_values_fade_by_the_values_own_scale(
    qtbot: QtBot, window: MainWindow
) -> None:
    state = window.sensitivity_state
    state.choose(style="blocks", blocks=16, scale="all")
    state.pin(150.0)
    learned = window.sensitivity.learned
    qtbot.waitUntil(lambda: both_covered(window))
    unit = unit_of(16, 16, state.choices.width)
    # The exact fields have other blocks' sizes, and so another unit; the larger end counts.
    exact_unit = unit_of(128, 16, state.choices.width)
    highest = field_bins(window.workspace.sensitivity.window, (100.0, 200.0)).stop - 1
    whole = highest * max(unit, exact_unit)
    qtbot.waitUntil(lambda: learned.scale == pytest.approx(whole))
    assert "over all values" in learned.caption
    place = round(255 * 0.5)
    field = np.zeros((16, 16))
    field[:, :8] = place * unit
    own = place * max(unit, exact_unit)
    image = learned.image_of(window.state.inputs)
    assert image is not None
    expected = overlay_globally(image, over_pixels(field, 16), own, whole)
    qtbot.waitUntil(lambda: window.generator.canvas.cover == to_qimage(expected.astype(np.float32)))
    state.pin(110.0)
    qtbot.waitUntil(lambda: learned.scale == pytest.approx(whole))
    state.choose(scale="own")
    qtbot.waitUntil(lambda: learned.scale < whole / 2)
    assert "over all values" not in learned.caption


def test_fields_of_pixels_have_the_scale_of_all_values_too(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    state = window.sensitivity_state
    state.pin(150.0)
    exact = window.sensitivity.exact
    qtbot.waitUntil(lambda: exact.caption != "")
    assert not of_kind(builders.analysts[-1].others, FieldRangeRequest)
    state.choose(scale="all")
    # The fake's range ends at 3 by the changes' size, at 2 signed.
    qtbot.waitUntil(lambda: exact.scale == 2.0)
    assert "over all values" in exact.caption
    inputs = window.state.inputs
    image = exact.image_of(inputs)
    assert image is not None
    edit = edit_over((150.0, 150.0), (100.0, 200.0), state.choices.width)
    field = shown_field(np.full((16, 16, 3), 150.0), edit, "signed")
    expected = overlay_globally(image, field, scale_of(middle_square(field)), 2.0)
    qtbot.waitUntil(lambda: window.reference.canvas.cover == to_qimage(expected.astype(np.float32)))
    state.choose(measure="change")
    qtbot.waitUntil(lambda: exact.scale == 3.0)


def test_the_menu_says_and_sets_what_is_chosen(window: MainWindow) -> None:
    state = window.sensitivity_state
    menu = FieldMenu(state, window)
    styles, scales = (group.actions() for group, _entries in menu._choices)
    assert [action.text() for action in styles] == [
        "Area", "Contours", "8 × 8 blocks", "16 × 16 blocks", "Blocks of one pixel",
    ]  # fmt: skip
    wanted = [("map", 16), ("contours", 16), ("blocks", 8), ("blocks", 16), ("blocks", 0)]
    for action, (style, blocks) in zip(styles, wanted, strict=True):
        action.trigger()
        assert (state.choices.style, state.choices.blocks) == (style, blocks)
        menu.aboutToShow.emit()
        assert action.isChecked()
    ends = [(False, "own"), (False, "all"), (True, "all")]
    for action, (locked, scale) in zip(scales, ends, strict=True):
        action.trigger()
        assert (state.choices.locked, state.choices.scale) == (locked, scale)
        menu.aboutToShow.emit()
        assert action.isChecked()
    menu.doubt.setChecked(True)
    assert state.choices.fade


def test_what_cannot_be_answered_is_said(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_request: BlockFieldsRequest, _is_wanted: object) -> np.ndarray:
        raise MemoryError("no room")

    monkeypatch.setattr(builders.generators[-1], "block_fields", fail)
    window.sensitivity_state.choose(style="blocks", blocks=0)
    window.sensitivity_state.pin(150.0)
    qtbot.waitUntil(lambda: "no room" in window.sensitivity.source.text())
