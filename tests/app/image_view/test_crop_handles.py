import math

import mouse_events
import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtTest import QTest

from app.image_view.crop_handles import MOVES, TURNS, CropHandles
from app.image_view.gestures import ViewGestures
from app.image_view.image_canvas import ImageCanvas, to_qimage
from app.image_view.orientation_cube import OrientationCube
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View, axis_direction
from model.scene.volume import Volume

LEFT, PLAIN = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
DIMENSIONS = (41, 21, 31)
BOX = CropBox((0.1, 0.2, 0.0), (0.8, 1.0, 0.6))
VIEW = View(35.0, 25.0, 10.0, 0.9, 0.15, -0.1)


def make_volume():
    """Values from 0 to 1 that tell the middles of all faces apart."""
    z, y, x = np.meshgrid(*(np.linspace(0, 1, n) for n in DIMENSIONS[::-1]), indexing="ij")
    return Volume(((x + 2 * y + 4 * z) / 7).astype(np.float32), spacing=(1.0, 2.5, 1.5))


@pytest.fixture
def canvas(qtbot, state):
    """A wide canvas with a wide image, whose square is not the canvas."""
    widget = ImageCanvas()
    widget.resize(500, 320)
    image = QImage(300, 200, QImage.Format.Format_RGB888)
    image.fill(QColor("black"))
    widget.show_image(image)
    ViewGestures(widget, state)
    qtbot.addWidget(widget)
    state.start_view(make_volume().proportions, view=VIEW)
    yield widget
    state.finish_view()
    state.crop_input.finish()
    state.clip_input.finish()


@pytest.fixture
def handles(state, canvas):
    handles = CropHandles(canvas, state)
    handles.set_volume(DIMENSIONS)
    handles.set_active(True)
    canvas.show()
    return handles


def pixel(handles, axis, side):
    """Middle of a handle that can be seen."""
    found = {each.kind: each for each in handles.handles}
    return handles.position(found[axis, side])


def drag(canvas, start, by):
    # Half the way first, as a hand does.
    mouse_events.drag(canvas, *((start + share * by).toPoint() for share in (0.0, 0.5, 1.0)))


def test_handles_are_where_the_middles_of_faces_are_drawn(state, canvas, handles):
    state.crop_input.set(BOX)
    opaque = OpacityTF((0.0, 1.0), points=((0.0, 1.0), (1.0, 1.0)))
    color = ColorTF((0.0, 1.0), ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0)))
    renderer = RaycastRenderer(make_volume(), threads=1, sample_distance=0.1)
    image = renderer.render(SceneInputs(VIEW, opaque, color, crop=BOX), Raster(500, 320))
    canvas.show_image(to_qimage(image))
    in_front = [handle for handle in handles.handles if not handle.is_behind]
    assert len(in_front) == 3
    assert len(handles.handles) == 6
    for handle in in_front:
        axis, side = handle.kind
        place = np.mean([BOX.low, BOX.high], axis=0)
        place[axis] = (BOX.low, BOX.high)[side][axis]
        x, y, z = place
        at = handles.position(handle).toPoint()
        assert image[at.y(), at.x(), 0] == pytest.approx((x + 2 * y + 4 * z) / 7, abs=0.02)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", range(2))
def test_a_plane_follows_the_mouse_to_where_it_would_be_drawn(state, canvas, handles, axis, side):
    target = CropBox().with_plane(axis, side, 0.75 if side else 0.25)
    start = pixel(handles, axis, side)
    state.crop_input.set(target)
    end = pixel(handles, axis, side)
    state.crop_input.set(None)
    # A handle is dragged by whole pixels.
    near = 1.5 / math.hypot(end.x() - start.x(), end.y() - start.y()) * 0.25
    drag(canvas, start, end - start)
    place = (state.crop.low, state.crop.high)[side][axis]
    assert place == pytest.approx(0.75 if side else 0.25, abs=near)
    # Nothing else moved.
    assert state.crop.with_plane(axis, side, float(side)).is_whole
    assert state.view == VIEW


def test_a_plane_stops_a_voxel_before_its_opposite(state, canvas, handles):
    assert handles._label((0, 0)) == "x: first voxel 1"
    start, end = pixel(handles, 0, 0), pixel(handles, 0, 1)
    drag(canvas, start, 2 * (end - start))
    assert state.crop.low[0] == pytest.approx(1 - 1 / 40)
    # And at the volume's own face.
    state.crop_input.set(BOX)
    start, other = pixel(handles, 0, 0), pixel(handles, 0, 1)
    drag(canvas, start, 2 * (start - other))
    assert state.crop.low[0] == 0.0


def test_beside_handles_and_when_inactive_the_mouse_turns_the_view(state, canvas, handles):
    at = pixel(handles, 0, 1)
    drag(canvas, at + QPointF(0, 40), QPointF(20, 0))
    assert state.view != VIEW
    state.set_view(VIEW)
    for keys in (Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier):
        mouse_events.drag(canvas, at.toPoint(), at.toPoint() + QPoint(15, 0), keys=keys)
        assert state.view != VIEW
        state.set_view(VIEW)
    handles.set_active(False)
    drag(canvas, at, QPointF(20, 0))
    assert state.view != VIEW
    assert state.crop is None


def test_leaving_while_dragging_ends_the_drag(qtbot, state, canvas, handles):
    start, end = pixel(handles, 2, 1), pixel(handles, 2, 0)
    for leave in (lambda: handles.set_active(False), canvas.hide):
        handles.set_active(True)
        canvas.show()
        state.crop_input.set(None)
        QTest.mousePress(canvas, LEFT, PLAIN, start.toPoint())
        QTest.mouseMove(canvas, ((start + end) / 2).toPoint())
        with qtbot.waitSignal(state.crop_input.changeFinished):
            leave()
        assert not state.live
        QTest.mouseRelease(canvas, LEFT)


PLANE = ClipPlane((0.8, -0.4, 0.7), 0.1)


@pytest.mark.parametrize("is_orthographic", [False, True])
def test_the_plane_is_moved_along_its_normal_and_turned(state, canvas, handles, is_orthographic):
    state.set_orthographic(is_orthographic)
    view = state.view
    through_middle = ClipPlane(PLANE.normal)
    for first, target, handle in (
        (PLANE, ClipPlane(PLANE.normal, 0.3), MOVES),
        (through_middle, ClipPlane((0.5, -0.9, 0.1)), TURNS),
    ):
        handles.set_volume(DIMENSIONS)
        ends = []
        for plane in (target, first):
            state.clip_input.set(plane)
            ends.append(pixel(handles, *handle))
        drag(canvas, ends[1], ends[0] - ends[1])
        assert state.clip.offset == pytest.approx(target.offset, abs=0.02)
        turned = math.acos(min(np.dot(state.clip.normal, target.normal), 1.0))
        assert turned < (0.07 if handle == TURNS else 1e-7)
        assert not state.live and state.view == view and state.crop is None
        state.edits.undo()
        assert state.clip == first


def test_a_plane_faces_the_viewer_and_is_flipped_where_it_is(state, handles):
    state.face_clip()
    back = state.view.basis()[2]
    np.testing.assert_allclose(state.clip.normal, back, atol=1e-9)
    # It cuts through the middle, and cannot be moved along the line of sight in the image.
    assert state.clip.depths(state.pivot, state.proportions) == pytest.approx(0, abs=1e-9)
    assert {each.kind for each in handles.handles if each.kind[0] == 3} == {TURNS}
    state.clip_input.set(PLANE)
    state.flip_clip()
    corners = np.random.default_rng(1).random((20, 3))
    kept, cut = (plane.depths(corners, state.proportions) for plane in (PLANE, state.clip))
    np.testing.assert_allclose(kept, -cut, atol=1e-12)
    state.crop_input.set(BOX)
    state.show_whole()
    assert (state.crop, state.clip) == (None, None)
    state.edits.undo()
    assert (state.crop, state.clip) == (BOX, PLANE.flipped)


def test_the_planes_outline_lies_in_it_and_on_the_boxs_faces(state):
    for box in (CropBox(), BOX):
        points = PLANE.outline(box, state.proportions)
        assert len(points) >= 3
        np.testing.assert_allclose(PLANE.depths(points, state.proportions), 0, atol=1e-12)
        on_face = np.isclose(points, box.low) | np.isclose(points, box.high)
        assert (on_face.sum(axis=1) >= 2).all()
        # In turn: no corner lies within the others.
        across = (points - points.mean(axis=0)) * state.proportions
        turns = np.cross(across, np.roll(across, -1, axis=0)) @ PLANE.normal
        assert (turns > 0).all() or (turns < 0).all()
    assert len(ClipPlane((1.0, 0.0, 0.0), 1.0).outline(CropBox(), state.proportions)) == 0


EQUAL = (3**-0.5, 3**-0.5, 3**-0.5)


@pytest.fixture
def cube(state, canvas):
    canvas.show()
    cube = OrientationCube(state, canvas)
    cube.show()
    return cube


def test_a_click_on_a_face_looks_from_there(state, cube):
    state.start_view(EQUAL, "+y")
    assert set(cube.visible_faces) == {"Front", "Right", "Top"}
    QTest.mouseClick(cube, Qt.MouseButton.LeftButton, pos=cube.visible_faces["Right"].toPoint())
    _, up, back = state.view.basis()
    assert up == pytest.approx(axis_direction("+y"), abs=1e-9)
    assert back == pytest.approx(axis_direction("+x"), abs=1e-9)
    assert not state.live


def test_labels_are_the_patients_where_they_are_known(state, cube):
    assert cube.labels["-x"] == "−X"
    state.start_view(EQUAL, "-y", tuple("PAISRL"))
    assert (cube.labels["+x"], cube.labels["-y"]) == ("P", "S")
    # From the patient's front, with the patient's left on the right.
    assert state.front_axis == "-x"
    QTest.mouseMove(cube, cube.visible_faces["Front"].toPoint())
    assert cube.toolTip().startswith("Front (the patient's front)")
    QTest.mouseMove(cube, cube.visible_faces["Right"].toPoint())
    assert cube.toolTip().startswith("Right (the patient's left)")
