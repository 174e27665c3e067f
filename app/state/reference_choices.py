"""The user's choices for the reference, and lights that are too slow."""

from collections.abc import Mapping
from dataclasses import dataclass

from app.engines.exactness import STOPS
from app.engines.messages import Result
from app.engines.pace import FIRST_SIZE
from app.engines.requests import ReferenceSettings
from app.state.settings import ImageSettings, LightingChoice
from model.scene.scene import LightDirection, Lighting, LightRange, Scene

USUAL_DISTANCE = 0.5  # default sample distance in voxels

SLOW_S: dict[Lighting, float] = {"soft": 0.1, "direct": 3.0}
"""Seconds per image, on idle cores, from which a light is not chosen automatically."""

JUDGED_SIZE: dict[Lighting, int] = {"soft": 256, "direct": FIRST_SIZE}
"""Pixels of its sides: as many as while something moves, and as the first one has."""


@dataclass(frozen=True)
class ReferenceChoices(ImageSettings):
    """Choices of the reference image that are kept between runs, the lighting for each volume."""

    lighting: LightingChoice = "auto"

    def settings(
        self, scene: Scene | None, slow_lights: frozenset[Lighting] = frozenset()
    ) -> ReferenceSettings:
        """Return the settings of the renderer, next to a model of a scene if there is one.

        The sample distance is the stop's, that of the model's training images, or
        :data:`USUAL_DISTANCE`. `slow_lights` take too long here.
        """
        lighting = self._lighting(scene, slow_lights)
        light = None
        if lighting != "none":
            follows = scene is not None and scene.lighting == lighting
            light = scene.light if scene is not None and follows else LightDirection()
        usual = USUAL_DISTANCE if scene is None else scene.sample_distance
        is_traced = lighting == "path"
        distance = (None if is_traced else STOPS[self.stop].distance) or usual
        is_truth = scene is not None and lighting in ("none", "direct")
        drawn = distance, self.drawing, self.denoises or not is_traced
        return ReferenceSettings(lighting, light, *drawn, is_truth=is_truth)

    def light_range(self, scene: Scene | None, settings: ReferenceSettings) -> LightRange | None:
        """Return the range of the movable light; None without a light, or if a model fixes it."""
        if settings.lighting == "none":
            return None
        if scene is not None and scene.lighting == settings.lighting:
            return scene.light_range
        return LightRange(90.0, 90.0)

    def _lighting(self, scene: Scene | None, slow_lights: frozenset[Lighting]) -> Lighting:
        if self.lighting != "auto":
            return self.lighting
        if scene is not None:
            return scene.lighting
        # VTK has no soft light.
        if self.drawing != "vtk" and "soft" not in slow_lights:
            return "soft"
        return "none" if "direct" in slow_lights else "direct"


def quiet_seconds(lighting: Lighting, result: Result) -> float | None:
    """Return the time by which a light is judged; None if an image is unsuitable."""
    image = result.image
    if image is None or image.quiet_seconds is None or lighting not in SLOW_S:
        return None
    # Soft light is judged while something moves: it must not replace a finished picture.
    if result.request.quality.live != (lighting == "soft") or not image.by_raycast:
        return None
    rows, columns = image.rgba.shape[:2]
    return image.quiet_seconds * min(1.0, JUDGED_SIZE[lighting] ** 2 / (rows * columns))


def slow_lights(seconds: Mapping[Lighting, float]) -> frozenset[Lighting]:
    """Return the lights that take too long, by their measured seconds."""
    return frozenset(light for light, most in SLOW_S.items() if seconds.get(light, 0.0) > most)
