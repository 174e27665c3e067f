"""The view, and the axis about which it turns."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from model.scene import orientation
from model.scene.region import SQUARE, Reach
from model.scene.view import (
    DEFAULT_UP,
    NEAREST_DEPTH,
    Projection,
    View,
    axis_direction,
    axis_labelled,
    holding,
)
from model.scene.volume import Triple

HOME_VIEW = View(azimuth=30.0, elevation=15.0, roll=0.0, distance=0.8)  # without a volume
CUBE: Triple = (3**-0.5, 3**-0.5, 3**-0.5)  # proportions before a volume is opened


class ViewNavigation(QObject):
    """The view, the home view, and the volume's axis that points up."""

    viewChanged = Signal(object)
    viewChangeFinished = Signal(object)
    navigationChanged = Signal()  # emitted when up axis, labels, trackball or home view change

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.view = self._home = HOME_VIEW
        self.proportions = CUBE  # the volume's lengths along x, y and z, relative to its diagonal
        self._shown, self._middle = orientation.WHOLE, _middle_of(orientation.WHOLE)
        self._reach = SQUARE
        self._home_angles: tuple[float, float] | None = None
        self.up_axis = DEFAULT_UP  # of the volume, such as "+z"
        self.axis_labels: tuple[str, ...] = ()  # the patient's directions, if they are known
        self.trackball = False
        self.is_panned = False  # whether the user has moved the picture: home is panned, too
        self._view_moving = False

    @property
    def angles(self) -> tuple[float, float, float]:
        """Azimuth, elevation and roll of the view about the up axis, in degrees."""
        return orientation.angles_in(self.up_axis, self.view, front=self.front_axis)

    @property
    def home(self) -> View:
        """Initial view of the volume: everything that its default TF shows is in the image."""
        return replace(self._home, is_orthographic=self.view.is_orthographic)

    @property
    def front_axis(self) -> str:
        """Axis of the volume that points to the patient's front; empty when unknown."""
        return axis_labelled("A", self.axis_labels)

    @property
    def pivot(self) -> NDArray[np.float64]:
        """Point about which the view turns, float64, shape (3,): in the middle of what is shown.

        Next to a model's image, which is not panned, it is the volume's centre.
        """
        return _middle_of(orientation.WHOLE) if self._reach == SQUARE else self._middle

    def for_picture(self, view: View) -> View:
        """Return a view with everything that is shown in the middle of a square picture."""
        far = replace(view, distance=orientation.FARTHEST_HOME)
        return orientation.centred(far, self.proportions, self._shown)

    def for_square(self, view: View) -> View:
        """Return a view that shows in a square picture what this one shows in a wider image."""
        far = replace(view, distance=orientation.FARTHEST_HOME)
        square, image = (
            orientation.centred(far, self.proportions, self._shown, reach).distance
            for reach in (SQUARE, self._reach)
        )
        middle, projection = self.pivot[None], Projection(view, self.proportions)
        if square <= image or projection.depths(middle)[0] < NEAREST_DEPTH:
            return view
        place = projection.places(middle)[0] * image / square
        farther = replace(view, distance=view.distance * square / image)
        return holding(self.pivot, place, farther, self.proportions)

    def turned(self, view: View) -> View:
        """Return a turned view: what is shown stays in the middle, or else the pivot in place."""
        if self.view == self._middled(self.view) and (middled := self._middled(view)) is not None:
            return middled
        pivot, before = self.pivot, Projection(self.view, self.proportions)
        if before.depths(pivot[None])[0] < NEAREST_DEPTH:
            return view
        return holding(pivot, before.places(pivot[None])[0], view, self.proportions)

    def _middled(self, view: View) -> View | None:
        """Pan a view to the middle of what is shown; None for models, or too near to that."""
        depths = Projection(view, self.proportions).depths(self._shown)
        if self._reach == SQUARE or depths.min() < NEAREST_DEPTH:
            return None
        return orientation.panned_to(view, self.proportions, self._shown)

    def move_view(self, view: View) -> None:
        """Change the view during a drag."""
        if view != self.view:
            is_pan = replace(self.view, pan_x=view.pan_x, pan_y=view.pan_y) == view
            self.is_panned = (self.is_panned or is_pan) and view != self.home
            self.view = view
            self._view_moving = True
            self.viewChanged.emit(view)

    def finish_view(self) -> None:
        """End a drag of the view, if there is one."""
        if self._view_moving:
            self._view_moving = False
            self.viewChangeFinished.emit(self.view)

    def set_view(self, view: View) -> None:
        """Change the view without a drag."""
        self.move_view(view)
        self.finish_view()

    @property
    def is_at_home(self) -> bool:
        """Whether the view is the volume's home view."""
        return self.view == self.home

    def reset_view(self) -> None:
        """Go to the volume's home view."""
        self.set_view(self.home)

    def set_orthographic(self, on: bool) -> None:
        """Switch to parallel rays, or to perspective; the volume's middle keeps its size."""
        self.set_view(replace(self.view, is_orthographic=on))

    def view_whole(self, points: NDArray[np.float64] = orientation.WHOLE) -> None:
        """Move the camera to where the volume, or points of it, just fit into the image."""
        far = replace(self.view, distance=orientation.FARTHEST_HOME)
        view = orientation.centred(far, self.proportions, points, self._reach)
        self.set_view(replace(view, pan_x=0.0, pan_y=0.0) if self._reach == SQUARE else view)

    def look_from(self, name: str) -> None:
        """Look from one of :data:`~model.scene.orientation.STANDARD_VIEWS`; keep the distance."""
        view = orientation.standard_view(name, self.view, self.up_axis, front=self.front_axis)
        self.is_panned = False
        self.set_view(holding(self.pivot, np.zeros(2), view, self.proportions))

    def set_reach(self, reach: Reach, follow: bool = False) -> None:
        """Set what the home view has to fit, see :data:`model.scene.region.Reach`.

        If asked, a view that is the home view becomes the new one, and one from its distance takes
        the new distance. Otherwise the image, and a region in it, show the same as before.
        """
        if reach != self._reach:
            self._reach = reach
            at_home, is_as_far = self.is_at_home, self.view.distance == self._home.distance
            self._home = self._upright_home()
            if follow and at_home and not self._view_moving:
                self._look(self.home)
            elif follow and is_as_far and not self._view_moving:
                self._look(self.turned(replace(self.view, distance=self._home.distance)))
            self.navigationChanged.emit()

    def set_up_axis(self, up: str) -> None:
        """Set the axis that points up, and stand the volume upright."""
        axis_direction(up)
        if up == self.up_axis:
            return
        at_home, angles = self.is_at_home, self.angles
        self.up_axis = up
        self._home = self._upright_home()
        turned = orientation.view_in(up, *angles, self.view, front=self.front_axis)
        self.set_view(self.home if at_home else self.turned(turned))
        self.navigationChanged.emit()

    def set_trackball(self, free: bool) -> None:
        """Choose whether dragging turns freely."""
        if free != self.trackball:
            self.trackball = free
            self.navigationChanged.emit()

    def start_view(
        self,
        proportions: Triple,
        up: str = "",
        axis_labels: tuple[str, ...] = (),
        view: View | None = None,
        shown: NDArray[np.float64] = orientation.WHOLE,
        reach: Reach = SQUARE,
        home_angles: tuple[float, float] | None = None,
    ) -> None:
        """Look at another volume with these proportions, axes and shown places."""
        self._view_moving = False
        self.proportions, self.axis_labels = proportions, axis_labels
        self.up_axis = up or DEFAULT_UP
        self._shown, self._middle = shown, _middle_of(shown)
        self._reach, self._home_angles = reach, home_angles
        self._home = self._upright_home()
        self.navigationChanged.emit()
        self._look(view or self.home)

    def _upright_home(self) -> View:
        home = partial(orientation.home_view, self.proportions, front=self.front_axis)
        return home(self.up_axis, points=self._shown, reach=self._reach, angles=self._home_angles)

    def _look(self, view: View) -> None:
        """Show a view that is no part of a drag."""
        self.is_panned = False
        if view != self.view:
            self.view = view
            self.viewChanged.emit(view)
            self.viewChangeFinished.emit(view)


def _middle_of(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return (points.min(axis=0) + points.max(axis=0)) / 2
