from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest
from mouse_events import drag
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QTableWidget,
    QToolButton,
)

from app.sensitivity_view.response_layer import place_flags, round_below
from app.state.sensitivity_state import SensitivityState
from app.theme import DARK, LIGHT
from model.scene.region import Outline

LEFT = Qt.MouseButton.LeftButton
SIZES = [(1000, 640), (1280, 720), (1440, 900), (2560, 1440)]


def resize(qtbot, window, width, height):
    window.resize(width, height)
    qtbot.waitUntil(lambda: (window.width(), window.height()) == (width, height))
    QApplication.processEvents()


def box_of(widget, parent):
    return QRect(widget.mapTo(parent, QPoint()), widget.size())


def controls(parent):
    kinds = (QAbstractButton, QAbstractSpinBox)
    return [w for kind in kinds for w in parent.findChildren(kind) if w.isVisible()]


def test_the_dock_has_its_part_of_the_window_and_nothing_is_cut(qtbot, window):
    editor, findings = window.editor, window.sensitivity.findings
    for size, has_panel in product(SIZES, (False, True)):
        findings.set_open(has_panel)
        resize(qtbot, window, *size)
        share = 0.35 if size[1] >= 800 else 0.25
        assert editor.height() == min(max(round(share * size[1]), 180), 460)
        assert editor.area.opacity.height() >= (220 if size[1] >= 900 else 85)
        for control in controls(editor):
            if findings.isAncestorOf(control):
                # In a low window, the panel scrolls.
                assert box_of(control, editor).right() < editor.width()
            elif not isinstance(control.parent(), QAbstractSpinBox):
                assert editor.rect().contains(box_of(control, editor)), control.accessibleName()
        hint = editor.minimumSizeHint()
        assert hint.width() <= 1000 and hint.height() <= 224
        # Controls of the header do not overlap.
        boxes = [box_of(w, editor) for w in controls(editor) if box_of(w, editor).bottom() < 34]
        assert not [(a, b) for a, b in combinations(boxes, 2) if a.intersects(b)]


def test_the_line_above_is_dragged_and_comes_back_by_a_double_click(qtbot, window):
    resize(qtbot, window, 1280, 900)
    handle = window._splitter.handle(1)
    at = QPoint(handle.width() // 2, 3)
    drag(handle, at, at - QPoint(0, 90))
    dragged = window.editor.height()
    assert dragged == pytest.approx(315 + 90, abs=12)
    resize(qtbot, window, 1280, 1000)
    assert window.editor.height() == pytest.approx(dragged * 1000 / 900, abs=3)
    QTest.mouseDClick(handle, LEFT, pos=at)
    assert window.editor.height() == 350


def test_a_region_opens_the_panel_and_escape_closes_both(qtbot, window):
    resize(qtbot, window, 1280, 800)
    state, findings, area = (
        window.sensitivity_state, window.sensitivity.findings, window.editor.area,
    )  # fmt: skip
    assert findings.isHidden()
    before, images = area.rect, box_of(window.reference, window)
    QTest.keyClick(window, Qt.Key.Key_R)
    canvas = window.reference.canvas
    square = canvas.image_rect
    corners = [square.topLeft() + QPoint(square.width() // n, square.height() // n) for n in (4, 2)]
    drag(canvas, *corners)
    QApplication.processEvents()
    assert state.active is not None and findings.isVisible()
    assert findings.width() == 276
    assert area.rect.left() == before.left() and area.rect.width() < before.width()
    assert (window.width(), window.height()) == (1280, 800)
    assert box_of(window.reference, window) == images
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    QApplication.processEvents()
    assert state.active is None and findings.isHidden() and area.rect == before
    # The button, the key and the panel's own one do it, too.
    window.sensitivity.chips.panel.click()
    assert findings.isVisible()
    findings.close_button.click()
    assert findings.isHidden() and not window.sensitivity.chips.panel.isChecked()
    QTest.keyClick(window, Qt.Key.Key_F8)
    assert findings.isVisible()
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    assert findings.isHidden()
    # Regions of a volume that is opened again open no panel.
    state.add_region(Outline.rectangle(0.2, 0.2, 0.4, 0.4))
    window.sensitivity.findings.set_open(False)
    state.start_volume(object(), state.regions, 0, 1)
    assert state.active == 0 and window.sensitivity.findings.isHidden()


@pytest.mark.parametrize("seed", range(20))
def test_flags_do_not_overlap_in_the_plot(qtbot, seed):
    random = np.random.default_rng(seed)
    flags = [QToolButton() for _ in range(3)]
    for flag in flags:
        qtbot.addWidget(flag)
        flag.setFixedSize(int(random.integers(30, 80)), 19)
    plot = QRect(36, 8, 400, 134)
    centers = [int(at) for at in 36 + random.choice([0, 5, 200, 210, 395, 399], 3)]
    place_flags(flags, centers, plot)
    boxes = [flag.geometry() for flag in flags]
    assert all(plot.contains(box) for box in boxes)
    for index, box in enumerate(boxes):
        assert not any(box.intersects(other) for other in boxes[index + 1 :])
        # As near to its place as the others and the plot's edges let it be.
        assert abs(box.center().x() - centers[index]) <= 160


def test_the_curves_unit_zero_and_sign_are_read_from_the_plot(qtbot, window):
    area = window.editor.area
    # Without a region, the curve is there on purpose only.
    assert area.second_labels.labels == ()
    window.sensitivity.chips.change.click()
    labels = {text: place for place, text in area.second_labels.labels}
    (unit,) = (text for text in labels if "per .01" in text)
    numbers = {text: place for text, place in labels.items() if text != unit}
    assert len(numbers) == 3 and "0" in numbers
    plus, minus = (next(t for t in numbers if t.startswith(sign)) for sign in "+−")
    assert plus[1:] == minus[1:]
    height, top = area.rect.height(), area.rect.top()
    # Zero lies on the opacity .5.
    half = area.pixel(area.opacity, 0.0, 0.5).y()
    assert top + height * (1 - numbers["0"]) == pytest.approx(half, abs=2)
    at = area.widget.mapFromScene(area.second.mapViewToScene(area.second.viewRect().center()))
    assert area.rect.contains(at)
    for text in (plus, minus):
        value = float(text.replace("−", "-").replace("e-", "e-"))
        y = area.widget.mapFromScene(
            area.second.mapFromView(area.second.viewRect().center().__class__(0.5, value))
            + area.second.scenePos()
        ).y()
        assert top + height * (1 - numbers[text]) == pytest.approx(y, abs=2)
    # The same numbers are there as a table.
    dialog = window.sensitivity.show_table()
    table = dialog.findChild(QTableWidget)
    assert table.rowCount() == 256 and table.columnCount() == 3
    heads = [table.horizontalHeaderItem(i).text() for i in range(3)]
    assert heads == ["Value", "Change per .01, exact", "Change per .01, learned"]
    exact = window.sensitivity.responses.curve("exact")
    written = [table.item(row, 1).text().replace("−", "-") for row in range(256)]
    np.testing.assert_allclose([float(text) for text in written], exact, rtol=0.01, atol=1e-4)
    dialog.reject()
    window.sensitivity.chips.change.click()
    assert area.second_labels.labels == ()


@pytest.mark.parametrize("limit", np.geomspace(1e-5, 10, 61))
def test_the_numbers_at_the_right_are_round_and_not_far_from_the_end(limit):
    end = round_below(limit)
    assert 0.3 * limit <= end <= 0.9 * limit
    assert f"{end:.0e}"[0] in "125"
    assert end == pytest.approx(float(f"{end:.0e}"))


def test_the_curve_comes_with_a_region_and_goes_with_it(qtbot, window):
    state, responses = window.sensitivity_state, window.sensitivity.responses

    def is_there():
        flags = any(not flag.isHidden() for flag in responses.flags)
        numbers = bool(window.editor.area.second_labels.labels)
        has_curve = bool(responses.curve("exact").size)
        chip = window.sensitivity.chips.change.isChecked()
        return flags and numbers and has_curve and chip

    def is_away():
        numbers = bool(window.editor.area.second_labels.labels)
        return all(flag.isHidden() for flag in responses.flags) and not numbers

    assert is_away()
    state.add_region(Outline.rectangle(0.2, 0.2, 0.4, 0.4))
    state.finish_region()
    qtbot.waitUntil(is_there)
    state.activate(None)
    assert is_away()
    # On purpose, it is there without a region, too; each of the two is remembered.
    window.sensitivity.chips.change.click()
    qtbot.waitUntil(is_there)
    state.activate(0)
    window.sensitivity.chips.change.click()
    assert is_away()
    state.activate(None)
    qtbot.waitUntil(is_there)


def test_a_layer_that_is_chosen_brings_back_the_guidance_alone():
    state = SensitivityState()
    state.show_layer("visible", False)
    assert state.choices.shown and not state.shows_curve
    state.choose(shown=False, visible=True)
    state.show_layer("curve", True)
    assert state.shows_curve and not state.choices.visible


MACHADO_DEUTERANOPIA = np.array(
    [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ]
)
"""For linear RGB; Machado, Oliveira and Fernandes 2009, severity 1."""


def lightness(color):
    """CIE L* of linear RGB."""
    y = float(np.clip(color, 0, 1) @ (0.2126, 0.7152, 0.0722))
    return 116 * y ** (1 / 3) - 16 if y > 0.008856 else 903.3 * y


@pytest.mark.parametrize("colors", [DARK, LIGHT], ids=["dark", "light"])
@pytest.mark.parametrize("sees", ["greys", "without green"])
def test_curve_visible_area_and_tf_can_be_told_apart_by_everyone(colors, sees):
    def seen(name, alpha=1.0):
        drawn, ground = (
            np.array(QColor(c).getRgbF()[:3]) for c in (getattr(colors, name), colors.plot)
        )
        mixed = alpha * drawn + (1 - alpha) * ground
        linear = np.where(mixed <= 0.04045, mixed / 12.92, ((mixed + 0.055) / 1.055) ** 2.4)
        return linear if sees == "greys" else MACHADO_DEUTERANOPIA @ linear

    # The area is drawn at .6 over the plot; lines are opaque.
    light = {
        "curve": lightness(seen("curve")), "change": lightness(seen("change")),
        "visible": lightness(seen("visible", 0.6)), "plot": lightness(seen("plot")),
    }  # fmt: skip
    names = sorted(light)
    for index, one in enumerate(names):
        for other in names[index + 1 :]:
            assert abs(light[one] - light[other]) >= 9, (one, other, light)


def test_a_peaks_label_covers_no_handle(qtbot, window, builders, monkeypatch):
    resize(qtbot, window, 1000, 640)
    mode = window.state.transfer_function.opacity.modes[0]
    at = round((mode.mean - 100) / 100 * 255)

    def at_the_mode(*_asked):
        return np.tile(np.float32(np.exp(-((np.arange(256) - at) ** 2) / 50)), (2, 1))

    monkeypatch.setattr(builders.analysts[-1], "visibility", at_the_mode)
    tf = window.state.transfer_function
    for height in (0.1, 0.3, 0.38, 0.45, 0.6):
        modes = (replace(mode, amplitude=height), *tf.opacity.modes[1:])
        visible = window.sensitivity.visible
        answered = window.workspace.sensitivity.answered
        with qtbot.waitSignal(answered, check_params_cb=lambda what: what == "visibility"):
            window.state.tf_input.set(replace(tf, opacity=replace(tf.opacity, modes=modes)), "edit")
        (label,) = [each for each in visible._labels if each.isVisible()]
        view = window.editor.area.widget
        box = view.mapFromScene(label.mapRectToScene(label.boundingRect())).boundingRect()
        for handle in window.editor.opacity.peaks:
            assert not box.contains(view.mapFromScene(handle.scenePos())), height
        assert window.editor.area.rect.contains(box.adjusted(1, 1, -1, -1))
    # Nor does the tag of a band cover flags, card or handles.
    resize(qtbot, window, 1280, 720)
    window.editor.moves.select_strongest()
    window.sensitivity_state.show_layer("curve", True)
    flag, card, tag = (
        window.sensitivity.responses.flags[0], window.editor.card, window.sensitivity.band.tag,
    )  # fmt: skip
    qtbot.waitUntil(flag.isVisible)
    for value in np.linspace(100.0, 200.0, 21):
        window.sensitivity_state.hover(float(value), effect=False)
        box = tag.geometry()
        assert window.editor.area.rect.contains(box)
        assert not box.intersects(flag.geometry()) and not box.intersects(card.geometry())
        for handle in window.editor.opacity.peaks:
            at = window.editor.area.widget.mapFromScene(handle.scenePos())
            assert not box.contains(at)
