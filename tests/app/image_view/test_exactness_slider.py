from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.engines.exactness import USUAL
from app.state.reference_choices import ReferenceChoices
from app.window.main_window import MainWindow
from model.scene.scene import Lighting


def test_a_stop_is_chosen_kept_and_drawn_with_its_figures(
    qtbot: QtBot, make_window: Callable[..., MainWindow]
) -> None:
    window = make_window(model=None, size="pane")
    control, work = window.exactness, window.workspace.reference
    # Where one renderer draws at rest and in motion, samples lie farther apart in motion.
    work.choose(lighting="direct", drawing="raycast")
    assert control.slider.value() == 1
    assert control.slider.accessibleName() == "From fast to exact: Balanced"
    assert "up to 12 / s" in control.slider.toolTip()
    assert work.settings.sample_distance == 0.5
    # A pane that has just been laid out has its own images drawn.
    qtbot.waitUntil(lambda: not work._pane_rest.isActive() and window.workspace.is_settled)
    # By key, to the last stop.
    QTest.keyClick(control.slider, Qt.Key.Key_End)
    assert work.choices.stop == window.preferences.settings.stop == "exact"
    assert work.settings.sample_distance == 0.25
    assert control.slider.accessibleName() == "From fast to exact: Exact"
    qtbot.waitUntil(lambda: "error" in control.figures.text(), timeout=10_000)
    rate, *words, error = control.figures.text().replace(",", "").split()
    assert float(rate) > 0 and words == ["/", "s", "error"]
    # Live images of the fake engine are one level brighter, in one channel of three.
    assert float(error) == pytest.approx(1 / 255 / np.sqrt(3), abs=2e-4)
    assert control.figures.accessibleName() == f"Moving images: {control.figures.text()}"


@pytest.mark.parametrize(("lighting", "exact"), [("none", 0.25), ("path", 0.5)])
def test_in_path_traced_light_samples_stay_apart(lighting: Lighting, exact: float) -> None:
    for stop, distance in (("fast", 0.5), (USUAL, 0.5), ("exact", exact)):
        choices = ReferenceChoices(lighting, stop=stop)
        assert choices.settings(None).sample_distance == distance
