"""Choices of the user for the reference, and lights that are too slow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.engines.engines import Drawing, ReferenceSettings
from app.engines.exactness import STOPS, USUAL, Stop
from app.engines.messages import Result
from app.engines.pace import FIRST_SIZE, FIRST_SLOW_SCALE
from app.state.settings import LightingChoice
from model.rendering.raster import Raster
from model.scene.scene import LightDirection, Lighting, LightRange, Scene

SizeChoice = Literal["pane", "generator"] | int
"""As many pixels as the pane has, as the generator's image has, or a square of a size."""

EVERYWHERE = LightRange(90.0, 90.0)  # range of a light that no model has to follow
USUAL_DISTANCE = 0.5  # sample distance in voxels, where neither the user nor a model has another
SLOW_SOFT_S = 0.1  # of a moving image, from which soft light is not chosen automatically

SLOW_LIGHT_S = 3.0
"""Time of the ray caster's image in direct light from which no light is chosen automatically. The
image has as many pixels as the first one, however wide the pane."""


@dataclass(frozen=True)
class ReferenceChoices:
    """Choices of the reference image that are kept between runs, the lighting for each volume."""

    lighting: LightingChoice = "auto"
    drawing: Drawing = "auto"
    stop: Stop = USUAL
    size: SizeChoice = "pane"
    denoises: bool = True

    def settings(
        self, scene: Scene | None, slow_lights: frozenset[Lighting] = frozenset()
    ) -> ReferenceSettings:
        """Return the settings of the renderer, next to a model of a scene if there is one.

        Samples lie as far apart as in the model's training images, or :data:`USUAL_DISTANCE`, where
        the stop has no other distance. Some lights may have turned out to take too long here.
        """
        lighting = self._lighting(scene, slow_lights)
        light = None
        if lighting != "none":
            follows = scene is not None and scene.lighting == lighting
            light = scene.light if scene is not None and follows else LightDirection()
        usual = USUAL_DISTANCE if scene is None else scene.sample_distance
        return ReferenceSettings(
            lighting,
            light,
            (None if lighting == "path" else STOPS[self.stop].distance) or usual,
            self.drawing,
            self.denoises or lighting != "path",
            is_truth=scene is not None and lighting in ("none", "direct"),
        )

    def light_range(self, scene: Scene | None, settings: ReferenceSettings) -> LightRange | None:
        """Return the range in which the user may move the light; None without or for a fixed one.

        A model that was trained under the same light decides.
        """
        if settings.lighting == "none":
            return None
        if scene is not None and scene.lighting == settings.lighting:
            return scene.light_range
        return EVERYWHERE

    def _lighting(self, scene: Scene | None, slow_lights: frozenset[Lighting]) -> Lighting:
        if self.lighting != "auto":
            return self.lighting
        if scene is not None:
            return scene.lighting
        # VTK has no soft light.
        if self.drawing != "vtk" and "soft" not in slow_lights:
            return "soft"
        return "none" if "direct" in slow_lights else "direct"


class SlowLights:
    """Kinds of light of a volume that took too long, by the first images in each."""

    def __init__(self) -> None:
        self.found: frozenset[Lighting] = frozenset()
        self._judged: frozenset[Lighting] = frozenset()
        self._loaded: frozenset[Lighting] = frozenset()

    def judge(
        self, lighting: Lighting, result: Result, whole: Raster, is_busy: bool = False
    ) -> float:
        """Judge a light by the time of one of the reference's images.

        While the machine is busy with compiling, a slow image says nothing: else the first light
        would go and come back.

        Return the seconds that such an image takes if this has now been found to be too long;
        else 0.
        """
        image = result.image
        if lighting in self._judged or image is None:
            return 0.0
        if lighting == "soft":
            # By as many pixels as an image has while something moves.
            limit, pixels = SLOW_SOFT_S, FIRST_SLOW_SCALE**2 * whole.width * whole.height
        elif lighting == "direct" and image.by_raycast and not result.request.quality.live:
            limit, pixels = SLOW_LIGHT_S, FIRST_SIZE**2
        else:
            return 0.0
        rows, columns = image.rgba.shape[:2]
        seconds = image.seconds * min(1.0, pixels / (rows * columns))
        if seconds > limit and is_busy:
            return 0.0
        if seconds > limit and lighting not in self._loaded:
            # With the first image, what draws it was loaded or compiled, or the machine slept.
            self._loaded |= {lighting}
            return 0.0
        self._judged |= {lighting}
        if seconds <= limit:
            return 0.0
        self.found |= {lighting}
        return seconds
