from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QPushButton
from ramp import make_volume
from window_fakes import FakeEngine

from app.engines.requests import UNWATCHED, ImageRequest, Watch
from app.state import slow_lights
from model.scene.view import View


def draw_slowly(
    self: FakeEngine, request: ImageRequest, watch: Watch = UNWATCHED
) -> NDArray[np.float32]:
    """As the ray caster draws, slowly."""
    self.by_raycast = True
    time.sleep(0.1)
    pixels = request.quality.pixels
    return np.full((pixels.height, pixels.width, 4), 0.5, np.float32)


def test_a_light_that_goes_out_is_told_and_offered(qtbot, make_window, builders, monkeypatch):
    monkeypatch.setattr(FakeEngine, "image", draw_slowly)
    # Of the pixels of a first image, however large the pane.
    monkeypatch.setattr(slow_lights, "SLOW_LIGHT_S", 0.01)
    monkeypatch.setattr(slow_lights, "SLOW_SOFT_S", -1.0)
    window = make_window(model=None)
    builders.volumes["other"] = make_volume()
    notice, work = window.notice, window.workspace.reference
    window.workspace.opening.open(Path("other"))
    qtbot.waitUntil(lambda: window.workspace.is_settled and window.workspace.opened is not None)
    qtbot.waitUntil(lambda: window.workspace._analyst.is_ready)
    window.state.set_view(View(azimuth=50.0))
    qtbot.waitUntil(lambda: "has no light" in notice.text)
    assert work.settings.lighting == "none"
    assert window.reference_controls.light.title == "None (too slow)"
    buttons: dict[str, Any] = {b.text(): b for b in notice.findChildren(QPushButton)}
    buttons["Light it"].click()
    assert work.settings.lighting == "direct"
    assert notice.text == ""
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    # The last image stays while another light is prepared.
    pane = window.reference
    assert pane.canvas.image is not None
    shown: list[Any] = []
    pane.client.stateChanged.connect(
        lambda _s: shown.append((pane.canvas.image, pane.canvas.message))
    )
    window.workspace.reference.choose(lighting="none")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert builders.settings[-1].lighting == "none"
    assert len(shown) > 1
    assert all(image is not None and not message for image, message in shown)
