"""A window at some sizes: ``sized_window.py WIDTHxHEIGHT ...``, in logical pixels.

The folders of this file, of tests of the window, of all tests and of tfscope must be on PYTHONPATH.
The environment has the scale of the screen.

It prints one line of JSON for each size: with everything open that floats, and with the browser.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from PySide6.QtCore import QPoint, QRect
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QAbstractSpinBox,
    QApplication,
    QLineEdit,
    QMenuBar,
    QWidget,
)
from window_fakes import FakeBuilders

from app.engines.engines import GeneratorSettings
from app.state.preferences import Preferences
from app.theme import apply_theme
from app.window.main_window import MainWindow

CONTROLS = QAbstractButton, QAbstractSpinBox, QLineEdit, QMenuBar


def cut_in(window: QWidget) -> list[str]:
    """Names of controls that are seen, but not as a whole."""
    found = []
    for widget in window.findChildren(QWidget):
        if not isinstance(widget, CONTROLS) or not widget.isVisible():
            continue
        above = widget.parentWidget()
        # What scrolls comes into sight.
        while above is not None and not isinstance(above, QAbstractScrollArea):
            place = QRect(widget.mapTo(above, QPoint()), widget.size())
            if not above.rect().contains(place):
                name = widget.accessibleName() or widget.objectName() or type(widget).__name__
                found.append(f"{name} in {type(above).__name__}")
                break
            above = None if above is window else above.parentWidget()
    return found


def main(sizes: list[tuple[int, int]]) -> None:
    """Print what a window looks like at some sizes."""
    application = QApplication([])
    apply_theme(application, "dark")
    window = MainWindow(FakeBuilders().make(), None, GeneratorSettings(), Preferences(None))
    window.workspace.open_model(Path("model"))
    window.workspace.reading.open(Path("ramp"))
    window.show()
    while not window.workspace.is_settled:
        application.processEvents()
    for size in sizes:
        window.resize(*size)
        application.processEvents()
        found = {"plain": _seen(window)}
        window.crop_card.set_shown(True)
        window.up_axis_card.ask("+z")
        for number in range(2):
            window.notice.tell(f"/a/folder/engine{number}.nrrd: the file is truncated; copy it.")
        application.processEvents()
        found["floating"] = _seen(window)
        window.latent_state.choose(shown=True)
        application.processEvents()
        found["browsing"] = _seen(window)
        window.latent_state.choose(shown=False)
        window.crop_card.set_shown(False)
        window.up_axis_card.hide()
        window.notice.clear()
        ratio = window.devicePixelRatioF()
        print(json.dumps({"wanted": size, "ratio": ratio, **found}), flush=True)
    window.close()


def _seen(window: MainWindow) -> dict[str, object]:
    least, image = window.minimumSizeHint(), window.reference.canvas
    return {
        "size": [window.width(), window.height()],
        "least": [least.width(), least.height()],
        "image": [image.width(), image.height()],
        "squares": [window.browser.map.width(), window.browser.grid.width()],
        "cut": cut_in(window),
    }


if __name__ == "__main__":
    main([tuple(map(int, text.split("x"))) for text in sys.argv[1:]])  # type: ignore[misc]
