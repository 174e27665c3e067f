import shutil
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from mouse_events import drag, wheel
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtTest import QTest
from ramp import make_tf, make_volume
from rested_window import act_until
from toy_codec import ToyCodec, toy_space

from app.latent_browser.cell_grid import caption_of
from app.latent_browser.latent_browser import parsed_band
from app.latent_browser.map_marks import shades_of
from model.errors import LatentError
from model.latent.embedding import EmbeddingProcess
from model.latent.latent_space import TFFrame
from model.scene.transfer_function import GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View


@pytest.fixture(scope="module")
def stored_map(tmp_path_factory):
    """A stored map's folder; its places are the plane of the toy's codes itself."""
    folder = tmp_path_factory.mktemp("map")
    space = toy_space(folder, (100.0, 200.0), (100.0, 200.0))
    codes = space.open_map().codes
    space.keep_map(codes, codes * 0.9)
    return folder


@pytest.fixture
def places(tmp_path, builders, stored_map):
    """Have a stored map of this test alone."""
    shutil.copytree(stored_map, tmp_path, dirs_exist_ok=True)
    builders.map_folder = tmp_path


@pytest.fixture
def window(qtbot, make_window, places):
    window = make_window()
    open_browser(qtbot, window)
    open_map(qtbot, window)
    return window


def open_browser(qtbot, window):
    window.resize(1200, 800)
    QTest.keyClick(window, Qt.Key.Key_B, Qt.KeyboardModifier.ControlModifier)
    if not window.latent_state.choices.shown:
        # Without a window system, shortcuts of menus are not delivered.
        window.top_bar.browse.click()
    work = window.workspace.latent
    qtbot.waitUntil(lambda: work.session.map is not None and work.grid is not None)
    assert work.session.overview is not None


def open_map(qtbot, window):
    window.browser.bar.map.click()
    pictures = window.workspace.latent
    qtbot.waitUntil(lambda: pictures.grid is not None and pictures.grid.cells is not None)
    qtbot.waitUntil(lambda: window.workspace.latent.session.different is not None)


def pixel(map_view, place):
    return map_view.frame.pixel(place).toPoint()


def move(qtbot, map_view, place):
    QTest.mouseMove(map_view, pixel(map_view, place))


SHIFT = Qt.KeyboardModifier.ShiftModifier


def test_the_browser_takes_the_place_of_the_generator(qtbot, make_window, builders, places):
    window = make_window()
    assert builders.spaces == []
    browse, workspace = window.top_bar.browse.click, window.workspace
    for end in (browse, lambda: workspace.show(workspace.opened)):
        browse()
        assert workspace._scheduler._later.isActive()
        end()
        assert not workspace._scheduler._later.isActive()
    browse()
    open_browser(qtbot, window)
    open_map(qtbot, window)
    assert window.browser.isVisible()
    assert not window.generator.isVisible()
    assert window.reference.isVisible()
    asked = len(builders.generators[-1].requests)
    act_until(qtbot, window.workspace.settled, window.state.set_view, View(50, 10, 0, 1))
    assert len(builders.generators[-1].requests) == asked
    window.top_bar.browse.click()
    assert not window.browser.isVisible()
    assert window.generator.isVisible()
    qtbot.waitUntil(lambda: builders.generators[-1].requests[-1].inputs.view == View(50, 10, 0, 1))
    window.top_bar.browse.click()
    QTest.keyClick(window.browser.map, Qt.Key.Key_Escape)
    assert not window.browser.isVisible() and window.generator.isVisible()


def test_the_grid_shows_the_mean_of_each_cell(window, builders, places):
    grid = window.workspace.latent.grid
    session = window.workspace.latent.session
    means = session.map.cells(window.latent_state.brush)
    cells = grid.tfs, means.count.ravel(), means.codes.reshape(16, 1, -1)
    for tf, count, code in zip(*cells, strict=True):
        assert (tf is None) == (count == 0)
        if tf is not None:
            opacities = tf.sample(session.space.frame.window)
            assert opacities == pytest.approx(ToyCodec().decode(code)[0], abs=0.02)
    # All of them in one request.
    request = [r for r in builders.analysts[-1].others if r.channel == "grid"][-1]
    asked = [request.inputs, *request.more]
    assert [one.opacity_tf for one in asked] == [tf for tf in grid.tfs if tf is not None]
    drawn = window.browser.grid
    assert len(drawn.images) == len(asked) and not drawn.text
    one = replace(grid, cells=replace(means, count=np.eye(4, dtype=np.int64)))
    assert [caption_of(one, cell) for cell in (0, 1)] == ["1 TF", "0 TFs"]
    # The middle says if the next ones take long.
    before = drawn.grab().toImage()
    window.workspace.latent.slow_grid.changed.emit(0.5)
    assert drawn.text == "drawing …" and drawn.grab().toImage() != before


def test_the_browser_opens_on_the_tfs_that_differ_most(qtbot, make_window, builders, places):
    window = make_window()
    open_browser(qtbot, window)
    browser, latent = window.browser, window.workspace.latent
    session, grid = latent.session, latent.grid
    session.looked.emit(0.4)
    qtbot.waitUntil(lambda: "40 %" in browser.grid.message)
    assert session.different is not None and len(set(session.different)) == 16
    assert not browser.map.isVisible() and not browser.bar.reset.isVisible()
    # Each picture is of a sample of the map.
    for number, tf in zip(session.different, grid.tfs, strict=True):
        assert tf == session.space.tf_of(session.map.codes[number])
    # The fake's pictures are gray, each .1 brighter than the one before; the usual factor is 1.
    for cell, exposure in grid.exposures.items():
        level = 0.1 * cell
        wanted = 0.8 * (1 - level) / (level * 0.2) if 0 < level < 1 else 1.0
        assert exposure == pytest.approx(min(max(wanted, 1), 16), rel=1e-3)
    assert caption_of(grid, 3) == "9 × as bright" and caption_of(grid, 9) == ""
    window.overlays.choose_background("white")
    # On white, what is brightened would vanish.
    levels = [browser.grid.images[cell].pixelColor(0, 0).valueF() for cell in (0, 3)]
    assert levels == pytest.approx([1, 0.8], abs=0.01)
    # What is taken is as bright as its picture, in one undo step, and stands at its mark.
    before = window.state.transfer_function
    centre = browser.grid.cell_rect(3).center().toPoint()
    QTest.mouseClick(browser.grid, Qt.MouseButton.LeftButton, pos=centre)
    assert window.brightness.of("exact") == pytest.approx(grid.exposures[3])
    assert session.place == pytest.approx(session.map.places[session.different[3]])
    assert window.state.edits.stack.count() == 1
    centre = browser.grid.cell_rect(12).center().toPoint()
    QTest.mouseClick(browser.grid, Qt.MouseButton.LeftButton, pos=centre)
    assert window.brightness.of("exact") == 1
    for _ in range(2):
        window.state.edits.undo()
    assert window.state.transfer_function == before and window.brightness.of("exact") == 1
    # They stay while the view turns, and are chosen anew for a filter.
    chosen = session.different
    act_until(qtbot, session.overviewChanged, window.state.set_view, View(50, 10, 0, 1))
    assert session.different is chosen
    act_until(qtbot, session.differentChanged, window.latent_state.choose, band=(150.0, 160.0))
    assert session.wanted is not None and session.wanted[session.different].all()
    # Of too many, these are chosen whose pictures differ, such as the black and the white one.
    session._take_different(np.arange(20))
    qtbot.waitUntil(lambda: len(session.different) == 16 and latent.grid.tfs != grid.tfs)
    assert {0, 9, 10} <= set(session.different) and len(latent.grid.images) == 16
    # The map is one click away, in the same place, and so are they.
    open_map(qtbot, window)
    assert browser.map.isVisible() and browser.map.width() == browser.grid.width()
    browser.bar.map.click()
    qtbot.waitUntil(lambda: latent.grid is not None and not latent.grid.cells)


def test_in_path_traced_light_traced_pictures_follow_at_rest(qtbot, window, builders):
    def traced(channel):
        found = [r for r in builders.analysts[-1].others if r.channel == channel]
        return [r.traced for r in found if not r.quality.live]

    assert traced("grid") and not any(traced("grid"))
    window.workspace.reference.choose(lighting="path")
    qtbot.waitUntil(lambda: traced("grid")[-2:] == [False, True])
    grids = [r for r in builders.analysts[-1].others if r.channel == "grid"]
    assert grids[-1] == grids[-2]
    move(qtbot, window.browser.map, (-0.3, 0.2))
    qtbot.waitUntil(lambda: traced("hover")[-2:] == [False, True])


def test_hovering_shows_picture_and_tf(qtbot, window, builders):
    preview, caption = window.browser.preview, window.reference.caption
    window.workspace.reference.choose(reference_size=None)  # the pane's, which is not square
    qtbot.waitUntil(lambda: len({*window.reference.canvas.picture_rect.size().toTuple()}) == 2)
    before = caption.title, caption.detail
    window.overlays.choose_background("white")
    # A cell's curve is shown without its picture: the legend stays the image's.
    window.browser.grid.hovered.emit(next(iter(window.browser.grid.images)))
    assert window.overlays.legend_tf == window.state.transfer_function
    QTest.mouseClick(window.reference.canvas, Qt.MouseButton.LeftButton)
    label = window.sensitivity.labels[1]
    qtbot.waitUntil(label.isVisible)
    move(qtbot, window.browser.map, (0.2, 0.1))
    qtbot.waitUntil(lambda: preview.is_shown)
    request = [r for r in builders.analysts[-1].others if r.channel == "hover"][-1]
    place = window.latent_state.hover
    assert place == pytest.approx((0.2, 0.1), abs=0.02)
    expected, samples = window.workspace.latent.session.tf_at(place)
    assert request.inputs.opacity_tf == expected
    assert request.inputs.view == window.state.view
    # The legend is that of the picture.
    assert window.overlays.legend_tf.opacity == expected
    assert window.reference.canvas.cover.hasAlphaChannel() and not label.isVisible()
    # At rest it is drawn once more, at full size.
    canvas = window.reference.canvas
    qtbot.waitUntil(lambda: min(canvas.cover.size().toTuple()) == 256)
    # It shows all that the image does.
    whole = canvas.rect_of(canvas.cover).size().toTuple()
    assert whole == pytest.approx(canvas.picture_rect.size().toTuple(), abs=2)
    assert (caption.title, caption.detail) == ("At the mouse", "click to take")
    assert f"mean of {samples} TFs" in caption.toolTip()
    # Undo shows its own picture, not that of the place under the mouse.
    window.state.edits.undo()
    assert window.latent_state.hover is None
    assert label.isVisible() and not preview.is_shown
    assert window.overlays.legend_tf == window.state.transfer_function
    assert window.state.edits.stack.count() == 0
    assert (caption.title, caption.detail) == before


def test_a_click_makes_the_tf_in_one_undo_step(qtbot, window):
    before = window.state.transfer_function
    map_view = window.browser.map
    QTest.mouseClick(map_view, Qt.MouseButton.LeftButton, pos=pixel(map_view, (0.3, 0.2)))
    tf = window.state.transfer_function
    place = window.latent_state.hover
    wanted, _ = window.workspace.latent.session.tf_at(place)
    assert tf.opacity.sample() == pytest.approx(wanted.sample(), abs=0.03)
    assert 2 < len(tf.opacity.points) < 40
    assert tf.color == before.color
    # The mark is where the click was, not only near it.
    assert window.workspace.latent.session.place == place
    assert window.state.edits.stack.count() == 1
    window.state.edits.undo()
    assert window.state.transfer_function == before


def test_the_brush_is_moved_resized_and_drawn_anew(qtbot, window):
    map_view, latent = window.browser.map, window.latent_state
    latent.set_brush((-0.4, -0.4, 0.4, 0.4))
    drag(map_view, pixel(map_view, (0, 0)), pixel(map_view, (0.2, 0.1)))
    assert latent.brush == pytest.approx((-0.2, -0.3, 0.6, 0.5), abs=0.02)
    drag(map_view, pixel(map_view, (0.6, 0.5)), pixel(map_view, (0.8, 0.7)))
    assert latent.brush == pytest.approx((-0.2, -0.3, 0.8, 0.7), abs=0.02)
    drag(map_view, pixel(map_view, (0.1, 0.1)), pixel(map_view, (0.5, 0.3)), keys=SHIFT)
    assert latent.brush == pytest.approx((0.1, 0.1, 0.5, 0.3), abs=0.02)
    drag(map_view, pixel(map_view, (-0.9, -0.9)), pixel(map_view, (-0.5, -0.6)))
    assert latent.brush == pytest.approx((-0.9, -0.9, -0.5, -0.6), abs=0.02)
    assert window.state.edits.stack.count() == 0
    pictures = window.workspace.latent
    qtbot.waitUntil(lambda: pictures.grid is not None and pictures.grid.cells.count.sum() < 40)


def test_cells_are_chosen_divided_and_left_again(qtbot, window):
    grid, latent = window.browser.grid, window.latent_state
    cell, before = next(iter(grid.images)), latent.brush
    centre = grid.cell_rect(cell).center()
    wheel(grid, QPointF(centre), 1)
    assert latent.brush[2] - latent.brush[0] == pytest.approx((before[2] - before[0]) / 4)
    assert latent.brush[0] == pytest.approx(before[0] + (cell % 4) * (before[2] - before[0]) / 4)
    in_sight = QRectF(window.browser.map.rect())
    assert in_sight.contains(window.browser.map.frame.rectangle(latent.brush))
    wheel(grid, QPointF(centre), -1)
    assert latent.brush == before


def test_the_present_tf_is_placed_while_it_is_edited(window):
    # Mean and height, from 0 to 1, are the map's axes from -.9 to .9.
    for mean, height, place in ((120, 0.5, (-0.54, 0.0)), (180, 0.8, (0.54, 0.54))):
        opacity = OpacityTF((100.0, 200.0), (GaussianMode(mean, 8.0, height),))
        window.state.tf_input.set(TransferFunction(opacity, make_tf().color), "test")
        assert window.workspace.latent.session.place == pytest.approx(place, abs=0.2)


def test_pictures_follow_the_view_and_are_marked_until_then(qtbot, window, builders, monkeypatch):
    pictures = window.workspace.latent
    first = pictures.grid
    window.state.set_view(View(77, 0, 0, 1))
    assert window.browser.grid.is_stale
    qtbot.waitUntil(lambda: pictures.is_fresh(pictures.grid))
    assert not window.browser.grid.is_stale
    assert pictures.grid is not first
    # An edit of the opacity TF changes no picture of the map.
    asked = sum(r.channel == "grid" for r in builders.analysts[-1].others)
    tf = window.state.transfer_function
    window.state.tf_input.set(replace(tf, opacity=make_tf(140.0).opacity), "test")
    assert not window.browser.grid.is_stale
    assert sum(r.channel == "grid" for r in builders.analysts[-1].others) == asked
    # A grid that failed is asked for again.
    engine = builders.analysts[-1]
    with monkeypatch.context() as patch:
        patch.setattr(engine, "images", Mock(side_effect=LatentError("No pictures today.")))
        act_until(qtbot, pictures.problem, window.latent_state.set_brush, (-0.5, -0.5, 0.5, 0.5))
    act_until(qtbot, pictures.gridDrawn, pictures.ask)
    # Those of the view in an image of another shape show other parts of the volume.
    qtbot.waitUntil(lambda: pictures.session._has_overview)
    window.state.set_reach((0.9, 0.9))
    assert pictures._grids["exact"].is_pending and pictures.session._looking.is_awaited


def test_a_filter_by_value(qtbot, window):
    session, bar = window.workspace.latent.session, window.browser.bar
    bar.band.setText("150 to 160")
    QTest.keyClick(bar.band, Qt.Key.Key_Return)
    assert window.latent_state.choices.band == (150.0, 160.0)
    assert 0 < session.wanted.sum() < len(session.wanted)
    means = (session.chosen.codes[:, 0] + 1) / 2 * 100 + 100
    assert ((means > 130) & (means < 180)).all()
    bar.band.setText("rubbish")
    QTest.keyClick(bar.band, Qt.Key.Key_Return)
    assert "rubbish" in window.notice.text
    bar.band.setText("")
    assert session.wanted.all()
    # The ends of the colours are those of the window, to within a bin: whole numbers of bytes.
    session.space = replace(session.space, frame=TFFrame((0.0, 255.0), (31.875, 223.125)))
    shades = shades_of(session, "HU")
    assert (shades.low, shades.high) == ("Value 32", "223 HU")


def test_the_map_is_computed_shown_and_kept(qtbot, make_window, builders, tmp_path):
    builders.map_folder = tmp_path
    window = make_window()
    window.top_bar.browse.click()
    session = window.workspace.latent.session
    qtbot.waitUntil(lambda: session.map is not None)
    assert not session.map.is_final
    assert window.browser.bar.stop.isVisible()
    qtbot.waitUntil(lambda: session.map is not None and session.map.is_final)
    assert not window.browser.bar.stop.isVisible()
    assert toy_space(tmp_path, (100.0, 200.0), (112.0, 188.0)).open_map().is_final
    # Another volume has its own map, and takes no TF of the one before.
    tf, _ = session.tf_at((0.3, 0.3))
    builders.volumes["other"] = make_volume("other", 300.0)
    with qtbot.waitSignal(session.mapChanged, check_params_cb=lambda map_: map_ is not None):
        window.workspace.opening.open(Path("other"))
    assert session.space.frame.scalar_range == (100.0, 300.0)
    before = window.state.transfer_function
    window.browser.take(tf, "old", (0.3, 0.3))
    assert window.state.transfer_function == before


def test_the_map_is_cancelled_or_the_window_closed(qtbot, make_window, builders, tmp_path):
    builders.map_folder = tmp_path
    started = []
    for close in (False, True):
        window = make_window()
        window.top_bar.browse.click()
        session = window.workspace.latent.session
        qtbot.waitUntil(lambda s=session: s.is_embedding)
        started.append(session._embedding)
        if not close:
            window.browser.bar.stop.click()
            assert not session.is_embedding
            assert session.map is not None
        window.close()
    assert all(one._process is None or one._process.poll() is not None for one in started)
    assert not list(tmp_path.iterdir())


def test_map_and_grid_are_used_by_keys(qtbot, window):
    map_view, grid, latent = window.browser.map, window.browser.grid, window.latent_state
    # Of the TFs that differ most, there are marks once 16 are chosen.
    session, pictures = window.workspace.latent.session, []
    for session.different in (None, np.arange(32), np.arange(16)):
        pictures.append(map_view.grab().toImage())
    assert pictures[0] == pictures[1] != pictures[2]
    before = window.state.transfer_function
    QTest.keyClick(map_view, Qt.Key.Key_Right)
    first = latent.hover
    QTest.keyClick(map_view, Qt.Key.Key_Right)
    QTest.keyClick(map_view, Qt.Key.Key_Up)
    assert latent.hover[0] > first[0] and latent.hover[1] > first[1]
    QTest.keyClick(map_view, Qt.Key.Key_Return)
    assert window.state.transfer_function != before
    seen = []
    grid.hovered.connect(seen.append)
    for key in (Qt.Key.Key_Right, Qt.Key.Key_Right, Qt.Key.Key_Down, Qt.Key.Key_Left):
        QTest.keyClick(grid, key)
    assert seen == [0, 1, 5, 4]
    taken = window.state.transfer_function
    assert 4 in grid.images
    QTest.keyClick(grid, Qt.Key.Key_Return)
    assert window.state.transfer_function != taken
    brush = latent.brush
    QTest.keyClick(grid, Qt.Key.Key_Plus)
    assert latent.brush != brush
    QTest.keyClick(grid, Qt.Key.Key_Minus)
    map_view.setFocus()
    QTest.keyClick(map_view, Qt.Key.Key_Plus)
    assert map_view.frame.zoom > 1
    QTest.keyClick(map_view, Qt.Key.Key_Home)
    assert map_view.frame.zoom == 1
    assert latent.brush == pytest.approx(brush)


def test_what_fails_is_explained(qtbot, make_window, builders, tmp_path, monkeypatch):
    builders.map_folder = tmp_path
    fail = Mock(side_effect=LatentError("The map cannot be computed."))
    monkeypatch.setattr(EmbeddingProcess, "run", fail)
    window = make_window()
    window.top_bar.browse.click()
    qtbot.waitUntil(lambda: "cannot be computed" in window.notice.text)
    session = window.workspace.latent.session
    assert session.map is not None
    builders.space_error = LatentError("The codec has collapsed.")
    with qtbot.waitSignal(session.problem, check_params_cb=lambda text: "collapsed" in text):
        session.reset()
    assert session.map is None


@pytest.mark.parametrize(
    ("text", "band"),
    [
        ("", None), ("90 to 120", (90.0, 120.0)), ("-5, 3.5", (-5.0, 3.5)),
        ("90-120", (90.0, 120.0)), ("-5--3", (-5.0, -3.0)), ("120 – 90", (90.0, 120.0)),
        ("1e3", (1000.0, 1000.0)),
    ],
)  # fmt: skip
def test_bands_are_read(text, band):
    assert parsed_band(text) == band


def newest(builders, channel):
    return [r for r in builders.generators[-1].others if r.channel == channel][-1]


def test_the_model_draws_codes_of_its_codec(qtbot, make_window, builders, places):
    window = make_window()
    window.resize(1200, 800)
    window.latent_state.choose(codec="model", on_map=True)
    window.top_bar.browse.click()
    work = window.workspace.latent
    # The first one imports torch, on machines that may be busy.
    qtbot.waitUntil(lambda: work.session.overview is not None)
    qtbot.waitUntil(lambda: bool(work.grid and work.grid.images))
    assert builders.spaces == [Path("model")]
    assert work.grid.source == "learned"
    # The mean codes in one batch.
    means = work.grid.cells.codes.reshape(16, -1)[work.grid.cells.count.ravel() > 0]
    np.testing.assert_allclose(newest(builders, "grid").codes, means, rtol=1e-6)
    # The fake's images are as bright as the first number of their code.
    brightness = [image[0, 0, 0] for image in work.grid.images.values()]
    assert brightness == pytest.approx((means[:, 0] + 1) / 2, abs=1e-6)
    # Under the mouse, the interpolated code.
    with qtbot.waitSignal(work.hoverDrawn, check_params_cb=bool) as drawn:
        move(qtbot, window.browser.map, (-0.3, 0.25))
    code, _ = work.session.code_at(window.latent_state.hover)
    assert newest(builders, "hover").codes == (tuple(code.tolist()),)
    expected = work.session.tf_at(window.latent_state.hover)[0]
    assert (drawn.args[0].source, drawn.args[0].tf) == ("learned", expected)
    window.latent_state.choose(codec="shipped")
    qtbot.waitUntil(lambda: work.grid is not None and work.grid.source == "exact")
    # Without the model, its codec has nothing to draw with.
    window.latent_state.choose(codec="model")
    qtbot.waitUntil(lambda: work.grid is not None and work.grid.source == "learned")
    window.workspace.open_model(None)
    assert window.latent_state.choices.codec == "shipped"
    qtbot.waitUntil(lambda: work.grid is not None and work.grid.source == "exact")
