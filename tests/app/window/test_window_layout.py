"""The window's measures: what has room, what folds, and what never moves."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit, QToolButton, QWidget
from pytestqt.qtbot import QtBot

from app.image_view.orientation_cube import OrientationCube
from app.window.gesture_table import GESTURES, help_text, status_keys
from app.window.main_window import MainWindow
from model.scene.region import Outline

WindowMaker = Callable[..., MainWindow]

LEAST = 1000, 640


def place(widget: QWidget, window: QWidget) -> QRect:
    return QRect(widget.mapTo(window, QPoint()), widget.size())


def action(window: MainWindow, keys: str) -> QAction:
    (found,) = [
        a
        for a in window.findChildren(QAction)
        if QKeySequence(keys) in a.shortcuts() and a.isEnabled()
    ]
    return found


def open_all(window: MainWindow) -> None:
    """Have everything float over the images that can."""
    window.crop_card.set_shown(True)
    window.up_axis_card.ask("+z")
    for number in range(2):
        window.notice.tell(f"/a/long/folder/engine{number}.nrrd: the file is truncated. " * 3)
    # As on a machine that is too slow for light.
    window.reference_controls.light.set_title("None (too slow)")
    QApplication.processEvents()


def test_nothing_moves_and_all_has_room(make_window: WindowMaker) -> None:
    window = make_window()
    left, right = (place(p.canvas, window) for p in (window.generator, window.reference))
    assert left.left() == 0 and right.right() == window.width() - 1
    assert left.top() == right.top() == window.top_bar.height() == 36
    assert right.left() - left.right() == 2  # One pixel lies between.
    assert window.status.height() == 24
    assert not window.notice.isVisible()
    assert not window.crop_card.isVisible() and not window.status.news
    above = (window.top_bar, window.panes)
    controls = [
        button
        for part in above
        for button in part.findChildren(QAbstractButton)
        if button.isVisible() and button.parentWidget() is not window.up_axis_card
    ]
    # Volume, light, what an image costs, four buttons; two captions, three tools.
    assert len(controls) <= 12
    size = window.size()
    for browsing in (True, False):
        window.latent_state.choose(shown=browsing)
        open_all(window)
        assert window.size() == size
        parts = (window.top_bar, window.panes, window.status)
        widths = {type(part).__name__: part.minimumSizeHint().width() for part in parts}
        assert max(widths.values()) <= LEAST[0], widths
        # Beside an editor of 220 pixels and its line.
        assert sum(part.minimumSizeHint().height() for part in parts) <= LEAST[1] - 226
    action(window, "R").trigger()
    QTest.qWait(20)
    assert window.size() == size
    window.latent_state.choose(shown=True)
    parts = (window.top_bar, window.panes, window.notice, window.crop_card, window.up_axis_card)
    without_text = [
        button
        for part in parts
        for button in part.findChildren(QAbstractButton)
        if not button.text()
        and not button.icon().isNull()
        # Qt's own, of a menu bar without room, which folds before, and in a field.
        and button.objectName() != "qt_menubar_ext_button"
        and not isinstance(button.parentWidget(), QLineEdit)
    ]
    assert len(without_text) > 12
    for button in without_text:
        name = button.accessibleName()
        assert name, button
        assert button.toolTip().startswith(name), button.toolTip()


def test_what_lies_over_the_images_follows_them(make_window: WindowMaker) -> None:
    window = make_window()
    tools = window.tools
    assert tools.parentWidget() is window.generator.canvas and tools.isVisible()
    tools.rectangle.click()
    assert window.sensitivity_state.tool == "rectangle"
    tools.lasso.click()
    assert window.sensitivity_state.tool == "lasso" and not tools.rectangle.isChecked()
    tools.lasso.click()
    assert window.sensitivity_state.tool is None
    tools.crop.click()
    assert window.crop_card.isVisible()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not window.crop_card.isVisible() and not tools.crop.isChecked()
    window.panes.swap()
    assert tools.parentWidget() is window.reference.canvas
    window.latent_state.choose(shown=True)
    assert not tools.isVisible()
    window.latent_state.choose(shown=False)
    window.panes.swap()
    canvases = [pane.canvas for pane in (window.generator, window.reference)]
    before = [canvas.grab().toImage() for canvas in canvases]
    action(window, "Ctrl+L").trigger()
    after = [canvas.grab().toImage() for canvas in canvases]
    assert after[0] == before[0] and after[1] != before[1]
    bar = window.top_bar
    assert window.panes.images == [window.generator, window.reference]
    assert bar.compare.isChecked() and bar.difference.isEnabled()
    action(window, "D").trigger()
    assert window.image_error.is_wanted and bar.difference.isChecked()
    bar.difference.click()
    assert not window.image_error.is_wanted
    action(window, "C").trigger()
    assert window.panes.images == [window.generator]
    assert not bar.compare.isChecked() and not bar.difference.isEnabled()
    bar.compare.click()
    assert len(window.panes.images) == 2 and bar.compare.isChecked()

    def seen() -> list[QWidget]:
        cubes = window.findChildren(OrientationCube)
        return [cube.parentWidget() for cube in cubes if cube.isVisible()]

    assert seen() == [window.reference.canvas]
    window.panes.swap()
    assert seen() == [window.generator.canvas]
    window.panes.swap()
    window.panes.show_images("generator")
    assert seen() == [window.generator.canvas]
    window.latent_state.choose(shown=True)
    assert seen() == [window.reference.canvas]


def test_keys_reach_every_area(
    qtbot: QtBot, make_window: WindowMaker, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = make_window()
    window.activateWindow()
    window.reference.canvas.setFocus()
    qtbot.waitUntil(window.reference.canvas.hasFocus)

    def area() -> str:
        focus = QApplication.focusWidget()
        areas = {
            "top": window.top_bar,
            "left": window.generator.canvas,
            "right": window.reference.canvas,
            "editor": window.editor,
        }
        return next(n for n, a in areas.items() if a is focus or a.isAncestorOf(focus))

    def walk(modifier: Qt.KeyboardModifier) -> list[str]:
        """Areas in their order; the editor's own, one after another, count as one."""
        seen = [area()]
        for _ in range(12):
            QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_F6, modifier)
            seen.append(area())
        changes = [seen[0], *(new for old, new in pairwise(seen) if new != old)]
        return changes[:5]

    assert walk(Qt.KeyboardModifier.NoModifier) == ["right", "editor", "top", "left", "right"]
    window.reference.canvas.setFocus()
    assert walk(Qt.KeyboardModifier.ShiftModifier) == ["right", "left", "top", "editor", "right"]
    compare, browse = action(window, "C"), action(window, "Ctrl+B")
    assert QKeySequence("B") in browse.shortcuts()
    (switch,) = [a for a in window.findChildren(QAction) if a.text() == "Single-&key shortcuts"]
    switch.trigger()
    assert not compare.shortcuts()
    assert browse.shortcuts() == [QKeySequence("Ctrl+B")]
    switch.trigger()
    assert compare.shortcuts() == [QKeySequence("C")]
    assert QKeySequence("B") in browse.shortcuts()
    canvas = window.reference.canvas
    canvas.setFocus()
    QTest.keyClick(canvas, Qt.Key.Key_F10)
    bar = window.top_bar.menu_bar
    assert bar.activeAction() is bar.actions()[0]
    bar.setActiveAction(None)
    canvas.setFocus()
    qtbot.waitUntil(canvas.hasFocus)
    window.top_bar._fold(True)
    assert not window.top_bar.menu_bar.isVisible() and window.top_bar.menus.isVisible()
    QTest.keyClick(canvas, Qt.Key.Key_C)
    assert window.panes.images == [window.generator]
    titles = [a.text() for a in window.top_bar.menus.actions() if a.menu() is not None]
    assert titles == ["&File", "&Edit", "&View", "&Region", "&Help"]
    opened: list[bool] = []
    monkeypatch.setattr(window.top_bar, "open_menus", lambda: opened.append(True))
    QTest.keyPress(window, Qt.Key.Key_Alt)
    QTest.keyClick(window, Qt.Key.Key_F7, Qt.KeyboardModifier.AltModifier)
    QTest.keyRelease(window, Qt.Key.Key_Alt)
    assert not opened
    QTest.keyPress(window, Qt.Key.Key_Alt)
    QTest.keyRelease(window, Qt.Key.Key_Alt)
    assert opened == [True]
    window.latent_state.choose(shown=True)
    window.browser.map.setFocus()
    qtbot.waitUntil(window.browser.map.hasFocus)
    QTest.keyClick(window.browser.map, Qt.Key.Key_Escape)
    assert window.browser.isHidden()
    assert window.generator.canvas.hasFocus()


def test_the_status_line_says_the_keys_under_the_mouse(make_window: WindowMaker) -> None:
    window = make_window()
    assert window.status.keys == status_keys("Images")
    assert "[Drag] turn" in window.status.keys and "[R] region" in window.status.keys
    whole = help_text()
    for gestures in GESTURES.values():
        assert all(g.effect in whole for g in gestures)
    found = help_text("lasso")
    assert "draw a rectangle" in found and "the menus" not in found
    QTest.mouseMove(window.reference.canvas, QPoint(200, 200))
    images = window.reference.canvas.statusTip()
    assert images == status_keys("Images")
    window.sensitivity_state.set_tool("lasso")
    assert window.status.keys == status_keys("Drawing a region")
    window.sensitivity_state.set_tool(None)
    assert window.status.keys == images
    corners = ((0.2, 0.2), (0.6, 0.2), (0.6, 0.6), (0.2, 0.6))
    window.sensitivity_state.add_region(Outline(corners))
    # The mouse is over the image, and has not moved.
    assert window.status.keys == status_keys("Regions") == window.reference.canvas.statusTip()
    window.sensitivity_state.activate(None)
    assert window.status.keys == images
    assert "Ctrl" not in window.editor.statusTip()
    window.sensitivity_state.hover(150.0)
    assert window.editor.statusTip() == status_keys("Value under the mouse")


def test_bar_and_browser_have_room_at_any_width(make_window: WindowMaker) -> None:
    window = make_window()
    bar = window.top_bar
    bar.setParent(None)
    bar.volume.set_title("a volume whose file has a name of quite some length, 2026-11-25, final")
    bar.setMinimumWidth(0)
    bar.show()
    for width in (1000, 1180, 1440, 2560):
        bar.resize(width, 36)
        QApplication.processEvents()
        assert bar.is_folded == (width < 1180)
        shown = [w for w in bar.children() if isinstance(w, QWidget) and w.isVisible()]
        places = sorted((place(w, bar) for w in shown), key=lambda rect: rect.left())
        assert places[0].left() >= 0 and places[-1].right() < width
        assert all(one.right() < other.left() for one, other in pairwise(places))
        for button in bar.findChildren(QToolButton):
            if button.isVisible() and button is not bar.volume:
                assert button.width() >= button.minimumSizeHint().width()
    panes, browser = window.panes, window.browser
    window.latent_state.choose(shown=True)
    panes.setParent(None)
    panes.show()
    # Heights of the images in windows of 900, 640 and 720 pixels, with an editor of 35 %.
    for size, square, image in (
        ((1440, 524), 470, 400),
        ((1000, 355), 300, 300),
        ((1280, 402), 350, 480),
    ):
        panes.resize(*size)
        QApplication.processEvents()
        for part in (browser.map, browser.grid):
            assert part.width() == part.height() >= square
            assert panes.rect().contains(place(part, panes))
        assert browser.map.size() == browser.grid.size()
        assert browser.map.y() == browser.grid.y() == browser.bar.height() == 36
        assert window.reference.width() >= image
        assert window.reference.height() == size[1]
        parts = [w for w in browser.bar.children() if isinstance(w, QWidget) and w.isVisible()]
        assert all(browser.bar.rect().contains(place(w, browser.bar)) for w in parts)
    for part in (bar, panes):
        part.close()
        part.deleteLater()
