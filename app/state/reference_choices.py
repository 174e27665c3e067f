"""What the user has chosen for the reference image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.engines.engines import Drawing, ReferenceSettings
from app.state.exactness import STOPS, USUAL, Stop
from app.state.known_volume import LightingChoice
from model.scene.light import LightDirection, LightRange
from model.scene.scene import Lighting, Scene

SizeChoice = Literal["pane", "generator"] | int
"""As many pixels as the pane has, as the generator's image has, or a square of a size."""

EVERYWHERE = LightRange(90.0, 90.0)
"""Range of a light that no model has to follow."""

USUAL_DISTANCE = 0.5
"""Sample distance in voxels, where neither the user nor a model has another."""


@dataclass(frozen=True)
class ReferenceChoices:
    """Choices of the reference image that are kept between runs, the lighting for each volume.

    Attributes
    ----------
    lighting : {"auto", "none", "direct", "soft", "path"}
    drawing : {"auto", "vtk", "raycast"}
    stop : {"fast", "balanced", "exact"}
        Of the slider from fast to exact. Samples lie as far apart as in the model's training
        images, or :data:`USUAL_DISTANCE`, where that has no other distance.
    size : {"pane", "generator"} or int
    denoises : bool
        Whether path-traced pictures are denoised.
    """

    lighting: LightingChoice = "auto"
    drawing: Drawing = "auto"
    stop: Stop = USUAL
    size: SizeChoice = "pane"
    denoises: bool = True

    def settings(
        self, scene: Scene | None, slow_lights: frozenset[Lighting] = frozenset()
    ) -> ReferenceSettings:
        """Return the settings of the renderer.

        Parameters
        ----------
        scene : Scene or None
            Scene of the model that is shown beside it, if there is one.
        slow_lights : frozenset of str
            Kinds of light in which an image turned out to take too long here.
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
            STOPS[self.stop].distance_in(lighting) or usual,
            self.drawing,
            self.denoises or lighting != "path",
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
