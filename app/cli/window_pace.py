"""Rate at which answers follow the mouse in the real window."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from model.errors import RenderError
from model.scene.region import Outline

MOUSE_SECONDS = 0.008
"""Time between two movements of the mouse."""

DRAG_SECONDS = 3.0
PATIENCE_SECONDS = 120.0


def measure_window(volume: Path, size: int) -> dict[str, float]:
    """Open a volume in the window, off screen, and drag and hover as a user would.

    Parameters
    ----------
    volume : Path
    size : int
        Size of the reference image.

    Returns
    -------
    dict of float
        Fresh answers a second while a region is dragged, a value is hovered over, and the
        view is turned with a pinned field.

    Raises
    ------
    RenderError
        When the window shows no sensitivity within two minutes.
    """
    if sys.platform == "linux":
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from dataclasses import replace

    from PySide6.QtCore import QCoreApplication, QEventLoop
    from PySide6.QtWidgets import QApplication

    from app.window.main_window import MainWindow

    QApplication.instance() or QApplication([])
    window = MainWindow()
    window.resize(1280, 720)
    window.show()
    window.workspace.set_reference_size(size)
    window.workspace.open_volume(volume)
    dispatcher, asked = window.workspace.sensitivity, window.sensitivity_state

    def wait(until: Callable[[], bool], seconds: float) -> bool:
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 5)
            if until():
                return True
            time.sleep(0.001)
        return until()

    def rate(signal: object, move: Callable[[float], None]) -> float:
        """Fresh answers a second while `move` is called with a share of the drag."""
        counted = 0

        def count() -> None:
            nonlocal counted
            counted += 1

        signal.connect(count)  # type: ignore[attr-defined]
        start = time.perf_counter()
        while (passed := time.perf_counter() - start) < DRAG_SECONDS:
            move(passed / DRAG_SECONDS)
            wait(lambda: False, MOUSE_SECONDS)
        signal.disconnect(count)  # type: ignore[attr-defined]
        return counted / passed

    def settled() -> bool:
        return window.workspace.is_settled and dispatcher.region_answer is not None

    try:
        if not wait(settled, PATIENCE_SECONDS):
            raise RenderError(f"{volume}: the window showed no sensitivity within two minutes.")
        asked.add_region(Outline.rectangle(0.2, 0.3, 0.5, 0.6))
        start = asked.outline
        lo, hi = dispatcher.window
        rates = {}
        rates["a dragged region"] = rate(
            dispatcher.regionAnswered, lambda share: asked.change_region(start.moved(share / 3, 0))
        )
        asked.finish_region()
        wait(lambda: False, 2)
        rates["a hovered value"] = rate(
            dispatcher.fieldAnswered, lambda share: asked.hover(lo + share * (hi - lo))
        )
        asked.pin((lo + hi) / 2)
        wait(lambda: False, 2)
        view = window.state.view
        rates["the field of a turned view"] = rate(
            dispatcher.fieldAnswered,
            lambda share: window.state.move_view(
                replace(view, azimuth=(view.azimuth + 90 * share) % 360)
            ),
        )
        window.state.finish_view()
        return rates
    finally:
        window.close()
