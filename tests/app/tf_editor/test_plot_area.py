from __future__ import annotations

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from app.tf_editor.plot_area import MOST_TICKS, TICK_ROOM, PlotArea

HEIGHT = 118.0


@pytest.mark.parametrize("limit", np.geomspace(1e-5, 10, 61))
def test_the_second_axis_has_a_few_ticks_whose_labels_have_room(qtbot: QtBot, limit: float) -> None:
    area = PlotArea()
    qtbot.addWidget(area.widget)
    _, axis = area.add_second_scale()
    _, ticks = axis.tickValues(-limit, limit, HEIGHT)[0]
    assert 0.0 in ticks and 3 <= len(ticks) <= MOST_TICKS
    np.testing.assert_allclose(sorted(ticks), -np.array(sorted(ticks))[::-1], atol=1e-9 * limit)
    places = (np.array(ticks) / limit + 1) / 2 * HEIGHT
    assert places.min() >= TICK_ROOM - 1e-6 and places.max() <= HEIGHT - TICK_ROOM + 1e-6
    assert np.diff(np.sort(places)).min() > 14
