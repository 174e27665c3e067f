"""Events on an editor of TFs, as a mouse and a keyboard send them."""

from types import SimpleNamespace

import mouse_events
from mouse_events import LEFT, NONE
from PySide6.QtTest import QTest

from model.scene.volume import FileFacts


def click(editor, at, modifier=NONE):
    QTest.mouseClick(editor.area.widget.viewport(), LEFT, modifier, at)


def double_click(editor, at):
    """Click twice as a mouse does it: the second press comes as a double click."""
    viewport = editor.area.widget.viewport()
    QTest.mouseClick(viewport, LEFT, pos=at)
    QTest.mouseDClick(viewport, LEFT, pos=at)
    QTest.mouseRelease(viewport, LEFT, pos=at)


def drag(editor, start, end, modifier=NONE, button=LEFT):
    half = (start + end) / 2
    mouse_events.drag(editor.area.widget.viewport(), start, half, end, button=button, keys=modifier)


def histogram(counts, edges, data_range):
    """An opened volume as far as the editor shows it."""
    facts = {"data_range": data_range, "units": "K", "scale": "linear", "file": FileFacts()}
    return SimpleNamespace(counts=counts, edges=edges, volume=SimpleNamespace(**facts))
