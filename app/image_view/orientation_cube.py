"""A small cube over an image that shows how the volume is turned."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFont,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QRegion,
    QShowEvent,
    QTransform,
)
from PySide6.QtWidgets import QWidget

from app import theme
from app.controls import CLICK_REACH, named
from app.image_view.gestures import DEGREES_PER_PIXEL, turn
from app.image_view.image_canvas import ImageCanvas
from app.state.viewer_state import ViewerState
from model.scene.orientation import STANDARD_VIEWS, faces
from model.scene.view import AXES, View, axis_direction

SIZE = 64
PLACE = 6  # distance in pixels to the image's corner
HALF_EDGE = 17.0
EYE, FAR = 6.0, 1e4
"""Distance of the eye that sees the cube, in halves of its edge; and in orthographic views."""
RIM = 1.5  # pixels around the cube that belong to its shape, so that its edges are smooth
LIGHT = np.array([-0.35, 0.55, 0.76])  # to the upper left, in the image's right, up and back
DARKEST, BRIGHTEST = 90, 205
LEGIBLE = 0.3  # least cosine to the eye at which a face's label is drawn
HELP = "Click a face to look from there, drag to turn"

PATIENT = {
    "R": "the patient's right",
    "L": "the patient's left",
    "A": "the patient's front",
    "P": "the patient's back",
    "S": "the patient's head",
    "I": "the patient's feet",
}


@dataclass(frozen=True)
class _Face:
    """A visible face: the standard view that shows it, its corners and normal, its label."""

    name: str
    label: str
    polygon: QPolygonF
    normal: NDArray[np.float64]


class OrientationCube(QWidget):
    """Shows the view's direction in the upper right corner of an image."""

    def __init__(self, state: ViewerState, canvas: ImageCanvas) -> None:
        super().__init__(canvas)
        self._state, self._canvas = state, canvas
        self._pressed: QPointF | None = None
        self._last = QPointF()
        self._dragged = False
        self._hovered = ""
        self._faces: list[_Face] = []
        self._seen: object = None
        self.setFixedSize(QSize(SIZE, SIZE))
        self.setMouseTracking(True)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        named(self, "Orientation", HELP)
        state.viewChangeFinished.connect(self.follow)
        state.navigationChanged.connect(self.follow)
        canvas.resized.connect(self._place)
        self._place()

    @property
    def labels(self) -> dict[str, str]:
        """Label of each axis: the patient's direction, or the axis' name."""
        plain = {axis: axis.replace("-", "−").upper() for axis in AXES}
        return plain | dict(zip(AXES, self._state.axis_labels, strict=False))

    @property
    def visible_faces(self) -> dict[str, QPointF]:
        """Centre of each visible face, by the standard view that shows it."""
        return {face.name: face.polygon.boundingRect().center() for face in self._faces}

    def face_at(self, position: QPointF) -> str:
        """Standard view of the face at a position; empty outside the cube."""
        for face in self._faces:
            if face.polygon.containsPoint(position, Qt.FillRule.OddEvenFill):
                return face.name
        return ""

    def showEvent(self, event: QShowEvent) -> None:
        """Show the present view."""
        self.follow()
        super().showEvent(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a drag or a click."""
        if event.button() == Qt.MouseButton.LeftButton and not event.modifiers():
            self._pressed = self._last = event.position()
            self._dragged = False
        else:
            event.ignore()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn the volume, so that the cube follows the mouse; without a button, mark a face."""
        position = event.position()
        if self._pressed is None:
            self._hover(self.face_at(position))
            event.ignore()
            return
        if not self._dragged and (position - self._pressed).manhattanLength() <= CLICK_REACH:
            return
        self._dragged = True
        moved, self._last = position - self._last, position
        scale = float(np.degrees(1.0)) / HALF_EDGE / DEGREES_PER_PIXEL
        self._state.move_view(turn(self._state, scale * moved.x(), scale * moved.y()))
        self.follow()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the drag, or look from the face that was clicked."""
        if self._pressed is None or event.button() != Qt.MouseButton.LeftButton:
            event.ignore()
            return
        self._pressed = None
        if self._dragged:
            self._state.finish_view()
        elif name := self.face_at(event.position()):
            self._state.look_from(name)
        self._hover(self.face_at(event.position()))

    def leaveEvent(self, event: QEvent) -> None:
        """Mark no face."""
        self._hover("")

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the visible faces with their labels."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for face in self._faces:
            hovered = face.name == self._hovered
            painter.setPen(QPen(QColor(theme.ON_IMAGE.window), 1.2))
            painter.setBrush(QColor(theme.ON_IMAGE.change) if hovered else _shade(face.normal))
            painter.drawPolygon(face.polygon)
        painter.setPen(QColor(theme.ON_IMAGE.window))
        square = QRectF(0, 0, 100, 100)
        corners = QPolygonF([QPointF(x, y) for x, y in ((0, 0), (100, 0), (100, 100), (0, 100))])
        for face in self._faces:
            transform = QTransform.quadToQuad(corners, face.polygon)
            if face.normal[2] < LEGIBLE or not isinstance(transform, QTransform):
                continue
            font = QFont(self.font())
            font.setBold(True)
            font.setPixelSize(66 if len(face.label) == 1 else 50)
            painter.setFont(font)
            painter.setTransform(transform)
            painter.drawText(square, Qt.AlignmentFlag.AlignCenter, face.label)

    def follow(self) -> None:
        """Show the state's view, unless the cube lies over the other image."""
        if self.isHidden():
            return
        state = self._state
        seen = state.view, state.up_axis, state.front_axis, dict(self.labels)
        if seen == self._seen:
            return
        self._seen = seen
        self._faces = _visible(faces(state.up_axis, state.front_axis), self.labels, state)
        shape = QRegion()
        middle = QPointF(SIZE / 2, SIZE / 2)
        grown = QTransform().translate(middle.x(), middle.y())
        grown.scale(1 + RIM / HALF_EDGE, 1 + RIM / HALF_EDGE)
        grown.translate(-middle.x(), -middle.y())
        for face in self._faces:
            shape = shape.united(QRegion(grown.map(face.polygon).toPolygon()))
        self.setMask(shape)
        if self._pressed is None and self._hovered not in self.visible_faces:
            self._hover("")
        self.update()

    def _place(self) -> None:
        self.move(self._canvas.width() - SIZE - PLACE, PLACE)

    def _hover(self, name: str) -> None:
        if name != self._hovered:
            self._hovered = name
            label = next((face.label for face in self._faces if face.name == name), "")
            tip = f"{name} ({PATIENT.get(label, label)}): click to look from here, drag to turn"
            self.setToolTip(tip if name else HELP)
            self.update()


def _visible(axes: Mapping[str, str], labels: dict[str, str], state: ViewerState) -> list[_Face]:
    """Faces that are seen in the state's view, each upright in its own standard view."""
    basis = state.view.basis()
    eye = FAR if state.view.is_orthographic else EYE
    # Rows are the standard views' right, up and back, in the volume's axes.
    frame = np.stack([axis_direction(axes[name]) for name in ("Right", "Back", "Top")])
    found = []
    for name, angles in STANDARD_VIEWS.items():
        right, up, normal = View(*angles).basis() @ frame @ basis.T
        # In perspective, a face is visible only from in front of its plane.
        if eye * normal[2] <= 1.0:
            continue
        signs = (-1, 1), (1, 1), (1, -1), (-1, -1)
        corners = [_project(normal + x * right + y * up, eye) for x, y in signs]
        polygon = QPolygonF(corners)
        found.append(_Face(name, labels[axes[name]], polygon, normal))
    return found


def _project(point: NDArray[np.float64], eye: float) -> QPointF:
    """Pixel of a point of the cube, given to the right, up and towards the eye."""
    scale = HALF_EDGE * eye / (eye - point[2])
    return QPointF(SIZE / 2 + scale * point[0], SIZE / 2 - scale * point[1])


def _shade(normal: NDArray[np.float64]) -> QColor:
    """Bluish grey of a face, brighter where it faces the light."""
    share = max(float(normal @ LIGHT), 0.0)
    level = round(DARKEST + (BRIGHTEST - DARKEST) * share)
    return QColor(level - 8, level, level + 12)
