"""What may be shown over the images: an orientation cube and the colour legend."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import QObject, QRect, Signal
from PySide6.QtGui import QPainter

from app.image_view.image_canvas import ImageCanvas
from app.image_view.orientation_cube import OrientationCube
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.window.legend import paint_legend


class Overlays(QObject):
    """Shows a cube and a legend over each canvas, as the user wants.

    Parameters
    ----------
    canvases : sequence of ImageCanvas
    state : ViewerState
    preferences : Preferences

    Attributes
    ----------
    units : str
        Unit of the volume's scalars; may be empty.
    """

    changed = Signal()
    """Emitted when another choice is made."""

    def __init__(
        self, canvases: Sequence[ImageCanvas], state: ViewerState, preferences: Preferences
    ) -> None:
        super().__init__(canvases[0])
        self._canvases = canvases
        self._state = state
        self._preferences = preferences
        self.units = ""
        self._cubes = [OrientationCube(state, canvas) for canvas in canvases]
        for canvas in canvases:
            canvas.add_decoration(partial(self._paint, canvas))
        self._show_cubes()

    @property
    def has_cube(self) -> bool:
        """Whether the orientation cube is shown."""
        return bool(self._preferences.value("cube"))

    @property
    def has_legend(self) -> bool:
        """Whether the colour legend is shown."""
        return bool(self._preferences.value("legend"))

    def toggle_cube(self) -> None:
        """Show the cube, or hide it."""
        self._preferences.set(cube=not self.has_cube)
        self._show_cubes()
        self.changed.emit()

    def toggle_legend(self) -> None:
        """Show the legend, or hide it."""
        self._preferences.set(legend=not self.has_legend)
        for canvas in self._canvases:
            canvas.update()
        self.changed.emit()

    def _show_cubes(self) -> None:
        for cube in self._cubes:
            cube.setVisible(self.has_cube)

    def _paint(self, canvas: ImageCanvas, painter: QPainter, _square: QRect) -> None:
        if self.has_legend:
            paint_legend(painter, canvas.picture_rect, self._state.transfer_function, self.units)
