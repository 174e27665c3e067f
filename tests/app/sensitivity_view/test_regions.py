import numpy as np
import pytest
from mouse_events import at, drag
from PySide6.QtCore import QPoint, QRect, QRectF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QInputDialog
from sensitivity_events import asked, hover

from app.engines.requests import RegionSensitivityRequest
from app.sensitivity_view.region_layer import name_corners
from model.scene.region import Outline
from model.scene.view import View


def regions_listed(window):
    """The regions in the chip's menu, above its other entries."""
    chips = window.sensitivity.chips
    chips.fill_regions()
    texts = [action.text() for action in chips.regions_menu.actions()]
    return texts[: texts.index("")]


def peak_texts(window):
    return [each.toPlainText() for each in window.sensitivity.visible._labels if each.isVisible()]


def test_a_rectangle_is_drawn_moved_and_resized_in_either_image(qtbot, window, builders):
    state, view = window.sensitivity_state, window.state.view
    reference, generator = window.reference.canvas, window.generator.canvas
    QTest.keyClick(window, Qt.Key.Key_R)
    assert state.tool == "rectangle"
    drag(reference, at(reference, 0.2, 0.3), at(reference, 0.4, 0.5), at(reference, 0.5, 0.6))
    assert state.tool is None
    assert np.ravel(state.outline.points[::2]) == pytest.approx([0.2, 0.3, 0.5, 0.6], abs=0.01)
    assert window.sensitivity.chips.region.caption == "Region 1 ▾"
    # In the other image: by its upper edge, then by its lower right corner.
    drag(generator, at(generator, 0.35, 0.3), at(generator, 0.4, 0.4), at(generator, 0.45, 0.5))
    assert np.ravel(state.outline.points[::2]) == pytest.approx([0.3, 0.5, 0.6, 0.8], abs=0.02)
    drag(generator, at(generator, 0.6, 0.8), at(generator, 0.7, 0.8), at(generator, 0.9, 0.9))
    assert np.ravel(state.outline.points[::2]) == pytest.approx([0.3, 0.5, 0.9, 0.9], abs=0.02)
    assert window.state.view == view
    qtbot.waitUntil(lambda: asked(builders, RegionSensitivityRequest)[-1].region == state.outline)
    qtbot.waitUntil(lambda: not asked(builders, RegionSensitivityRequest)[-1].quality.live)
    # Inside, the mouse turns the view.
    drag(generator, at(generator, 0.5, 0.7), at(generator, 0.6, 0.7))
    assert window.state.view != view
    # Switching off ends a drag.
    shown = window.sensitivity.visible._curve
    qtbot.waitUntil(lambda: shown.opacity() == 1)
    state.add_region(Outline.rectangle(0.2, 0.2, 0.6, 0.6))
    assert shown.opacity() < 1  # it is of another region
    QTest.mousePress(generator, Qt.MouseButton.LeftButton, pos=at(generator, 0.4, 0.2))
    QTest.mouseMove(generator, at(generator, 0.45, 0.3))
    assert state.dragging
    outline = state.outline
    QTest.keyClick(window, Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    assert not state.choices.shown and not state.dragging
    state.choose(shown=True)
    QTest.mouseMove(generator, at(generator, 0.6, 0.5))
    assert state.outline == outline


def test_a_lasso_and_several_regions(qtbot, window):
    state, canvas = window.sensitivity_state, window.generator.canvas
    QTest.keyClick(window, Qt.Key.Key_L)
    around = [(0.3, 0.3), (0.6, 0.3), (0.6, 0.5), (0.5, 0.7), (0.3, 0.6)]
    drag(canvas, *(at(canvas, x, y) for x, y in around))
    assert len(state.outline.points) == 5
    state.add_region(Outline.rectangle(0, 0, 0.25, 0.25))
    assert regions_listed(window) == ["Whole image", "Region 1", "Region 2"]
    window.sensitivity.findings.rename.click()
    dialog = window.sensitivity.chips.findChild(QInputDialog)
    dialog.setTextValue("  lung ")
    dialog.accept()
    assert window.sensitivity.chips.region.caption == "lung ▾"
    state.activate(0)
    asker, entries = window.workspace.sensitivity, window.sensitivity.chips.regions_menu.actions()
    qtbot.waitUntil(lambda: asker.is_fresh(asker.region))
    next(entry for entry in entries if entry.text().startswith("Remove")).trigger()
    assert regions_listed(window) == ["Whole image", "lung"]
    assert state.outline == Outline()
    # A click with the tool draws nothing.
    state.set_tool("rectangle")
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=at(canvas, 0.5, 0.5))
    assert len(state.regions) == 1 and state.tool is None
    # A tool that is chosen in a drag waits for the next one; Escape ends what is drawn.
    for before, within in ((None, "rectangle"), ("lasso", None)):
        state.set_tool(before)
        QTest.mousePress(canvas, Qt.MouseButton.LeftButton, pos=at(canvas, 0.3, 0.3))
        end = at(canvas, 0.6, 0.6) if before is None else at(canvas, 0.3, 0.3) + QPoint(1, 1)
        QTest.mouseMove(canvas, end)
        state.set_tool(within)
        QTest.mouseMove(canvas, end + QPoint(1, 1))
        QTest.mouseRelease(canvas, Qt.MouseButton.LeftButton, pos=end)
        assert len(state.regions) == 1 and state.tool == within and state.place is None
    # A region cannot be lost outside the image.
    state.add_region(Outline.rectangle(0.4, 0.4, 0.6, 0.6))
    state.change_region(Outline.rectangle(2.4, -3.4, 2.6, -3.2))
    state.finish("regions")
    assert state.outline.mask(16).any()
    # Nor does the name of one above it leave the image.
    assert name_corners([QRectF(9, -80, 30, 40)], [QRectF(0, -12, 50, 15)])[0].y() >= 12


def test_a_region_beside_the_square_is_the_ray_casters_alone(qtbot, window):
    asker, state = window.workspace.sensitivity, window.sensitivity_state
    state.add_region(Outline.rectangle(0.8, 0.2, 1.2, 0.4))
    state.finish("regions")
    qtbot.waitUntil(lambda: asker.is_fresh(asker.regions.get("exact")))
    assert set(asker.regions) == {"exact"}
    label = window.sensitivity.source
    qtbot.waitUntil(lambda: "learned: the region leaves the model's image" in label.plain_text)
    state.choose(engine="exact")
    qtbot.waitUntil(lambda: "exact" in label.plain_text)
    assert "leaves the model's image" not in label.plain_text


def test_the_values_that_a_region_shows_are_named(qtbot, window, builders, monkeypatch):
    def two_values(request, *_):
        """In a region three of four parts at bin 51; in the whole image all at bin 204."""
        bins = np.arange(256)
        one, other = (np.exp(-((bins - center) ** 2) / 50) for center in (51, 204))
        rows = [other if not region.points else 3 * one + other for region in request.regions]
        return np.array(rows, dtype=np.float32)

    monkeypatch.setattr(builders.analysts[-1], "visibility", two_values)
    state, findings = window.sensitivity_state, window.sensitivity.findings

    def text():
        return ", ".join(row.accessibleName() for row in findings.value_rows if not row.isHidden())

    state.add_region(Outline.rectangle(0.1, 0.1, 0.4, 0.4))
    state.finish("regions")
    qtbot.waitUntil(lambda: text() == "116.1 to 123.9 K 75 %, 176.1 to 183.9 K 25 %")
    # The peaks in the plot say it, too: from a fifth on.
    assert peak_texts(window) == ["116.1 to 123.9 K: 75 %", "176.1 to 183.9 K: 25 %"]
    state.activate(None)
    qtbot.waitUntil(lambda: text() == "176.1 to 183.9 K 100 %")
    assert peak_texts(window) == ["176.1 to 183.9 K: 100 %"]
    # The list of a clicked place is of that.
    state.pick((0.5, 0.5))
    assert findings.title.full_text == "Clicked place"
    assert window.sensitivity.chips.visible.caption == "Visible in image"
    qtbot.waitUntil(findings.edits.isHidden)


def test_a_click_names_the_values_there_and_edits_them(qtbot, window, builders):
    canvas, findings = window.reference.canvas, window.sensitivity.findings
    label, plot = window.sensitivity.labels[1], window.editor.area.rect
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=at(canvas, 0.3, 0.6))
    qtbot.waitUntil(lambda: "100 %" in label.text.text())
    # It is there and nothing has moved; its button opens the panel.
    assert label.isVisible() and not window.sensitivity.labels[0].isVisible()
    assert canvas.rect().contains(label.geometry())
    assert not label.geometry().contains(at(canvas, 0.3, 0.6))
    # It does not lie under a card.
    card = window.up_axis_card
    there = window.generator.canvas
    place = there.mapFromGlobal(card.mapToGlobal(QPoint(card.width() - 40, -10)))
    QTest.mouseClick(there, Qt.MouseButton.LeftButton, pos=place)
    box = window.sensitivity.labels[0].geometry()
    box.moveTopLeft(there.mapToGlobal(box.topLeft()))
    assert window.sensitivity.labels[0].isVisible() and card.isVisible()
    assert not box.intersects(QRect(card.mapToGlobal(QPoint()), card.size()))
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=at(canvas, 0.3, 0.6))
    # A place that was clicked in a wider image is in none of this one's pixels.
    window.sensitivity_state.pick((5.0, 0.6))
    assert label.isHidden()
    window.sensitivity_state.pick((0.3, 0.6))
    qtbot.waitUntil(lambda: "100 %" in label.text.text())
    assert findings.isHidden() and window.editor.area.rect == plot
    label.button.click()
    assert findings.isVisible() and "100 %" in findings.value_rows[0].accessibleName()
    # What if asks about the first value there.
    window.sensitivity.what_if.start()
    assert "opacity at 123.5 K" in window.sensitivity.what_if.edit_text
    window.sensitivity.what_if.end()
    asked = [r for r in builders.analysts[-1].others if r.channel == "sensitivity: pick"]
    square = asked[-1].regions[0]
    assert np.mean(square.points, axis=0) == pytest.approx((0.3, 0.6), abs=0.01)
    before = window.state.transfer_function
    buttons = dict(zip(("raise", "lower", "isolate"), findings.value_rows[0].buttons, strict=True))
    for name, button in buttons.items():
        button.click()
        assert window.state.edits.stack.undoText() == f"{name} value"
        assert window.state.transfer_function != before
        window.state.edits.undo()
        assert window.state.transfer_function == before
        qtbot.waitUntil(buttons["raise"].isEnabled)
    for name in ("raise", "raise", "lower", "lower"):
        buttons[name].click()
        qtbot.waitUntil(buttons[name].isEnabled)
    assert window.state.transfer_function == before
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    assert window.sensitivity_state.place is None and label.isHidden()
    assert findings.isVisible()
    qtbot.waitUntil(lambda: not findings.edit_rows[0].isHidden())


def test_a_place_where_nothing_is_visible_goes_with_the_view(qtbot, window, builders, monkeypatch):
    monkeypatch.setattr(builders.analysts[-1], "visibility", lambda *_: np.zeros((1, 256)))
    canvas, label = window.reference.canvas, window.sensitivity.labels[1]
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=at(canvas, 0.3, 0.6))
    qtbot.waitUntil(lambda: "Nothing visible here" in label.text.text())
    ring = canvas.grab().toImage().pixelColor(at(canvas, 0.3, 0.6) - QPoint(7, 0))
    assert ring.lightness() > 150
    window.state.set_view(View(azimuth=10.0))
    assert window.sensitivity_state.place is None and label.isHidden()


def test_beside_the_square_of_a_wide_image_all_is_asked_and_shown_too(qtbot, make_window, builders):
    window = make_window(model=None, size=None)
    canvas, state = window.reference.canvas, window.sensitivity_state
    qtbot.waitUntil(lambda: canvas.pixels == (canvas.image.width(), canvas.image.height()))
    shape = canvas.image.height(), canvas.image.width()
    assert shape[1] > 1.8 * shape[0]
    state.set_tool("rectangle")
    drag(canvas, at(canvas, 1.1, 0.2), at(canvas, 1.2, 0.3), at(canvas, 1.3, 0.6))
    assert np.ravel(state.outline.points[::2]) == pytest.approx([1.1, 0.2, 1.3, 0.6], abs=0.01)
    asker = window.workspace.sensitivity
    qtbot.waitUntil(lambda: asker.is_fresh(asker.region))
    answer = asker.region
    assert answer is not None and not asker.learned_size
    rows, columns = answer.request.quality.pixels.shape
    assert columns / rows == pytest.approx(shape[1] / shape[0], abs=0.02)
    # The fake answers with the region's number of pixels.
    assert answer.value.max() == pytest.approx(0.2 * 0.4 * rows**2, rel=0.05)
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=at(canvas, 1.2, 0.5))
    assert state.place == pytest.approx((1.2, 0.5), abs=0.01)
    # A mouse that was there already, in another test, would not move.
    for value in (150.0, 140.0):
        hover(window, value)
    qtbot.waitUntil(lambda: canvas.cover is not None)
    assert (canvas.cover.height(), canvas.cover.width()) == shape
