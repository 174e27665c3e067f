"""Overlays of images: cube, legend, scale bar, opacity image; and the background."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal

from PySide6.QtCore import QObject, QRect
from PySide6.QtGui import QPainter

from app.image_view.engine_pane import OpacityInset
from app.image_view.image_canvas import ImageCanvas
from app.image_view.orientation_cube import OrientationCube
from app.image_view.picture import BLACK, WHITE, Background
from app.state.settings import BackgroundChoice
from app.window.context import Context
from app.window.figure import Subject
from app.window.image_marks import paint_legend, paint_scale_bar
from model.scene.transfer_function import OpacityTF, TransferFunction

BACKGROUNDS: dict[BackgroundChoice, Background] = {
    "black": BLACK,
    "gradient": "gradient",
    "white": WHITE,
}

Overlay = Literal["cube", "legend", "scale_bar", "opacity_images"]
"""Settings with what may be shown over images."""


class Overlays(QObject):
    """Shows what the settings say over each pane's image; nothing while there is no volume."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.window)
        self._panes, self._state = context.panes, context.state
        self._canvases = canvases = [pane.canvas for pane in context.panes]
        self._preferences = context.preferences
        self.subject = Subject()
        self._has_volume = False
        self._previewed: OpacityTF | None = None
        self._cubes = [OrientationCube(context.state, canvas) for canvas in canvases]
        for pane, cube in zip(self._panes, self._cubes, strict=True):
            # While something moves, with each image: it lies over that, and both are painted.
            pane.imageShown.connect(lambda *_, cube=cube: cube.follow())
        self._right = canvases[-1]
        self.insets = [OpacityInset(pane) for pane in self._panes]
        for canvas in canvases:
            canvas.add_decoration(partial(self._paint, canvas))
        self.refresh()

    @property
    def background(self) -> Background:
        """Background of the images."""
        return BACKGROUNDS[self._preferences.settings.background]

    @property
    def legend_tf(self) -> TransferFunction:
        """The TF of the legend: that of the image, or of the picture that covers it."""
        tf = self._state.transfer_function
        return tf if self._previewed is None else replace(tf, opacity=self._previewed)

    def has(self, overlay: Overlay) -> bool:
        """Whether something is shown over the images."""
        return bool(getattr(self._preferences.settings, overlay))

    def toggle(self, overlay: Overlay) -> None:
        """Show something over the images, or hide it."""
        self._preferences.set(**{overlay: not self.has(overlay)})
        self.refresh()

    def choose_background(self, choice: BackgroundChoice) -> None:
        """Put something else behind the images."""
        self._preferences.set(background=choice)
        self.refresh()

    def preview(self, opacity: OpacityTF | None) -> None:
        """Have the legend of a picture of another opacity TF; None for the image's again."""
        self._previewed = opacity
        self._right.update()

    def start_volume(self, subject: Subject) -> None:
        """Show what is wanted of another volume."""
        self.subject = subject
        self._has_volume = True
        self.refresh()

    def lie_over(self, canvas: ImageCanvas) -> None:
        """Show cube and legend over one canvas: the rightmost that is there."""
        self._right = canvas
        self.refresh()

    def refresh(self) -> None:
        """Show what the settings say."""
        for canvas, cube in zip(self._canvases, self._cubes, strict=True):
            cube.setVisible(self.has("cube") and self._has_volume and canvas is self._right)
        for pane, inset in zip(self._panes, self.insets, strict=True):
            inset.set_shown(self.has("opacity_images"))
            pane.set_background(self.background)
            pane.canvas.update()

    def _paint(self, canvas: ImageCanvas, painter: QPainter, _square: QRect) -> None:
        rect, state, subject = canvas.picture_rect, self._state, self.subject
        if self.has("legend") and canvas is self._right:
            paint_legend(painter, rect, self.legend_tf, subject.units, self.background)
        if self.has("scale_bar") and subject.scale is not None:
            bar = subject.scale.bar(state.view, state.crop)
            paint_scale_bar(painter, rect, bar, self.background)
