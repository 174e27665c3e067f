from pathlib import Path

import numpy as np
import pytest
from PySide6.QtTest import QTest
from toy_codec import toy_space
from window_fakes import PATIENCE_S


@pytest.fixture
def window(qtbot, make_window, builders, tmp_path):
    builders.draws_codes, builders.map_folder = True, tmp_path
    space = toy_space(tmp_path, (100.0, 200.0), (100.0, 200.0))
    codes = space.open_map().codes
    space.keep_map(codes, 0.9 * codes)
    window = make_window()
    window.resize(1200, 800)
    window.latent_state.choose(codec="model", on_map=True)
    window.top_bar.browse.click()
    work = window.workspace.latent
    # The first one imports torch, on machines that may be busy.
    qtbot.waitUntil(lambda: work.session.overview is not None, timeout=1000 * PATIENCE_S)
    qtbot.waitUntil(lambda: bool(work.grid and work.grid.images), timeout=1000 * PATIENCE_S)
    return window


def newest(builders, channel):
    return [r for r in builders.generators[-1].others if r.channel == channel][-1]


def test_the_grid_draws_the_mean_codes_in_one_batch(window, builders):
    assert window.latent_state.choices.codec == "model"
    assert builders.spaces == [Path("model")]
    grid = window.workspace.latent.grid
    assert grid is not None and grid.source == "learned"
    means = grid.cells.codes.reshape(16, -1)[grid.cells.count.ravel() > 0]
    request = newest(builders, "grid")
    np.testing.assert_allclose(request.codes, means, rtol=1e-6)
    # The fake's images are as bright as the first number of their code.
    brightness = [image[0, 0, 0] for image in grid.images.values()]
    assert brightness == pytest.approx((means[:, 0] + 1) / 2, abs=1e-6)


def test_hovering_draws_the_interpolated_code_and_shows_the_decoded_tf(qtbot, window, builders):
    work, map_view = window.workspace.latent, window.browser.map
    QTest.mouseMove(map_view, map_view.frame.pixel((-0.3, 0.25)).toPoint())
    qtbot.waitUntil(lambda: work.hover is not None)
    place = window.latent_state.hover
    code, _ = work.session.code_at(place)
    request = newest(builders, "hover")
    assert request.codes == (tuple(code.tolist()),)
    assert work.hover is not None and work.hover.source == "learned"
    assert work.hover.tf == work.session.tf_at(place)[0]


def test_the_shipped_codecs_codes_are_not_the_models(qtbot, window, builders):
    pictures = window.workspace.latent
    window.latent_state.choose(codec="shipped")
    qtbot.waitUntil(lambda: pictures.grid is not None and pictures.grid.source == "exact")
    # Without the model, its codec has nothing to draw with.
    window.latent_state.choose(codec="model")
    qtbot.waitUntil(lambda: pictures.grid is not None and pictures.grid.source == "learned")
    window.workspace.open_model(None)
    assert window.latent_state.choices.codec == "shipped"
    qtbot.waitUntil(lambda: pictures.grid is not None and pictures.grid.source == "exact")
