"""What may be shown over images: cube, legend, scale bar, opacity image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QObject, QRect, Signal
from PySide6.QtGui import QPainter

from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import ImageCanvas
from app.image_view.opacity_inset import OpacityInset
from app.image_view.orientation_cube import OrientationCube
from app.image_view.picture import BLACK, WHITE, Background
from app.state.preferences import Preferences
from app.state.settings import BackgroundChoice
from app.state.viewer_state import ViewerState
from app.window.figure import Subject
from app.window.image_marks import paint_legend, paint_scale_bar
from model.scene.transfer_function import OpacityTF, TransferFunction

BACKGROUNDS: dict[BackgroundChoice, Background] = {
    "black": BLACK,
    "gradient": "gradient",
    "white": WHITE,
}


class Overlays(QObject):
    """Shows what the user wants over each pane's image.

    Nothing is shown while there is no volume.

    Attributes
    ----------
    subject : Subject
        The volume, for legend and scale bar.
    """

    changed = Signal()
    """Emitted when another choice is made."""

    def __init__(
        self,
        panes: Sequence[EnginePane],
        state: ViewerState,
        preferences: Preferences,
    ) -> None:
        super().__init__(panes[0])
        self._panes = panes
        self._canvases = canvases = [pane.canvas for pane in panes]
        self._state = state
        self._preferences = preferences
        self.subject = Subject()
        self._has_volume = False
        self._previewed: OpacityTF | None = None
        self._cubes = [OrientationCube(state, canvas) for canvas in canvases]
        for pane, cube in zip(panes, self._cubes, strict=True):
            # While something moves, with each image: it lies over that, and both are painted.
            pane.imageShown.connect(lambda *_, cube=cube: cube.follow())
        self._right = canvases[-1]
        self.insets = [OpacityInset(pane) for pane in panes]
        for canvas in canvases:
            canvas.add_decoration(partial(self._paint, canvas))
        self._show_cubes()
        self._show_opacity()
        self._show_background()

    @property
    def background(self) -> Background:
        """Background of the images."""
        return BACKGROUNDS[self._preferences.settings.background]

    def choose_background(self, choice: BackgroundChoice) -> None:
        """Put something else behind the images."""
        self._preferences.set(background=choice)
        self._show_background()
        self.changed.emit()

    def _show_background(self) -> None:
        for pane in self._panes:
            pane.set_background(self.background)

    @property
    def has_cube(self) -> bool:
        """Whether the orientation cube is shown."""
        return self._preferences.settings.cube

    @property
    def has_legend(self) -> bool:
        """Whether the colour legend is shown."""
        return self._preferences.settings.legend

    @property
    def legend_tf(self) -> TransferFunction:
        """The TF of the legend: that of the image, or of the picture that covers it."""
        tf = self._state.transfer_function
        return tf if self._previewed is None else replace(tf, opacity=self._previewed)

    def preview(self, opacity: OpacityTF | None) -> None:
        """Have the legend of a picture of another opacity TF; None for the image's again."""
        self._previewed = opacity
        self._right.update()

    @property
    def has_scale_bar(self) -> bool:
        """Whether the scale bar is shown."""
        return self._preferences.settings.scale_bar

    @property
    def has_opacity(self) -> bool:
        """Whether opacity images are shown."""
        return self._preferences.settings.opacity_images

    def start_volume(self, subject: Subject) -> None:
        """Show what is wanted of another volume."""
        self.subject = subject
        self._has_volume = True
        self._show_cubes()

    def lie_over(self, canvas: ImageCanvas) -> None:
        """Show cube and legend over one canvas: the rightmost that is there."""
        self._right = canvas
        self._show_cubes()
        for each in self._canvases:
            each.update()

    def refresh(self) -> None:
        """Show what is remembered by now."""
        self._show_cubes()
        self._show_opacity()
        self._show_background()
        for canvas in self._canvases:
            canvas.update()
        self.changed.emit()

    def toggle_opacity(self) -> None:
        """Show opacity images, or hide them."""
        self._preferences.set(opacity_images=not self.has_opacity)
        self._show_opacity()
        self.changed.emit()

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

    def toggle_scale_bar(self) -> None:
        """Show the scale bar, or hide it."""
        self._preferences.set(scale_bar=not self.has_scale_bar)
        for canvas in self._canvases:
            canvas.update()
        self.changed.emit()

    def _show_opacity(self) -> None:
        for inset in self.insets:
            inset.set_shown(self.has_opacity)

    def _show_cubes(self) -> None:
        for canvas, cube in zip(self._canvases, self._cubes, strict=True):
            shown = self.has_cube and self._has_volume and canvas is self._right
            cube.setVisible(shown)

    def _paint(self, canvas: ImageCanvas, painter: QPainter, _square: QRect) -> None:
        rect, state, subject = canvas.picture_rect, self._state, self.subject
        if self.has_legend and canvas is self._right:
            paint_legend(painter, rect, self.legend_tf, subject.units, self.background)
        if self.has_scale_bar and subject.scale is not None:
            bar = subject.scale.bar(state.view, state.crop)
            paint_scale_bar(painter, rect, bar, self.background)
