"""Slices in the window, by mouse and keys; and what they and the images tell each other."""

from dataclasses import replace

import numpy as np
import pytest
from mouse_events import drag, wheel
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QCursor, QEnterEvent, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from ramp import make_tf, make_volume
from rested_window import open_volume, press, rested, settle

from model.rendering.ray_places import ray_places, values_at
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.mask import Mask
from model.scene.slices import place_at, voxel_of
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.scene.view import Projection
from model.scene.volume import FileFacts, Label, Volume

HUGE = np.float64(1e250)
ENTER = QEnterEvent(QPointF(), QPointF(), QPointF())
CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def window(qtbot, make_window):
    """A window with slices of 4 by 5 by 6 voxels."""
    window = rested(qtbot, make_window)
    press(qtbot, window, Qt.Key.Key_S)
    qtbot.waitUntil(lambda: all(view.isVisible() for view in views(window)))
    return window


def views(window):
    return window.slices.column.views


def state(window):
    return window.slices.state


def voxel(window):
    return voxel_of(state(window).volume, state(window).place)


def readout(window):
    column = window.slices.column
    return f"{column.value.full_text}\n{column.where.full_text}"


def at(window, view, x, y, z):
    """Where a voxel's center is in a slice."""
    return view.position_of(place_at(state(window).volume, (x, y, z))).toPoint()


def pixel(view, point):
    return view.viewport().grab().toImage().pixelColor(point).getRgb()[:3]


def test_nothing_is_built_until_slices_are_shown_and_the_key_hides_them(qtbot, make_window):
    window = rested(qtbot, make_window)
    assert window.slices.column is None
    press(qtbot, window, Qt.Key.Key_S)
    assert window.slices.is_shown and window.preferences.settings.slices
    assert window.slices.areas[0] in window.areas()
    press(qtbot, window, Qt.Key.Key_S)
    assert not window.slices.is_shown and not window.preferences.settings.slices


def test_slices_have_the_voxels_gray_levels(window):
    for view in views(window):
        for wanted in ((0, 0, 5), (3, 4, 0), (2, 1, 3)):
            state(window).move(place_at(state(window).volume, wanted))
            low, high = state(window).window
            # Where the cross-hair has its gap.
            value = make_volume().voxels[wanted[2], wanted[1], wanted[0]]
            level = 255 * np.clip((value - low) / (high - low), 0, 1)
            assert pixel(view, at(window, view, *wanted)) == pytest.approx((level,) * 3, abs=4)


def test_the_wheel_and_keys_scroll_and_end_at_the_last_slice(window):
    level, front, _ = views(window)
    before = voxel(window)
    wheel(level.viewport(), QPointF(60, 60), 1)
    assert voxel(window) == (before[0], before[1], before[2] + 1)
    wheel(level.viewport(), QPointF(60, 60), -1, keys=SHIFT)
    assert voxel(window)[2] == 0
    for _ in range(4):
        wheel(front.viewport(), QPointF(60, 60), 0.5)
    assert voxel(window) == (before[0], 4, 0)
    QTest.keyClick(front, Qt.Key.Key_PageDown)
    assert voxel(window)[1] == 3
    level.number.selectAll()
    QTest.keyClicks(level.number, "4")
    QTest.keyClick(level.number, Qt.Key.Key_Return)
    # Slices are numbered from 1.
    assert voxel(window) == (before[0], 3, 3) and level.number.text() == "z 4 of 6"


def test_a_drag_moves_the_cross_hair_of_all_slices_and_what_they_show_is_remembered(
    qtbot, builders, window
):
    front = views(window)[1]
    drag(front.viewport(), at(window, front, 0, 2, 0), at(window, front, 3, 2, 5))
    assert voxel(window)[::2] == (3, 5)
    assert [view.number.value() for view in views(window)] == [6, voxel(window)[1] + 1, 4]
    assert window.sessions.session().content.memory.cross_hair == state(window).place
    assert window.sessions.session().content.settings.slices
    levels, right = state(window).window, Qt.MouseButton.RightButton
    drag(front.viewport(), QPoint(60, 60), QPoint(62, 61), button=right)
    assert state(window).window == levels
    assert QApplication.activePopupWidget() is window.slices.column.button.menu()
    window.slices.column.button.menu().close()
    drag(front.viewport(), QPoint(60, 60), QPoint(90, 50), button=right)
    assert state(window).window != levels and QApplication.activePopupWidget() is None
    window.slices.column.choices["overlay"].trigger()
    # The next time step keeps it; another volume of the same range has its own.
    chosen = state(window).window
    voxels = make_volume().voxels
    builders.volumes["ramp 2"] = Volume(voxels[::-1], name="ramp 2")
    builders.volumes["other"] = Volume(voxels[:, ::-1], name="other")
    for name, shown in (("ramp 2", chosen), ("other", levels), ("ramp", chosen)):
        open_volume(qtbot, window, name)
        assert state(window).window == pytest.approx(shown)
    # Over another range, the window is another one, too.
    window.workspace.opening.show_over((110.0, 140.0), "linear")
    qtbot.waitUntil(lambda: state(window).window != chosen)
    wanted = voxel(window), state(window).colors, pytest.approx(state(window).window)
    builders.volumes["other"] = Volume(make_volume().voxels[:, :3])
    open_volume(qtbot, window, "other")
    open_volume(qtbot, window, "ramp")
    assert window.slices.is_shown
    assert (voxel(window), state(window).colors, state(window).window) == wanted


def test_a_double_click_makes_one_large_and_leaves_the_cross_hair(window):
    (level, front, _), column = views(window), window.slices.column
    drag(column.parent().handle(1), QPoint(0, 40), QPoint(-50, 40))
    before, small = voxel(window), column.width()
    to = {level: (0, 2, 3), front: (0, 2, 5)}
    for view, is_large in ((level, True), (level, False), (front, True), (front, False)):
        point = at(window, view, *to[view])
        QApplication.sendEvent(view, ENTER)
        QTest.mouseClick(view.viewport(), Qt.MouseButton.LeftButton, pos=point)
        assert voxel(window) != before
        QCursor.setPos(view.viewport().mapToGlobal(point))
        QTest.mouseDClick(view.viewport(), Qt.MouseButton.LeftButton, pos=point)
        assert voxel(window) == before
        assert {each.isVisible() for each in views(window) if each is not view} == {not is_large}
        assert (column.width() > small) == is_large
        large = window.context.preferences.settings.large_slice
        assert large == (views(window).index(view) if is_large else None)
        QTest.qWait(0)
        if is_large:
            place = view.place_under(QPointF(view.mapFromGlobal(QCursor.pos())))
            under = voxel_of(state(window).volume, place or state(window).place)
            assert f"voxel {', '.join(str(each + 1) for each in under)}" in readout(window)
        assert (view.width() == column.width() and view.height() > column.height() / 2) == is_large
    assert column.width() == small  # as the user has made it
    # As a session may have it.
    window.context.preferences.set(large_slice=1)
    window.slices.start_volume(window.workspace.opened)
    assert front.isVisible() and not level.isVisible() and column.width() > small
    # All are as wide again, even if the column keeps its width.
    column.enlarge(None)
    QTest.qWait(0)
    assert np.ptp([view.width() for view in views(window)]) <= 2


def test_a_wide_column_has_slices_next_to_each_other(monkeypatch, window):
    column, (level, front, side) = window.slices.column, views(window)
    for width in (600, 300):
        column.setFixedSize(width, 600)
        QTest.qWait(0)
        assert (level.x() < front.x() == side.x()) == (width == 600)
        assert front.y() < side.y() and (level.height() > 300) == (width == 600)
    # There is room for their numbers in any case.
    level.number.setFixedWidth(310)
    column.setFixedSize(600, 601)
    QTest.qWait(0)
    assert level.x() == front.x()
    # The letter at the top is right of the box then.
    level.number.setFixedWidth(level.width() * 2 // 3)
    plane, right = level.plane, level.viewport().rect()
    right.setLeft(level.number.geometry().right() + 1)
    lettered = level.viewport().grab(right).toImage()
    monkeypatch.setattr(type(level), "plane", replace(plane, edges=(*plane.edges[:3], "")))
    assert plane.edges[3] and level.viewport().grab(right).toImage() != lettered


def test_zoom_pan_and_window_of_gray_by_the_mouse(qtbot, window):
    view = views(window)[0]
    point, whole = at(window, view, 1, 1, 0), at(window, view, 3, 4, 0) - at(window, view, 0, 0, 0)
    wheel(view.viewport(), QPointF(point), 3, keys=CONTROL)
    grown = at(window, view, 3, 4, 0) - at(window, view, 0, 0, 0)
    assert (at(window, view, 1, 1, 0) - point).manhattanLength() <= 2
    assert grown.y() == pytest.approx(1.15**3 * whole.y(), abs=2)
    before = at(window, view, 2, 2, 0)
    drag(view.viewport(), point, point + QPoint(7, -5), button=Qt.MouseButton.MiddleButton)
    assert (at(window, view, 2, 2, 0) - before - QPoint(7, -5)).manhattanLength() <= 2
    window.state.set_view(replace(window.state.view, distance=0.5))
    seen = window.state.view
    # The key means what is under the mouse.
    for event, changes in ((ENTER, False), (QEvent(QEvent.Type.Leave), True)):
        QApplication.sendEvent(view, event)
        press(qtbot, window, Qt.Key.Key_F)
        shown = at(window, view, 3, 4, 0) - at(window, view, 0, 0, 0)
        assert (shown - whole).manhattanLength() <= 2
        assert (window.state.view != seen) == changes
    # As large as at first.
    assert window.state.view.distance == pytest.approx(window.state.home.distance)
    # What a plane leaves is as large as if a crop box left it.
    lower, found = CropBox(high=(1.0, 1.0, 0.5)), []
    clip, crop = window.state.clip_input, window.state.crop_input
    for cut, value in ((crop, lower), (clip, ClipPlane((0.0, 0.0, 1.0), 0.0))):
        cut.set(value)
        press(qtbot, window, Qt.Key.Key_F)
        found.append(window.state.view)
        cut.set(None)
    assert found[0].distance == pytest.approx(found[1].distance) != seen.distance
    # A right drag changes the window of gray.
    low, high = state(window).window
    drag(view.viewport(), point, point + QPoint(20, 0), button=Qt.MouseButton.RightButton)
    wider = state(window).window
    assert wider[1] - wider[0] > high - low
    assert f"window {wider[1] - wider[0]:.3g}  level {sum(wider) / 2:.3g}" in readout(window)
    drag(view.viewport(), point, point + QPoint(0, 20), button=Qt.MouseButton.RightButton)
    assert sum(state(window).window) < sum(wider)
    # Radiologists' windows are those of a CT, and are gray.
    lung, *_ = ct = window.slices.column._ct
    assert not any(each.isVisible() for each in ct)
    state(window).show(volume=replace(make_volume(), units="HU"), colors="colors")
    assert all(each.isVisible() for each in ct)
    lung.trigger()
    assert (state(window).window, state(window).colors) == ((-1350, 150), "gray")
    assert readout(window).endswith("window 1500  level -600")
    assert window.slices.column.button.toolTip() == "window 1500  level -600"
    assert [each.isChecked() for each in ct] == [True, False, False, False]


def test_the_ruler_measures_in_a_slice_and_its_line_is_in_that_slice_alone(qtbot, window):
    view, before, volume = views(window)[1], voxel(window), state(window).volume
    ends = (0, before[1], 1), (3, before[1], 5)
    plain = view.viewport().grab().toImage()
    press(qtbot, window, Qt.Key.Key_M)
    drag(view.viewport(), *(at(window, view, *end) for end in ends))
    assert voxel(window) == before and window.status.news.startswith("Distance: ")
    line = np.array(window.overlays.subject.line) * volume.extent
    length = np.linalg.norm(line[1] - line[0])
    wanted = np.linalg.norm(np.subtract(*ends) * volume.spacing)
    assert f"{length:.4g}" in window.status.news and length == pytest.approx(wanted, rel=0.03)
    assert view.viewport().grab().toImage() != plain
    wheel(view.viewport(), QPointF(60, 60), 1)
    shown = view.viewport().grab().toImage()
    press(qtbot, window, Qt.Key.Key_Escape)
    assert view.viewport().grab().toImage() == shown and not window.overlays.subject.line


def test_voxels_that_images_do_not_show_are_faded(window):
    state(window).move(place_at(state(window).volume, (3, 2, 5)))
    level, cut, shown = views(window)[0], (0, 3, 5), (3, 4, 5)
    colors = [pixel(level, at(window, level, *each)) for each in (cut, shown)]
    hidden = np.zeros(make_volume().voxels.shape, bool)
    hidden[:, :, :2] = True
    for edited, value in (
        (window.state.mask_input, Mask.of(~hidden)),
        (window.state.clip_input, ClipPlane((-1, 0, 0))),
    ):
        edited.set(value)
        faint = [part / 3 for part in colors[0]]
        assert pixel(level, at(window, level, *cut)) == pytest.approx(faint, abs=2)
        assert pixel(level, at(window, level, *shown)) == colors[1]
        edited.set(None)
        assert pixel(level, at(window, level, *cut)) == colors[0]


def test_slices_follow_the_pane_that_is_edited(qtbot, window):
    window.sensitivity_state.choose(shown=False)  # the fakes show the same values for all TFs
    """Its TF has their colours, and a click in its image goes to what shows there."""
    view, here, tf_input = views(window)[0], (2, 1, 3), window.state.tf_input
    value = float(make_volume().voxels[here[2], here[1], here[0]])
    lo, hi = make_tf().scalar_range
    tf_a, tf_b = (
        TransferFunction(
            OpacityTF(
                (lo, hi), points=((lo, 0.0), (lo + (hi - lo) / wide, opacity), (hi, opacity))
            ),
            ColorTF((lo, hi), ((lo, *rgb), (hi, *rgb))),
        )
        for wide, opacity, rgb in ((5, 1.0, (1.0, 0.0, 0.0)), (1.1, 0.05, (0.0, 1.0, 0.0)))
    )
    window.state.look_from("Top")
    tf_input.set(tf_a)
    tf_input.compare(True)
    tf_input.set(tf_b)
    qtbot.waitUntil(lambda: window.pane_b.canvas.isVisible() and window.workspace.is_settled)
    window.slices.column.choices["colors"].trigger()
    assert window.slices.column.button.title == "TF"
    found = []
    for pane, tf in ((window.reference, tf_a), (window.pane_b, tf_b)):
        canvas = pane.canvas
        point = canvas.image_rect.center() + QPoint(3 * len(found), 0)
        # The first click gives the focus.
        for _ in range(2):
            QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=point)
            assert window.state.transfer_function == tf
        x, y = window.sensitivity_state.place
        inputs = window.state.inputs_of("A" if pane is window.reference else "B")
        places = ray_places(state(window).volume, inputs, (2 * x - 1, 1 - 2 * y))
        found.append(voxel(window))
        assert found[-1] == voxel_of(state(window).volume, places[0][0])
        state(window).move(place_at(state(window).volume, here))
        assert pixel(view, at(window, view, *here)) == pytest.approx(255 * tf.color(value), abs=4)
    assert found[0] != found[1]


@pytest.mark.parametrize("guided", [True, False])
def test_a_click_in_an_image_goes_to_what_shows_most_there_and_keys_go_on(qtbot, window, guided):
    window.sensitivity_state.choose(shown=guided)
    window.state.tf_input.set(make_tf())
    window.state.look_from("Top")
    canvas = window.reference.canvas
    point = canvas.image_rect.center()
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=point)
    x, y = window.sensitivity_state.place
    volume, inputs = state(window).volume, window.state.inputs
    places = ray_places(volume, inputs, (2 * x - 1, 1 - 2 * y))
    assert len(places) > 1
    qtbot.waitUntil(lambda: "Place " in window.status.news)
    if guided:
        # Of the values that the label names first.
        low, high = window.workspace.sensitivity.listed[0].reach
        (value,) = values_at(volume, np.array([state(window).place]))
        assert low <= value <= high
        for _ in places:
            QTest.keyClick(canvas, Qt.Key.Key_Up)
    for step, (place, _share) in enumerate(places):
        assert voxel(window) == voxel_of(volume, place)
        assert f"Place {step + 1} of {len(places)}" in window.status.news
        QTest.keyClick(canvas, Qt.Key.Key_Down)
    assert window.state.view == inputs.view
    QTest.keyClick(canvas, Qt.Key.Key_Up)
    assert voxel(window) == voxel_of(volume, places[-2][0])
    # The cross-hair in the image is where the rendering has its place.
    projection = Projection(window.state.view, volume.proportions)
    (right, up), rect = projection.places(np.array([state(window).place]))[0], canvas.image_rect
    half = rect.width() / 2
    arm = QPoint(round(rect.left() + half * (1 + right)) + 8, round(rect.top() + half * (1 - up)))
    shown = canvas.grab().toImage().pixelColor(arm)
    window.slices.areas[0].setFocus()
    window.slices.toggle()
    # No control of the bar gets their keys.
    assert QApplication.focusWidget() is window
    assert canvas.grab().toImage().pixelColor(arm) != shown
    window.slices.toggle()
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=rect.topLeft() + QPoint(20, 2))
    qtbot.waitUntil(lambda: "Nothing shows there" in window.status.news)
    # A double click returns to the first view; its first click does not count.
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=point)
    qtbot.waitUntil(lambda: "Place " in window.status.news)
    pieces = window.workspace.pieces
    assert voxel(window) == voxel_of(volume, pieces.point)
    QTest.mouseDClick(canvas, Qt.MouseButton.LeftButton, pos=point)
    settle(qtbot, window)
    assert voxel(window) == voxel_of(volume, places[-2][0])
    # Wherever most shows, if last.
    window.sensitivity_state.pick((x + 0.01, y))
    pieces.point = places[-1][0]
    pieces.located.emit()
    assert voxel(window) == voxel_of(volume, places[-1][0])


def test_a_resting_mouse_marks_the_value_and_shows_where_it_is_visible(qtbot, window):
    view, asked = views(window)[0], window.sensitivity_state
    z = voxel(window)[2]
    QTest.mouseMove(view.viewport(), at(window, view, 1, 3, z))
    value = float(make_volume().voxels[z, 3, 1])
    mark = window.slices._mark
    assert mark.isVisible()
    assert mark.value() == pytest.approx(window.editor.area.axis.place(value))
    qtbot.waitUntil(lambda: asked.band is not None and asked.band.low == pytest.approx(value))
    assert not asked.band.effect and state(window).band is None
    assert readout(window) == f"{value:.5g} K\nvoxel 2, 4, {z + 1}"
    # A value beyond the range is marked at its end, whose field would be that of others, too.
    volume = state(window).volume
    state(window).volume = volume.over((value + 1, value + 9))
    QTest.mouseMove(view.viewport(), at(window, view, 1, 2, z))
    QTest.mouseMove(view.viewport(), at(window, view, 1, 3, z))
    assert mark.isVisible() and not window.slices._rest.isActive()
    state(window).volume = volume
    QTest.mouseMove(view.viewport(), at(window, view, 2, 1, z))
    assert asked.band is None
    qtbot.waitUntil(lambda: asked.band is not None)
    QTest.keyClick(window, Qt.Key.Key_P)
    QTest.mouseMove(view.viewport(), QPoint(1, 60))
    assert asked.band.kept and not mark.isVisible()
    # A band is outlined.
    x, y = 2, 1
    outlined = view.viewport().grab().toImage()
    asked.release()
    plain = view.viewport().grab().toImage()
    assert state(window).band is None and plain != outlined
    asked.hover(float(make_volume().voxels[z, y, x]))
    assert view.viewport().grab().toImage() != plain


def test_the_crop_box_is_dragged_in_a_slice_as_one_edit(qtbot, window):
    window.crop_card.set_shown(True)
    view = views(window)[0]
    handles = [h.scenePos() for h in view._rectangle.getHandles() if h.isVisible()]
    # In the middle of the right edge.
    start = view.mapFromScene(sorted(handles, key=lambda at: (round(at.x()), at.y()))[-2])
    end = at(window, view, 2, 2, 0)
    QTest.mouseMove(view.viewport(), start)
    drag(view.viewport(), start, start - QPoint(6, 0), QPoint(end.x(), start.y()))
    crop = window.state.crop
    assert crop is not None and crop.high[0] == pytest.approx(2 / 3, abs=0.08)
    assert crop.low == (0, 0, 0) and crop.high[1:] == (1, 1)
    window.state.edits.undo()
    assert window.state.crop is None


def with_missing():
    volume = make_volume()
    missing = np.zeros(volume.voxels.shape, bool)
    missing[:, 2, 1] = True
    return replace(volume, missing=missing)


def labels():
    voxels = np.zeros((5, 5, 5), np.uint8)
    voxels[1:4, 1:4, 2] = 3
    facts = FileFacts(is_labels=True, labels=(Label(3, "liver", (0.0, 1.0, 0.0)),))
    return Volume(voxels, (1.0, 1.0, 7.0), file=facts, name="labels")


OTHERS = [
    (with_missing(), (1, 2, 3), "nothing measured"),
    (Volume(make_volume().voxels, (1e-9, 2e-9, 3e-9)), (1, 1, 1), "x 1e-09  y 2e-09  z 3e-09"),
    (Volume(make_volume().voxels, (0.01,) * 3, (1e3,) * 3), (1, 1, 2), "x 1000.01  y 1000.01"),
    (Volume(make_volume().voxels[2:4] * HUGE, (20.0, 1, 1)), (3, 0, 1), "x 60  y 0  z 1"),
    (labels(), (2, 2, 2), "value 3  liver  voxel 3, 3, 3\nx 2  y 2  z 14"),
]  # fmt: skip


def test_other_volumes_have_slices(qtbot, builders, window):
    for volume, here, said in OTHERS:
        builders.volumes[str(here)] = volume
        open_volume(qtbot, window, str(here))
        state(window).move(place_at(volume, here))
        assert said in readout(window)
        for view in views(window):
            point = at(window, view, *here)
            assert view.rect().contains(point)
            assert voxel_of(volume, view.place_under(QPointF(point))) == here
        level = views(window)[0]
        red, green, blue = pixel(level, at(window, level, *here) + QPoint(2, 2))
        # The hatch of missing voxels is bluish.
        is_gray = max(red, green, blue) - min(red, green, blue) < 8
        assert green > red + 100 if volume.file.is_labels else is_gray
        is_smooth = bool(level.renderHints() & QPainter.RenderHint.SmoothPixmapTransform)
        assert is_smooth != volume.file.is_labels
        if volume.missing is not None:
            window.workspace.opening.draw_missing(True)
            qtbot.waitUntil(lambda: state(window).volume.draws_missing)
            assert said not in readout(window)
