from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QPushButton
from ramp import make_tf
from window_fakes import FakeEngine

from app.engines.requests import UNWATCHED, ImageRequest, Watch
from model.scene.transfer_function import OpacityTF, TransferFunction


def draw(self: FakeEngine, request: ImageRequest, watch: Watch = UNWATCHED) -> NDArray[np.float32]:
    """As opaque as the TF at its most opaque."""
    self.requests.append(request)
    pixels = request.quality.pixels
    level = float(request.inputs.opacity_tf.sample().max())
    return np.full((pixels.height, pixels.width, 4), level, np.float32)


def test_nothing_visible_is_said_with_a_way_out(qtbot, make_window, builders, monkeypatch):
    monkeypatch.setattr(FakeEngine, "image", draw)
    window = make_window(model=None)
    notice = window.notice
    assert notice.text == ""
    empty = TransferFunction(OpacityTF((100.0, 200.0)), make_tf().color)
    window.state.tf_input.move(empty)
    qtbot.wait(50)
    assert notice.text == ""  # not while something is dragged
    window.state.tf_input.finish("drag")
    qtbot.waitUntil(lambda: "transparent" in notice.text)
    notice.findChild(QPushButton).click()
    qtbot.waitUntil(lambda: notice.text == "")
    assert window.state.transfer_function != empty
