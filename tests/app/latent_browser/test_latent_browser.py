"""The latent browser in the window, on fake engines and a toy codec, by real mouse events."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QFocusEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QInputDialog, QWidget
from pytestqt.qtbot import QtBot
from ramp import make_tf, make_volume
from toy_codec import ToyCodec, toy_space
from window_fakes import FakeBuilders

from app.latent_browser.browser_bar import parsed_band
from app.latent_browser.map_view import MapView
from app.state.latent_path import Frame, MovieOrder
from app.window.main_window import MainWindow
from model.errors import LatentError
from model.latent.embedding import EmbeddingProcess
from model.scene.tf_fitting import tf_difference
from model.scene.transfer_function import GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View

WindowMaker = Callable[..., MainWindow]


@pytest.fixture(scope="module")
def stored_map(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """A stored map's folder, and its places: the plane of the toy's codes itself."""
    folder = tmp_path_factory.mktemp("map")
    space = toy_space(folder, (100.0, 200.0), (100.0, 200.0))
    codes = space.open_map().codes
    places = codes * 0.9
    space.keep_map(codes, places)
    return folder, places.astype(np.float32)


@pytest.fixture
def places(
    tmp_path: Path, builders: FakeBuilders, stored_map: tuple[Path, np.ndarray]
) -> np.ndarray:
    """Places of a stored map of this test alone."""
    folder, places = stored_map
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    builders.map_folder = tmp_path
    return places.copy()


@pytest.fixture
def window(qtbot: QtBot, make_window: WindowMaker, places: np.ndarray) -> MainWindow:
    """A window that shows a stored map, and its grid."""
    window = make_window()
    open_browser(qtbot, window)
    return window


def open_browser(qtbot: QtBot, window: MainWindow) -> None:
    window.resize(1200, 800)
    QTest.keyClick(window, Qt.Key.Key_B, Qt.KeyboardModifier.ControlModifier)
    if not window.latent_state.choices.shown:
        # Without a window system, shortcuts of menus are not delivered.
        window.browse.click()
    work = window.workspace.latent
    qtbot.waitUntil(lambda: work.session.map is not None and work.pictures.grid is not None)
    qtbot.waitUntil(lambda: work.session.overview is not None)


def pixel(map_view: MapView, place: tuple[float, float]) -> QPoint:
    return map_view.frame.pixel(place).toPoint()


def move(qtbot: QtBot, map_view: MapView, place: tuple[float, float]) -> None:
    QTest.mouseMove(map_view, pixel(map_view, place))


def drag(widget: QWidget, *points: QPoint, modifier: Qt.KeyboardModifier) -> None:
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, modifier, points[0])
    for point in points[1:]:
        QTest.mouseMove(widget, point)
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, modifier, points[-1])


def turn_wheel(widget: QWidget, at: QPointF, notches: int) -> None:
    event = QWheelEvent(
        at, widget.mapToGlobal(at), QPoint(), QPoint(0, 120 * notches),
        Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(widget, event)


NO_KEY, SHIFT = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier


def test_the_browser_takes_the_place_of_the_generator(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    assert window.browser.isVisible()
    assert not window.generator.isVisible()
    assert window.reference.isVisible()
    asked = len(builders.generators[-1].requests)
    with qtbot.waitSignal(window.workspace.settled):
        window.state.set_view(View(50, 10, 0, 1))
    assert len(builders.generators[-1].requests) == asked
    window.browse.click()
    assert not window.browser.isVisible()
    assert window.generator.isVisible()
    qtbot.waitUntil(lambda: builders.generators[-1].requests[-1].inputs.view == View(50, 10, 0, 1))


def test_nothing_is_opened_before_the_browser_is(
    make_window: WindowMaker, builders: FakeBuilders, places: np.ndarray
) -> None:
    make_window()
    assert builders.spaces == []


def test_the_grid_shows_the_mean_of_each_cell(
    window: MainWindow, builders: FakeBuilders, places: np.ndarray
) -> None:
    grid = window.workspace.latent.pictures.grid
    assert grid is not None
    latent_map = window.workspace.latent.session.map
    assert latent_map is not None
    for cell, tf in enumerate(grid.tfs):
        row, column = divmod(cell, 4)
        left, lower, right, upper = window.latent_state.brush
        x0, x1 = (left + (right - left) * (column + i) / 4 for i in (0, 1))
        y0, y1 = (upper - (upper - lower) * (row + i) / 4 for i in (1, 0))
        x, y = latent_map.places.T
        inside = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
        assert (tf is None) == (not inside.any())
        if tf is not None:
            code = latent_map.codes[inside].mean(axis=0, keepdims=True)
            frame = window.workspace.latent.session.space.frame
            assert frame.opacities(tf) == pytest.approx(ToyCodec().decode(code)[0], abs=0.02)
    # All of them in one request.
    request = [r for r in builders.analysts[-1].others if r.channel == "grid"][-1]
    asked = [request.inputs, *request.more]
    assert [one.opacity_tf for one in asked] == [tf for tf in grid.tfs if tf is not None]
    assert len(window.browser.grid.images) == len(asked)


def test_in_path_traced_light_traced_pictures_follow_at_rest(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    def traced(channel: str) -> list[bool]:
        found = [r for r in builders.analysts[-1].others if r.channel == channel]
        return [r.traced for r in found if not r.quality.live]

    assert traced("grid") and not any(traced("grid"))
    window.workspace.reference.choose(lighting="path")
    qtbot.waitUntil(lambda: traced("grid")[-2:] == [False, True])
    grids = [r for r in builders.analysts[-1].others if r.channel == "grid"]
    assert grids[-1] == grids[-2]
    move(qtbot, window.browser.map, (-0.3, 0.2))
    qtbot.waitUntil(lambda: traced("hover")[-2:] == [False, True])
    # They are shown, and not asked for again.
    pictures = window.workspace.latent.pictures
    qtbot.waitUntil(lambda: not any(c.is_pending for c in pictures._hovers.values()))
    qtbot.wait(50)
    assert traced("hover").count(True) == 1


def test_hovering_shows_picture_and_tf(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    pictures = window.workspace.latent.pictures
    move(qtbot, window.browser.map, (0.2, 0.1))
    qtbot.waitUntil(lambda: pictures.hover is not None)
    request = [r for r in builders.analysts[-1].others if r.channel == "hover"][-1]
    place = window.latent_state.hover
    assert place is not None
    assert place == pytest.approx((0.2, 0.1), abs=0.02)
    expected, samples = window.workspace.latent.session.tf_at(place)
    assert request.inputs.opacity_tf == expected
    assert request.inputs.view == window.state.view
    assert window.browser.preview.is_shown
    assert str(samples) in window.browser.preview.caption
    # The legend is that of the picture.
    assert window.overlays.legend_tf.opacity == expected
    # At rest it is drawn once more, at full size.
    qtbot.waitUntil(lambda: not pictures.hover.image.shape[0] < 256 if pictures.hover else False)
    # Undo shows its own picture, not that of the place under the mouse.
    window.state.edits.undo()
    assert window.latent_state.hover is None
    assert not window.browser.preview.is_shown
    assert window.overlays.legend_tf == window.state.transfer_function
    assert window.state.edits.stack.count() == 0


def test_a_click_makes_the_tf_in_one_undo_step(qtbot: QtBot, window: MainWindow) -> None:
    before = window.state.transfer_function
    map_view = window.browser.map
    QTest.mouseClick(map_view, Qt.MouseButton.LeftButton, pos=pixel(map_view, (0.3, 0.2)))
    tf = window.state.transfer_function
    place = window.latent_state.hover
    assert place is not None
    wanted, _ = window.workspace.latent.session.tf_at(place)
    assert tf.opacity.sample() == pytest.approx(wanted.sample(), abs=0.03)
    assert 2 < len(tf.opacity.points) < 40
    assert tf.color == before.color
    # The mark is where the click was, not only near it.
    assert window.workspace.latent.session.place == place
    assert window.state.edits.stack.count() == 1
    window.state.edits.undo()
    assert window.state.transfer_function == before


def test_a_click_can_give_modes(qtbot: QtBot, window: MainWindow) -> None:
    window.browser.bar.modes.trigger()
    map_view = window.browser.map
    QTest.mouseClick(map_view, Qt.MouseButton.LeftButton, pos=pixel(map_view, (0.3, 0.2)))
    opacity = window.state.transfer_function.opacity
    assert opacity.modes
    assert not opacity.points
    wanted, _ = window.workspace.latent.session.tf_at(window.latent_state.hover or (0, 0))
    assert opacity.sample() == pytest.approx(wanted.sample(), abs=0.05)
    assert "modes" in window.status.news


def test_the_brush_is_moved_resized_and_drawn_anew(qtbot: QtBot, window: MainWindow) -> None:
    map_view, latent = window.browser.map, window.latent_state
    latent.set_brush((-0.4, -0.4, 0.4, 0.4))
    drag(map_view, pixel(map_view, (0, 0)), pixel(map_view, (0.2, 0.1)), modifier=NO_KEY)
    assert latent.brush == pytest.approx((-0.2, -0.3, 0.6, 0.5), abs=0.02)
    drag(map_view, pixel(map_view, (0.6, 0.5)), pixel(map_view, (0.8, 0.7)), modifier=NO_KEY)
    assert latent.brush == pytest.approx((-0.2, -0.3, 0.8, 0.7), abs=0.02)
    drag(map_view, pixel(map_view, (0.1, 0.1)), pixel(map_view, (0.5, 0.3)), modifier=SHIFT)
    assert latent.brush == pytest.approx((0.1, 0.1, 0.5, 0.3), abs=0.02)
    drag(map_view, pixel(map_view, (-0.9, -0.9)), pixel(map_view, (-0.5, -0.6)), modifier=NO_KEY)
    assert latent.brush == pytest.approx((-0.9, -0.9, -0.5, -0.6), abs=0.02)
    assert window.state.edits.stack.count() == 0
    pictures = window.workspace.latent.pictures
    qtbot.waitUntil(lambda: pictures.grid is not None and pictures.grid.cells.count.sum() < 40)


def test_a_brush_beside_all_samples_is_empty(qtbot: QtBot, window: MainWindow) -> None:
    window.latent_state.set_brush((0.99, 0.99, 0.999, 0.999))
    pictures = window.workspace.latent.pictures
    qtbot.waitUntil(lambda: pictures.grid is not None and not pictures.grid.images)
    QTest.mouseClick(
        window.browser.grid,
        Qt.MouseButton.LeftButton,
        pos=window.browser.grid.cell_rect(5).center().toPoint(),
    )
    assert window.state.edits.stack.count() == 0
    window.latent_state.choose(nearest=True)
    qtbot.waitUntil(lambda: pictures.grid is not None and len(pictures.grid.images) == 16)


def test_cells_are_chosen_divided_and_left_again(qtbot: QtBot, window: MainWindow) -> None:
    grid, latent = window.browser.grid, window.latent_state
    cell = next(iter(grid.images))
    centre = grid.cell_rect(cell).center()
    QTest.mouseClick(grid, Qt.MouseButton.LeftButton, pos=centre.toPoint())
    assert window.state.edits.stack.count() == 1
    before = latent.brush
    turn_wheel(grid, QPointF(centre), 1)
    assert latent.brush[2] - latent.brush[0] == pytest.approx((before[2] - before[0]) / 4)
    assert latent.brush[0] == pytest.approx(before[0] + (cell % 4) * (before[2] - before[0]) / 4)
    in_sight = QRectF(window.browser.map.rect())
    assert in_sight.contains(window.browser.map.frame.rectangle(latent.brush))
    turn_wheel(grid, QPointF(centre), -1)
    assert latent.brush == before


def test_no_cell_is_chosen_once_the_keys_are_elsewhere(qtbot: QtBot, window: MainWindow) -> None:
    grid, latent = window.browser.grid, window.latent_state
    before, zoomed = latent.brush, []
    grid.zoomed.connect(zoomed.append)
    for focused in (True, False):
        reason = Qt.FocusReason.TabFocusReason
        kind = QEvent.Type.FocusIn if focused else QEvent.Type.FocusOut
        QApplication.sendEvent(grid, QFocusEvent(kind, reason))
        if focused:
            QTest.keyClick(grid, Qt.Key.Key_Right)
    QTest.keyClick(grid, Qt.Key.Key_Plus)
    assert zoomed == [] and latent.brush == before


def test_the_present_tf_is_placed_while_it_is_edited(qtbot: QtBot, window: MainWindow) -> None:
    session = window.workspace.latent.session

    def show_mode(mean: float, height: float) -> tuple[float, float]:
        modes = (GaussianMode(mean, 8.0, height),)
        tf = TransferFunction(OpacityTF((100.0, 200.0), modes), make_tf().color)
        window.state.tf_input.set(tf, "test")
        assert session.place is not None
        return session.place

    # Mean and height, from 0 to 1, are the map's axes from -.9 to .9.
    low, high = show_mode(120, 0.5), show_mode(180, 0.8)
    assert low == pytest.approx((-0.54, 0.0), abs=0.2)
    assert high == pytest.approx((0.54, 0.54), abs=0.2)
    assert [step.place for step in window.latent_state.trail.steps[-2:]] == [low, high]
    assert not session.is_exact


def test_the_trail_comes_back_with_the_volume(qtbot: QtBot, window: MainWindow) -> None:
    session, latent = window.workspace.latent.session, window.latent_state
    for mean in (120, 150, 180):
        tf = OpacityTF((100.0, 200.0), (GaussianMode(mean, 8.0, 0.5),))
        window.state.tf_input.set(TransferFunction(tf, make_tf().color), "test")
    trail = latent.trail
    assert len(trail.steps) == 3
    opened = window.workspace.opened
    assert opened is not None
    # As another run has it: its codes, in the session's file.
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.reading.open(opened.path)
    assert [step.code for step in latent.trail.steps] == [step.code for step in trail.steps]
    qtbot.waitUntil(lambda: session.map is not None)
    assert latent.trail.space == trail.space
    found = np.array([step.place for step in latent.trail.steps])
    np.testing.assert_allclose(found, [step.place for step in trail.steps], atol=1e-3)
    # Codes of another codec, or of another length, say nothing about this map.
    step = trail.steps[0]
    longer = replace(trail, steps=(replace(step, code=(*step.code, 0.5)),))
    for strange in (replace(trail, space="another"), longer):
        latent.set_trail(strange)
        session.reset()
        qtbot.waitUntil(lambda: session.map is not None)
        assert latent.trail.steps == ()


def test_pictures_follow_the_view_and_are_marked_until_then(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    pictures = window.workspace.latent.pictures
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


def test_thumbnails_come_when_one_is_close(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    map_view, small = window.browser.map, window.workspace.latent.thumbnails
    assert map_view.thumbnails.in_sight == []
    for _ in range(8):
        turn_wheel(map_view, QPointF(map_view.rect().center()), 1)
    wanted = map_view.thumbnails.in_sight
    assert wanted
    qtbot.waitUntil(lambda: set(wanted) <= set(small.images))
    latent_map = window.workspace.latent.session.map
    assert latent_map is not None
    places = map_view.frame.pixels(latent_map.places[wanted])
    gaps = np.abs(places[:, None] - places).max(axis=2) + 1e3 * np.eye(len(wanted))
    assert gaps.min() >= 52
    # Over a thumbnail the mouse means its sample alone.
    seen = QRectF(map_view.rect())
    at = dict(zip(wanted, map_view.frame.pixels(latent_map.places[wanted]), strict=True))
    sample = next(s for s in wanted if seen.contains(QPointF(*at[s])))
    move(qtbot, map_view, tuple(latent_map.places[sample].tolist()))
    qtbot.waitUntil(lambda: window.latent_state.hover_sample == sample)
    assert any(r.channel == "thumbnails" for r in builders.analysts[-1].others)
    window.browser.bar.reset.click()
    assert map_view.thumbnails.in_sight == []


def test_filters_by_value_and_lasso(qtbot: QtBot, window: MainWindow) -> None:
    session, bar = window.workspace.latent.session, window.browser.bar
    bar.band.setText("150 to 160")
    QTest.keyClick(bar.band, Qt.Key.Key_Return)
    assert window.latent_state.choices.band == (150.0, 160.0)
    assert session.wanted is not None
    assert session.chosen is not None
    assert 0 < session.wanted.sum() < len(session.wanted)
    means = (session.chosen.codes[:, 0] + 1) / 2 * 100 + 100
    assert ((means > 130) & (means < 180)).all()
    bar.band.setText("rubbish")
    QTest.keyClick(bar.band, Qt.Key.Key_Return)
    assert "rubbish" in window.notice.text
    bar.band.setText("")
    assert session.wanted.all()
    bar.lasso.click()
    map_view = window.browser.map
    corners = [(-0.9, -0.9), (0.0, -0.9), (0.0, 0.9), (-0.9, 0.9)]
    drag(map_view, *[pixel(map_view, corner) for corner in corners], modifier=NO_KEY)
    assert (session.chosen.places[:, 0] <= 0.01).all()
    assert bar.lasso.isChecked()
    bar.lasso.click()
    assert session.wanted.all()


@pytest.mark.parametrize(
    ("text", "band"),
    [
        ("", None),
        ("90 to 120", (90.0, 120.0)),
        ("-5, 3.5", (-5.0, 3.5)),
        ("90-120", (90.0, 120.0)),
        ("-5--3", (-5.0, -3.0)),
        ("120 – 90", (90.0, 120.0)),
        ("1e3", (1000.0, 1000.0)),
    ],
)
def test_bands_are_read(text: str, band: tuple[float, float] | None) -> None:
    assert parsed_band(text) == band


def test_places_are_named_played_and_kept(qtbot: QtBot, window: MainWindow, tmp_path: Path) -> None:
    work, latent = window.workspace.latent, window.latent_state
    with pytest.raises(LatentError, match="two places"):
        work.path.play()
    for place in ((-0.5, 0.1), (0.5, 0.4)):
        tf, _ = work.session.tf_at(place)
        latent.name_place(place, tf)
    assert [named.name for named in latent.places] == ["Place 1", "Place 2"]
    frames: list[object] = []
    work.path.frameDrawn.connect(frames.append)
    window.browser.bar.playRequested.emit()
    assert window.browser.cancel.isVisible()
    qtbot.waitUntil(lambda: frames[-1:] == [None], timeout=60_000)
    assert len(frames) == 50
    assert not window.browser.preview.is_shown
    # A busy machine takes long to write a movie.
    with qtbot.waitSignal(
        work.path.ended, check_params_cb=lambda text: "Saved" in text, timeout=60_000
    ):
        work.path.play(MovieOrder(tmp_path / "path.gif", 96, 7, 10.0))
    movie = iio.imread(tmp_path / "path.gif", index=None)
    # The path's engine draws squares, and the TF is below.
    assert movie.shape[:1] + movie.shape[2:] == (7, 96, 3) and movie.shape[1] > 96
    assert iio.immeta(tmp_path / "path.gif")["duration"] == 100
    window.browser.bar.renameRequested.emit(0)
    dialog = window.findChild(QInputDialog)
    assert dialog is not None
    dialog.setTextValue("ribs")
    dialog.accept()
    latent.forget_place(1)
    assert [named.name for named in latent.places] == ["ribs"]


def test_the_tf_of_a_paths_picture_can_be_taken(qtbot: QtBot, window: MainWindow) -> None:
    browser, work = window.browser, window.workspace.latent
    for place in ((-0.5, 0.1), (0.5, 0.4)):
        tf, _ = work.session.tf_at(place)
        window.latent_state.name_place(place, tf)
    assert not browser.keep.isVisible()
    frames: list[Frame] = []
    work.path.frameDrawn.connect(lambda frame: frames.append(frame) if frame else None)
    browser.bar.playRequested.emit()
    qtbot.waitUntil(lambda: len(frames) > 10)
    assert browser.keep.isVisible()
    shown = frames[-1]
    browser.keep.click()
    assert not work.path.is_running and not browser.keep.isVisible()
    assert window.state.edits.stack.undoText() == "TF of the path"
    assert tf_difference(window.state.transfer_function.opacity, shown.tf) < 0.05


def test_a_path_is_cancelled(qtbot: QtBot, window: MainWindow) -> None:
    work = window.workspace.latent
    tf, _ = work.session.tf_at((0.5, 0.4))
    window.latent_state.name_place((0.5, 0.4), tf)
    window.browser.bar.playRequested.emit()
    assert work.path.is_running
    # Wherever the focus is.
    window.top_bar.browse.setFocus()
    QTest.keyClick(window.top_bar.browse, Qt.Key.Key_Escape)
    assert not work.path.is_running


def test_a_search_previews_and_can_be_undone(qtbot: QtBot, window: MainWindow) -> None:
    before = window.state.transfer_function
    search = window.workspace.latent.search
    steps: list[object] = []
    search.stepped.connect(steps.append)
    with qtbot.waitSignal(search.ended, timeout=20_000):
        window.browser.search.seek("more")
    assert steps
    assert window.state.transfer_function != before
    assert window.state.edits.stack.undoText() == "TF found by search"
    window.state.edits.undo()
    assert window.state.transfer_function == before


def test_an_edit_ends_a_search(qtbot: QtBot, window: MainWindow) -> None:
    search = window.workspace.latent.search
    window.browser.search.seek("less")
    assert search.is_running
    window.state.tf_input.set(make_tf(111.0), "edit")
    assert not search.is_running
    assert window.state.transfer_function == make_tf(111.0)


def test_the_map_is_computed_shown_and_kept(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders, tmp_path: Path
) -> None:
    builders.map_folder = tmp_path
    window = make_window()
    window.browse.click()
    session = window.workspace.latent.session
    qtbot.waitUntil(lambda: session.map is not None)
    assert session.map is not None
    assert not session.map.is_final
    assert window.browser.cancel.isVisible()
    tf, _ = session.tf_at((0.3, 0.3))
    window.latent_state.name_place((0.3, 0.3), tf, "kept")
    qtbot.waitUntil(lambda: session.map is not None and session.map.is_final, timeout=30_000)
    assert not window.browser.cancel.isVisible()
    assert [named.name for named in window.latent_state.places] == ["kept"]
    assert toy_space(tmp_path, (100.0, 200.0), (112.0, 188.0)).open_map().is_final


def test_the_map_is_cancelled_or_the_window_closed_meanwhile(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    builders.map_folder = tmp_path
    started = []
    popen = subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda *args, **kw: started.append(popen(*args, **kw)) or started[-1]
    )
    for close in (False, True):
        window = make_window()
        window.browse.click()
        session = window.workspace.latent.session
        qtbot.waitUntil(lambda s=session: s.is_embedding)  # type: ignore[misc]
        if close:
            window.close()
        else:
            window.browser.cancel.click()
            assert not session.is_embedding
            assert session.map is not None
            window.close()
    assert all(process.poll() is not None for process in started)
    assert not list(tmp_path.iterdir())


def test_a_space_that_cannot_be_opened_is_explained(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    builders.space_error = LatentError("The codec has collapsed.")
    window = make_window()
    window.browse.click()
    session = window.workspace.latent.session
    with qtbot.waitSignal(session.problem, check_params_cb=lambda text: "collapsed" in text):
        session.reset()
    assert session.map is None


def test_a_map_that_fails_leaves_the_principal_components(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    builders.map_folder = tmp_path

    def fail(_self: EmbeddingProcess, _progress: object) -> None:
        raise LatentError("The map cannot be computed.")

    monkeypatch.setattr(EmbeddingProcess, "run", fail)
    window = make_window()
    window.browse.click()
    qtbot.waitUntil(lambda: "cannot be computed" in window.notice.text)
    assert window.workspace.latent.session.map is not None


def test_another_volume_has_its_own_map(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    session = window.workspace.latent.session
    tf, _ = session.tf_at((0.3, 0.3))
    window.latent_state.name_place((0.3, 0.3), tf)
    builders.volumes["other"] = make_volume("other", 300.0)
    with qtbot.waitSignal(session.mapOpened):
        window.workspace.reading.open(Path("other"))
    assert session.space is not None
    assert session.space.frame.scalar_range == (100.0, 300.0)
    assert window.latent_state.places == ()


def test_the_model_draws_and_is_compared(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    pictures = window.workspace.latent.pictures
    assert pictures.drawer.source == "exact"
    assert window.browser.bar.engine.isEnabled()
    assert window.browser.bar.codec.menuAction().isVisible()
    window.latent_state.choose(engine="learned")
    qtbot.waitUntil(lambda: pictures.grid is not None and pictures.grid.source == "learned")
    assert any(r.channel == "grid" for r in builders.generators[-1].others)
    window.latent_state.choose(coloring="error")
    errors = window.workspace.latent.errors
    qtbot.waitUntil(lambda: errors.errors is not None)
    # Both fakes draw the same.
    assert errors.errors is not None
    assert np.nanmax(errors.errors) == 0.0
    window.latent_state.choose(codec="model")
    qtbot.waitUntil(lambda: builders.spaces[-1] == Path("model"))


@pytest.mark.parametrize("coloring", ["value", "opacity", "modes", "distance", "error"])
def test_every_colouring_has_a_legend(window: MainWindow, coloring: str) -> None:
    window.latent_state.choose(coloring=coloring)
    before = window.browser.map.grab().toImage()
    assert before.width() > 100
    shades = window.browser.map._shades
    assert shades is not None
    assert shades.legend.title
    assert len(np.unique(shades.colors, axis=0)) > (1 if coloring in ("error", "modes") else 5) - 1


def test_a_search_does_not_reach_into_another_volume(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    builders.volumes["other"] = make_volume("other", 300.0)
    search = window.workspace.latent.search
    with qtbot.waitSignal(search.stepped):
        window.browser.search.seek("more")
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.reading.open(Path("other"))
    assert not search.is_running
    # Its own first TF, with nothing to undo.
    assert window.state.scalar_range == (100.0, 300.0)
    assert window.state.edits.stack.count() == 0


def test_places_of_another_volume_cannot_be_taken(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders
) -> None:
    tf, _ = window.workspace.latent.session.tf_at((0.3, 0.3))
    builders.volumes["other"] = make_volume("other", 300.0)
    builders.space_error = LatentError("There is no codec.")
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.reading.open(Path("other"))
    before = window.state.transfer_function
    window.browser.taking.take(tf, "old")
    window.browser.naming.name((0.3, 0.3), tf, None, "old")
    assert window.state.transfer_function == before
    assert window.latent_state.places == ()


def test_a_drag_of_the_user_ends_a_search_and_is_one_step(qtbot: QtBot, window: MainWindow) -> None:
    before = window.state.transfer_function
    search = window.workspace.latent.search
    dragged: list[object] = []

    def drag_once(step: object) -> None:
        if not dragged:
            dragged.append(step)
            window.state.tf_input.move(make_tf(120.0))

    search.stepped.connect(drag_once)
    with qtbot.waitSignal(search.ended):
        window.browser.search.seek("more")
    window.state.tf_input.move(make_tf(125.0))
    window.state.tf_input.finish("move mode")
    assert not search.is_running
    assert window.state.edits.stack.count() == 1
    assert window.state.edits.stack.undoText() == "move mode"
    window.state.edits.undo()
    assert window.state.transfer_function == before


def test_another_button_does_not_interrupt_a_drag(qtbot: QtBot, window: MainWindow) -> None:
    map_view, latent = window.browser.map, window.latent_state
    latent.set_brush((-0.4, -0.4, 0.4, 0.4))
    QTest.mousePress(map_view, Qt.MouseButton.LeftButton, NO_KEY, pixel(map_view, (0, 0)))
    QTest.mouseMove(map_view, pixel(map_view, (0.1, 0.1)))
    QTest.mousePress(map_view, Qt.MouseButton.RightButton, NO_KEY, pixel(map_view, (0.1, 0.1)))
    QTest.mouseRelease(map_view, Qt.MouseButton.RightButton, NO_KEY, pixel(map_view, (0.1, 0.1)))
    assert latent.dragging
    QTest.mouseRelease(map_view, Qt.MouseButton.LeftButton, NO_KEY, pixel(map_view, (0.1, 0.1)))
    assert not latent.dragging
    assert latent.brush == pytest.approx((-0.3, -0.3, 0.5, 0.5), abs=0.02)


def test_the_overview_is_that_of_the_present_view(qtbot: QtBot, window: MainWindow) -> None:
    session = window.workspace.latent.session
    first = window.state.view
    overview = session.overview
    window.state.set_view(View(80, 30, 0, 1))
    window.state.set_view(first)
    qtbot.waitUntil(lambda: not session._looking.is_running)
    assert session.overview is overview
    assert session.overview_view == first


def test_a_grid_that_failed_is_asked_for_again(
    qtbot: QtBot, window: MainWindow, builders: FakeBuilders, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = builders.analysts[-1]
    images = engine.images

    def fail(*_: object) -> np.ndarray:
        raise LatentError("No pictures today.")

    monkeypatch.setattr(engine, "images", fail)
    pictures = window.workspace.latent.pictures
    with qtbot.waitSignal(pictures.problem):
        window.latent_state.set_brush((-0.5, -0.5, 0.5, 0.5))
    monkeypatch.setattr(engine, "images", images)
    with qtbot.waitSignal(pictures.gridDrawn):
        pictures.ask()


def test_map_and_grid_are_used_by_keys(qtbot: QtBot, window: MainWindow) -> None:
    map_view, grid, latent = window.browser.map, window.browser.grid, window.latent_state
    before = window.state.transfer_function
    QTest.keyClick(map_view, Qt.Key.Key_Right)
    first = latent.hover
    assert first is not None
    QTest.keyClick(map_view, Qt.Key.Key_Right)
    QTest.keyClick(map_view, Qt.Key.Key_Up)
    assert latent.hover is not None
    assert latent.hover[0] > first[0] and latent.hover[1] > first[1]
    QTest.keyClick(map_view, Qt.Key.Key_Return)
    assert window.state.transfer_function != before
    zoom = map_view.frame.zoom
    QTest.keyClick(map_view, Qt.Key.Key_Plus)
    assert map_view.frame.zoom > zoom
    QTest.keyClick(map_view, Qt.Key.Key_Minus)
    assert map_view.frame.zoom == pytest.approx(zoom)
    seen: list[int | None] = []
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
    assert latent.brush == pytest.approx(brush)


def test_escape_closes_the_browser_where_nothing_runs(window: MainWindow) -> None:
    QTest.keyClick(window.browser.map, Qt.Key.Key_Escape)
    assert not window.browser.isVisible() and window.generator.isVisible()
    widths = [pane.canvas.width() for pane in (window.generator, window.reference)]
    assert abs(widths[0] - widths[1]) <= 1


def test_the_caption_names_the_picture_under_the_mouse(qtbot: QtBot, window: MainWindow) -> None:
    caption = window.reference.caption
    before = caption.title, caption.detail
    move(qtbot, window.browser.map, (0.2, 0.1))
    qtbot.waitUntil(lambda: window.browser.preview.is_shown)
    assert (caption.title, caption.detail) == ("Under the mouse", "click to take")
    assert "samples" in caption.toolTip()
    window.latent_state.set_hover(None)
    qtbot.waitUntil(lambda: not window.browser.preview.is_shown)
    assert (caption.title, caption.detail) == before
    assert window.reference.title == "Ground truth"


def test_the_picture_under_the_mouse_stays_while_the_image_is_drawn_anew(
    qtbot: QtBot, window: MainWindow
) -> None:
    move(qtbot, window.browser.map, (-0.3, -0.2))
    qtbot.waitUntil(lambda: window.browser.preview.is_shown)
    assert window.reference.canvas.cover is not None
    window.workspace.reference.choose(size=64)
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert window.browser.preview.is_shown
    assert window.reference.canvas.cover is not None


def test_who_turns_the_wheel_over_the_map_has_its_keys(qtbot: QtBot, window: MainWindow) -> None:
    map_view = window.browser.map
    window.activateWindow()
    window.reference.canvas.setFocus()
    handle = window.windowHandle()
    at = map_view.mapTo(window, QPointF(map_view.rect().center()))
    QTest.wheelEvent(handle, at, QPoint(0, 240))
    qtbot.waitUntil(lambda: map_view.frame.zoom > 1)
    assert map_view.hasFocus()
    QTest.keyClick(window.focusWidget(), Qt.Key.Key_Home)
    assert map_view.frame.zoom == 1
