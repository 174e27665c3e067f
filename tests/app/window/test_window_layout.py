from itertools import pairwise

import numpy as np
import pytest
from mouse_events import action, box_of
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent, QKeySequence, QStatusTipEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QAbstractSpinBox,
    QApplication,
    QGraphicsSceneHoverEvent,
    QLineEdit,
    QMenuBar,
    QWidget,
)

from app.picture import pixels_of
from app.theme import apply_theme
from app.window.help_pages import status_keys
from app.window.settings_dialog import apply_single_keys
from model.scene.region import Outline
from model.scene.volume import Volume

SIZES = (
    (1920, 1080), (960, 540), (1000, 640), (853, 450), (800, 450), (1093, 614), (1280, 720),
    (1366, 768), (1440, 900),
)  # fmt: skip
"""Windows in logical pixels; among them 1366 x 768 at 125 %, 1920 x 1080 at 150 and at 200 %,
1280 x 720 at 150 % below a task bar, and 1600 x 900 at 200 %."""

CONTROLS = QAbstractButton, QAbstractSpinBox, QLineEdit, QMenuBar


@pytest.fixture(autouse=True)
def theme(qapp):
    """Have controls as large as in the application."""
    apply_theme(qapp, "dark")


def cut_in(window):
    """Names of controls that are seen, but not as a whole."""
    found = []
    for widget in window.findChildren(QWidget):
        if not isinstance(widget, CONTROLS) or not widget.isVisible():
            continue
        above = widget.parentWidget()
        # What scrolls comes into sight.
        while above is not None and not isinstance(above, QAbstractScrollArea):
            if not above.rect().contains(box_of(widget, above)):
                name = widget.accessibleName() or widget.objectName() or type(widget).__name__
                found.append(f"{name} in {type(above).__name__}")
                break
            above = None if above is window else above.parentWidget()
    return found


def assert_whole(qtbot, window, size):
    def is_laid_out():
        assert cut_in(window) == [], size

    QApplication.processEvents()
    assert (window.width(), window.height()) == size
    qtbot.waitUntil(is_laid_out)
    bar = window.top_bar
    shown = [w for w in bar.children() if isinstance(w, QWidget) and w.isVisible()]
    places = sorted((box_of(w, bar) for w in shown), key=lambda rect: rect.left())
    assert all(one.right() < other.left() for one, other in pairwise(places))


def test_everything_has_room_at_any_size_and_nothing_moves(qtbot, make_window):
    window = make_window()
    image, browser, bar = window.reference.canvas, window.browser, window.top_bar
    left, right = (box_of(p.canvas, window) for p in (window.generator, window.reference))
    assert (left.left(), left.top(), right.right()) == (0, bar.height(), window.width() - 1)
    height, editing = image.height(), action(window, "TF editor")
    editing.trigger()
    qtbot.waitUntil(lambda: window.editor.is_folded and image.height() > height + 150)
    editing.trigger()
    qtbot.waitUntil(lambda: not window.editor.is_folded and image.height() == height)
    bar.volume.title = "a volume whose file has a name of quite some length, 2026-11-25, final"
    light = window.reference_controls.light
    wide = light.sizeHint()
    light.title = "Path traced"
    assert light.sizeHint() == wide
    # As on a machine that is too slow for light.
    light.title = "None (too slow)"
    for size in SIZES:
        window.up_axis_card.hide()
        window.resize(*size)
        assert_whole(qtbot, window, size)
        assert bar.is_folded == (size[0] < 1180)
        alone, lit = image.size(), box_of(window.reference_controls.ball, bar)
        window.crop_card.set_shown(True)
        window.up_axis_card.ask()
        for number in range(2):
            window.notice.add(f"/a/folder/engine{number}.nrrd: the file is truncated; copy it.")
        assert_whole(qtbot, window, size)
        # What floats moves nothing.
        assert image.size() == alone
        window.latent_state.choose(shown=True)
        assert_whole(qtbot, window, size)
        assert image.width() >= 0.34 * window.panes.width()
        assert box_of(window.reference_controls.ball, bar) == lit
        assert browser.map.width() == browser.map.height() == browser.grid.width()
        window.latent_state.choose(shown=False)
        window.crop_card.set_shown(False)
        window.notice.clear()
    window.sensitivity_state.open_panel()
    for size in ((1000, 640), (1440, 900)):
        window.resize(*size)
        assert_whole(qtbot, window, size)


def test_what_lies_over_the_images_follows_them(make_window):
    window = make_window()
    tools = window.tools
    assert tools.parentWidget() is window.generator.canvas and tools.isVisible()
    tools.rectangle.click()
    assert window.sensitivity_state.tool == "rectangle"
    tools.rectangle.click()
    assert window.sensitivity_state.tool is None
    tools.crop.click()
    assert window.crop_card.isVisible()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not window.crop_card.isVisible() and not tools.crop.isChecked()
    window.latent_state.choose(shown=True)
    assert tools.parentWidget() is window.reference.canvas and tools.isVisible()
    window.latent_state.choose(shown=False)
    window.panes.swap()
    assert tools.parentWidget() is window.reference.canvas and tools.isVisible()
    window.panes.swap()
    canvases = [pane.canvas for pane in (window.generator, window.reference)]
    before = [canvas.grab().toImage() for canvas in canvases]
    action(window, "Colour legend").trigger()
    after = [canvas.grab().toImage() for canvas in canvases]
    assert after[0] == before[0] and after[1] != before[1]
    bar = window.top_bar
    assert window.panes.images == [window.generator, window.reference]
    assert bar.compare.isChecked()
    action(window, "Difference").trigger()
    assert window.image_error.is_wanted and bar.difference.isChecked()
    bar.difference.click()
    assert not window.image_error.is_wanted
    bar.difference.click()
    action(window, "Compare").trigger()
    assert window.panes.images == [window.reference]
    assert not (bar.compare.isChecked() or bar.difference.isChecked())
    bar.difference.click()
    assert len(window.panes.images) == 2 and bar.compare.isChecked() and bar.difference.isChecked()
    window.workspace.open_model(None)
    action(window, "Compare").trigger()
    # B is what there is to compare.
    assert window.panes.images == [window.reference, window.pane_b] and bar.compare.isChecked()


def _inked(label, width):
    """Whether something is drawn in each column of a label of some width."""
    label.resize(width, label.height())
    pixels = pixels_of(label.grab().toImage())
    return (pixels != pixels[-1, -1]).any(axis=(0, 2))


def test_keys_reach_every_area_and_the_status_line_says_those_under_the_mouse(
    qtbot, make_window, monkeypatch
):
    window = make_window()
    assert window.status.keys == status_keys("Images")
    assert "[Drag] turn" in window.status.keys and "[R] region" in window.status.keys
    images = status_keys("Images")
    window.sensitivity_state.add_region(Outline.rectangle(0.2, 0.2, 0.6, 0.6))
    # The mouse is over the image, and has not moved.
    assert window.status.keys == status_keys("Regions")
    window.sensitivity_state.activate(None)
    assert window.status.keys == images
    # From the panel of values, which is inside the editor, the mouse goes on to the plot.
    for each in (window.editor, window.sensitivity.findings):
        QApplication.sendEvent(each, QEnterEvent(*3 * [QPointF()]))
    assert window.status.area == "Values and edits"
    QApplication.sendEvent(window.sensitivity.findings, QEvent(QEvent.Type.Leave))
    assert window.status.keys == status_keys("Transfer function")
    line = window.editor.range.lines[0]
    hover = QEvent.Type.GraphicsSceneHoverEnter, QEvent.Type.GraphicsSceneHoverLeave
    for kind, said in zip(hover, ("cut", "handle"), strict=True):
        line.scene().sendEvent(line, QGraphicsSceneHoverEvent(kind))
        assert said in window.status.keys
    QApplication.sendEvent(window.editor, QEvent(QEvent.Type.Leave))
    assert window.status.keys == images
    # Pictures without a map have neither zoom nor rectangle.
    QApplication.sendEvent(window, QStatusTipEvent(window.browser.grid.statusTip()))
    assert "[Click] take this TF" in window.status.keys and "[Wheel]" not in window.status.keys
    window.status.area = "Slices (S)"
    whole = _inked(window.status._hints, 2000)
    for width in range(200, 900, 70):
        end = np.flatnonzero(_inked(window.status._hints, width))[-1]
        # Before a space between hints, which is wider than one between words.
        assert width / 2 < end < width and not whole[end + 1 : end + 13].any()
    window.activateWindow()
    window.reference.canvas.setFocus()
    qtbot.waitUntil(window.reference.canvas.hasFocus)

    def area():
        focus = QApplication.focusWidget()
        areas = {
            "top": window.top_bar, "left": window.generator.canvas,
            "right": window.reference.canvas, "editor": window.editor,
        }  # fmt: skip
        return next(n for n, a in areas.items() if a is focus or a.isAncestorOf(focus))

    def walk():
        """Areas in their order; the editor's own, one after another, count as one."""
        seen = [area()]
        for _ in range(12):
            QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_F6)
            seen.append(area())
        changes = [seen[0], *(new for old, new in pairwise(seen) if new != old)]
        return changes[:5]

    assert walk() == ["right", "editor", "top", "left", "right"]
    compare, browse = action(window, "Compare"), action(window, "Browse TFs")
    apply_single_keys(window, False)
    assert not compare.shortcuts()
    assert browse.shortcuts() == [QKeySequence("Ctrl+B")]
    apply_single_keys(window, True)
    assert compare.shortcuts() == [QKeySequence("C")]
    assert QKeySequence("B") in browse.shortcuts()
    canvas = window.reference.canvas
    canvas.setFocus()
    qtbot.waitUntil(canvas.hasFocus)
    window.top_bar._fold(True)
    assert not window.top_bar.menu_bar.isVisible() and window.top_bar.menus.isVisible()
    # VTK draws at rest only next to a model's image, whose truth it is, and voxels as they are.
    monkeypatch.setattr(Volume, "has_thick_slices", True)
    reference = window.workspace.reference
    reference.follow_panes()
    assert reference.settings.is_truth and not reference.settings.smooths
    QTest.keyClick(canvas, Qt.Key.Key_C)
    assert window.panes.images == [window.reference]
    assert not reference.settings.is_truth and reference.settings.smooths
    reference.choose(keep=False, drawing="raycast")
    assert not reference.settings.smooths
    assert len([a for a in window.top_bar.menus.actions() if a.menu() is not None]) == 5
    opened = []
    monkeypatch.setattr(window.top_bar, "open_menus", lambda: opened.append(True))
    QTest.keyPress(window, Qt.Key.Key_Alt)
    QTest.keyRelease(window, Qt.Key.Key_Alt)
    assert opened == [True]
    window.latent_state.choose(shown=True)
    window.browser.grid.setFocus()
    qtbot.waitUntil(window.browser.grid.hasFocus)
    QTest.keyClick(window.browser.grid, Qt.Key.Key_Escape)
    assert window.browser.isHidden()
    assert canvas.hasFocus()
