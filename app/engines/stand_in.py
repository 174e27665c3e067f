"""The analyst under path-traced light: other lights stand in for its pictures and derivatives."""

from __future__ import annotations

from app.engines.renderer_engine import RendererEngine
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.light import LightDirection
from model.scene.scene import PATH_STAND_IN
from model.scene.volume import Volume


class StandInEngine(RendererEngine):
    """Draws in soft light, the nearest to path-traced light, and differentiates in another one.

    Parameters
    ----------
    pictures : RaycastRenderer
        In soft light.
    derivatives : RaycastRenderer
        In a light whose derivative is exact.
    sample_distance : float
        Of final images, in voxels.
    """

    def __init__(
        self, pictures: RaycastRenderer, derivatives: RaycastRenderer, sample_distance: float
    ) -> None:
        super().__init__(pictures, sample_distance)
        self._derivatives = derivatives

    @classmethod
    def of(
        cls, volume: Volume, light: LightDirection | None, sample_distance: float
    ) -> StandInEngine:
        """Build both ray casters of a volume."""
        pictures, derivatives = (
            RaycastRenderer(volume, lighting, light, sample_distance)
            for lighting in ("soft", PATH_STAND_IN)
        )
        return cls(pictures, derivatives, sample_distance)

    def close(self) -> None:
        """Release both."""
        super().close()
        self._derivatives.close()

    def _ray_caster(self) -> RaycastRenderer:
        return self._derivatives
