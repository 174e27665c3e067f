from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot
from ramp import make_tf

from app.image_view.crop_handles import CropHandles
from app.image_view.crop_outline import Handle
from app.image_view.gestures import ViewGestures
from app.image_view.image_canvas import ImageCanvas
from app.state.viewer_state import ViewerState
from model.rendering.renderer import open_renderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.projection import Projection
from model.scene.transfer_function import OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume

LEFT = Qt.MouseButton.LeftButton
VIEW = View(azimuth=30.0, elevation=20.0, roll=10.0, distance=1.0, pan_x=0.1, pan_y=-0.05)


@pytest.fixture
def canvas(qtbot: QtBot, state: ViewerState) -> ImageCanvas:
    canvas = ImageCanvas()
    qtbot.addWidget(canvas)
    canvas.resize(600, 400)
    canvas.show()
    image = QImage(60, 40, QImage.Format.Format_RGB888)
    image.fill(0)
    canvas.show_image(image)
    state.start_view((0.6, 0.6, 0.5), view=VIEW)
    ViewGestures(canvas, state)
    return canvas


@pytest.fixture
def handles(canvas: ImageCanvas, state: ViewerState) -> CropHandles:
    handles = CropHandles(canvas, state)
    handles.set_volume((61, 61, 51))
    handles.set_active(True)
    return handles


def pixel(canvas: ImageCanvas, handle: Handle) -> QPointF:
    """A handle's place, by the canvas's own account of its square."""
    rect, (x, y) = canvas.image_rect, handle.place
    return QPointF(
        rect.left() + rect.width() * (1 + x) / 2, rect.top() + rect.height() * (1 - y) / 2
    )


def handle_of(handles: CropHandles, axis: int, side: int) -> Handle:
    return next(h for h in handles.handles if (h.axis, h.side) == (axis, side))


def test_projected_points_lie_where_the_renderer_draws_them() -> None:
    """A single bright voxel of a dark volume is drawn at its projected place."""
    scalars = np.zeros((21, 25, 31), np.float32)
    scalars[4, 18, 24] = 1.0
    volume = Volume(scalars, spacing=(1.0, 1.3, 0.8))
    lo, hi = volume.scalar_range
    opacity = OpacityTF((lo, hi), points=((lo, 0.0), (0.5, 0.0), (hi, 1.0)))
    colors = make_tf().color
    stops = tuple(((v - 100) / 100, r, g, b) for v, r, g, b in colors.stops)
    tf = TransferFunction(opacity, type(colors)((lo, hi), stops))
    with_renderer = open_renderer("raycast", volume, "none", None, 0.25)
    alpha = with_renderer.render(SceneInputs.of(VIEW, tf), 200, 0.25)[..., 3].astype(float)
    with_renderer.close()
    rows, columns = np.indices(alpha.shape)
    x = (alpha * (columns + 0.5)).sum() / alpha.sum() / 100 - 1
    y = 1 - (alpha * (rows + 0.5)).sum() / alpha.sum() / 100
    point = np.array([[24 / 30, 18 / 24, 4 / 20]])
    places = Projection(VIEW, volume.proportions).places(point)
    np.testing.assert_allclose(places[0], (x, y), atol=0.01)


def test_a_drag_by_the_projected_length_moves_the_plane_as_far(
    canvas: ImageCanvas, handles: CropHandles, state: ViewerState
) -> None:
    start = pixel(canvas, handle_of(handles, 0, 1)).toPoint()
    state.set_crop(CropBox((0.0, 0.0, 0.0), (0.75, 1.0, 1.0)))
    end = pixel(canvas, handle_of(handles, 0, 1)).toPoint()
    state.set_crop(None)
    QTest.mousePress(canvas, LEFT, pos=start)
    QTest.mouseMove(canvas, end)
    assert state.live
    QTest.mouseRelease(canvas, LEFT, pos=end)
    assert not state.live
    assert state.crop is not None
    assert state.crop.high[0] == pytest.approx(0.75, abs=0.02)
    assert state.crop.low == (0.0, 0.0, 0.0) and state.crop.high[1:] == (1.0, 1.0)
    assert state.view == VIEW


def test_beside_the_handles_the_view_turns(
    canvas: ImageCanvas, handles: CropHandles, state: ViewerState
) -> None:
    QTest.mousePress(canvas, LEFT, pos=QPoint(20, 20))
    QTest.mouseMove(canvas, QPoint(60, 40))
    QTest.mouseRelease(canvas, LEFT, pos=QPoint(60, 40))
    assert state.view != VIEW and state.crop is None


def test_inactive_handles_leave_the_mouse_alone(
    canvas: ImageCanvas, handles: CropHandles, state: ViewerState
) -> None:
    at = pixel(canvas, handle_of(handles, 0, 1)).toPoint()
    handles.set_active(False)
    QTest.mousePress(canvas, LEFT, pos=at)
    QTest.mouseMove(canvas, at + QPoint(40, 0))
    QTest.mouseRelease(canvas, LEFT, pos=at + QPoint(40, 0))
    assert state.crop is None and state.view != VIEW


def test_planes_along_the_line_of_sight_have_no_handle(
    handles: CropHandles, state: ViewerState
) -> None:
    state.look_from("Front")
    assert {handle.axis for handle in handles.handles} == {0, 2}


def test_a_handle_says_its_voxel(
    canvas: ImageCanvas, handles: CropHandles, state: ViewerState
) -> None:
    state.set_crop(CropBox((0.0, 0.0, 0.0), (0.5, 1.0, 1.0)))
    QTest.mouseMove(canvas, pixel(canvas, handle_of(handles, 0, 1)).toPoint())
    assert handles.label == "x: last voxel 30"
