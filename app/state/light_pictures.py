"""Small pictures of the open volume in each light, for the menus that choose one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QObject, Signal

from app.engines.engines import Builders, ReferenceSettings
from app.engines.quality import Quality
from app.engines.requests import Array, Engine, ImageRequest
from app.state.latest_call import LatestCall
from app.state.viewer_state import ViewerState
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting
from model.scene.volume import Volume

LIGHTS: tuple[Lighting, ...] = ("none", "direct", "soft", "shadows", "path")

PIXELS = 48
"""Sides of a picture."""

SAMPLES = 4
"""Of each pixel in path-traced light."""


class LightPictures(QObject):
    """Draws the present view in each light, one picture after the other, in a thread of its own.

    Lights whose kernels would have to be compiled first are left out: that takes the better part of
    a minute, in which the window would stutter.

    Parameters
    ----------
    state : ViewerState
    builders : Builders

    Attributes
    ----------
    pictures : dict of Lighting to ndarray of float32, shape (PIXELS, PIXELS, 4)
        Those that are there, of the view that was asked for last.
    """

    asked = Signal(object)
    """Emitted with the lights of which pictures follow, before those of another view are drawn."""
    drawn = Signal(object)
    """Emitted with a light when its picture is there."""

    def __init__(self, state: ViewerState, builders: Builders, parent: QObject) -> None:
        super().__init__(parent)
        self.pictures: dict[Lighting, Array] = {}
        self._state, self._builders = state, builders
        self._of: tuple[Volume, SceneInputs, ReferenceSettings] | None = None
        self._waiting: list[Lighting] = []
        self._call = LatestCall("light-pictures", self)
        self._call.done.connect(self._take)
        self._call.failed.connect(self._leave_out)

    def ask(self, volume: Volume, settings: ReferenceSettings) -> None:
        """Draw what is seen now, unless that is there or under way.

        Parameters
        ----------
        settings : ReferenceSettings
            Of the reference, in its present light.
        """
        state = self._state
        if state.scale != volume.scale:
            return
        # The image may be wider than the pictures, and zoomed.
        inputs = replace(state.inputs, view=state.for_picture(state.view))
        of = volume, inputs, replace(settings, lighting="none", renderer="raycast", samples=SAMPLES)
        if self._of is not None and self._of[0] is volume and self._of[1:] == of[1:]:
            return
        self._call.forget()
        self._of = of
        self.pictures.clear()
        voxels = volume.voxels.dtype.name
        self._waiting = [
            each
            for each in LIGHTS
            if each == settings.lighting or self._builders.is_prepared(voxels, each)
        ]
        self.asked.emit(tuple(self._waiting))
        self._go_on()

    def stop(self) -> None:
        """Draw nothing any more."""
        self._waiting.clear()
        self._call.stop()

    def join(self) -> None:
        """Wait until the thread has ended."""
        self._call.join()

    def _go_on(self) -> None:
        if self._waiting and self._of is not None:
            volume, inputs, settings = self._of
            lit = replace(settings, lighting=self._waiting[0])
            build = partial(self._builders.reference, volume, lit)
            self._call.ask(partial(_picture, build, inputs))

    def _take(self, picture: Array) -> None:
        lighting = self._waiting.pop(0)
        self.pictures[lighting] = picture
        self.drawn.emit(lighting)
        self._go_on()

    def _leave_out(self, _error: str) -> None:
        # Who chooses this light is told why there is no picture.
        self._waiting.pop(0)
        self._go_on()


def _picture(build: Callable[[], Engine], inputs: SceneInputs) -> Array:
    engine = build()
    try:
        return engine.image(ImageRequest(inputs, Quality(PIXELS, samples=SAMPLES)))
    finally:
        engine.close()
