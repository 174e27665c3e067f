"""Rate at which answers follow the mouse in the real window."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from model.errors import RenderError
from model.scene.region import Outline

if TYPE_CHECKING:
    from app.window.main_window import MainWindow

MOUSE_SECONDS = 0.008
"""Time between two movements of the mouse."""

DRAG_SECONDS = 3.0
REST_SECONDS = 2.0
PATIENCE_SECONDS = 120.0


def measure_sensitivity(volume: Path, size: int) -> dict[str, float]:
    """Open a volume in the window, off screen, and drag and hover as a user would.

    Parameters
    ----------
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
    with _opened(volume, size) as window:
        dispatcher, asked = window.workspace.sensitivity, window.sensitivity_state
        _wait_for(volume, lambda: dispatcher.answers.region is not None)
        asked.add_region(Outline.rectangle(0.2, 0.3, 0.5, 0.6))
        start = asked.outline
        lo, hi = dispatcher.window
        rates = {}
        rates["a dragged region"] = _rate(
            dispatcher.answers.regionAnswered,
            lambda share: asked.change_region(start.moved(share / 3, 0)),
        )
        asked.finish_region()
        wait(lambda: False, REST_SECONDS)
        rates["a hovered value"] = _rate(
            dispatcher.answers.fieldAnswered, lambda share: asked.hover(lo + share * (hi - lo))
        )
        asked.pin((lo + hi) / 2)
        wait(lambda: False, REST_SECONDS)
        rates["the field of a turned view"] = _rate(dispatcher.answers.fieldAnswered, _turn(window))
        window.state.finish_view()
        return rates


def measure_browser(volume: Path, model: Path | None = None) -> dict[str, float]:
    """Open a volume in the window, off screen, and browse its map as a user would.

    Parameters
    ----------
    model : Path, optional
        Opened with it, and asked for the pictures; without one, the shipped model is there, and
        whoever is fast enough draws.

    Returns
    -------
    dict of float
        Fresh pictures a second under the moving mouse, fresh grids while the rectangle and the
        view are dragged, and how often a second the map alone is painted.

    Raises
    ------
    RenderError
        When the window shows no map within two minutes.
    """
    with _opened(volume, None) as window:
        latent, work = window.latent_state, window.workspace.latent
        pictures = work.pictures
        if model is not None:
            window.workspace.open_model(model)
            _wait_for(volume, lambda: pictures.drawer.learned_size is not None)
            latent.choose(engine="learned")
        latent.choose(shown=True)
        _wait_for(volume, lambda: pictures.grid is not None and work.session.overview is not None)
        # It is computed once, and takes a processor meanwhile.
        _wait_for(volume, lambda: not work.session.is_embedding)
        wait(lambda: False, REST_SECONDS)
        rates = {
            "the picture under the mouse": _rate(
                pictures.hoverDrawn, lambda share: latent.set_hover((share - 0.5, 0.4 - share / 2))
            )
        }
        latent.set_hover(None)
        wait(lambda: False, REST_SECONDS)
        rates["the grid of a dragged rectangle"] = _rate(
            pictures.gridDrawn,
            lambda share: latent.move_brush((-0.8, -0.8, 0.8 - share / 2, 0.8 - share / 3)),
        )
        latent.finish_brush()
        wait(lambda: False, REST_SECONDS)
        rates["the grid of a turned view"] = _rate(pictures.gridDrawn, _turn(window))
        window.state.finish_view()
        wait(lambda: False, REST_SECONDS)
        painted, start = 0, time.perf_counter()
        while (passed := time.perf_counter() - start) < 1:
            window.browser.map.repaint()
            painted += 1
        rates["the map, painted"] = painted / passed
        return rates


@contextmanager
def _opened(volume: Path, size: int | None) -> Iterator[MainWindow]:
    """Open the window off screen, with a volume and its images, and close it at the end."""
    if sys.platform == "linux":
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from PySide6.QtWidgets import QApplication

    from app.window.main_window import MainWindow

    QApplication.instance() or QApplication([])
    window = MainWindow()
    try:
        window.resize(1280, 720)
        window.show()
        if size is not None:
            window.workspace.reference.choose(size=size)
        window.workspace.reading.open(volume)
        _wait_for(volume, lambda: window.workspace.is_settled)
        yield window
    finally:
        window.close()


def _turn(window: MainWindow) -> Callable[[float], None]:
    """Return what turns the view by a share of a quarter."""
    view = window.state.view

    def turn(share: float) -> None:
        window.state.move_view(replace(view, azimuth=(view.azimuth + 90 * share) % 360))

    return turn


def _rate(signal: Any, move: Callable[[float], None]) -> float:
    """Fresh answers a second while `move` is called with a share of the drag."""
    counted = 0

    def count() -> None:
        nonlocal counted
        counted += 1

    signal.connect(count)
    start = time.perf_counter()
    while (passed := time.perf_counter() - start) < DRAG_SECONDS:
        move(passed / DRAG_SECONDS)
        wait(lambda: False, MOUSE_SECONDS)
    signal.disconnect(count)
    return counted / passed


def _wait_for(volume: Path, ready: Callable[[], bool]) -> None:
    if not wait(ready, PATIENCE_SECONDS):
        raise RenderError(f"{volume}: the window had not answered within two minutes.")


def wait(until: Callable[[], bool], seconds: float) -> bool:
    """Handle the window's events until something is so, at most for some seconds.

    Returns
    -------
    bool
        Whether it is so.
    """
    from PySide6.QtCore import QCoreApplication, QEventLoop

    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 5)
        if until():
            return True
        time.sleep(0.001)
    return until()
