"""The analyst under path-traced light: other lights stand in for its pictures and derivatives."""

from __future__ import annotations

from app.engines.renderer_engine import RendererEngine
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.light import LightDirection
from model.scene.scene import PATH_CURVES, PATH_FIELDS
from model.scene.volume import Volume


class StandInEngine(RendererEngine):
    """Draws in soft light, the nearest to path-traced light, in which its fields are, too.

    Parameters
    ----------
    pictures : RaycastRenderer
        In that light.
    curves : RaycastRenderer
        In the light of the curves of regions.
    sample_distance : float
        Of final images, in voxels.
    """

    def __init__(
        self, pictures: RaycastRenderer, curves: RaycastRenderer, sample_distance: float
    ) -> None:
        super().__init__(pictures, sample_distance)
        self._curves = curves

    @classmethod
    def of(
        cls, volume: Volume, light: LightDirection | None, sample_distance: float
    ) -> StandInEngine:
        """Build both ray casters of a volume."""
        pictures, curves = (
            RaycastRenderer(volume, lighting, light, sample_distance)
            for lighting in (PATH_FIELDS, PATH_CURVES)
        )
        return cls(pictures, curves, sample_distance)

    def close(self) -> None:
        """Release both."""
        super().close()
        self._curves.close()

    def _of_curves(self) -> RaycastRenderer:
        return self._curves
