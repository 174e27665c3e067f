"""VTK with the ray caster behind it, which draws what VTK cannot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.errors import CannotDrawError
from model.rendering.raster import Raster
from model.rendering.renderer import Renderer, open_renderer
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.volume import Volume


class FallbackRenderer:
    """Draws by VTK until that fails, and by the ray caster from then on.

    For whoever looks at pictures, not for data sets, whose images are all of one renderer.

    Parameters
    ----------
    volume, lighting, light, sample_distance
        See :func:`model.rendering.renderer.open_renderer`.

    Attributes
    ----------
    reason : str
        One sentence that says why the ray caster draws; "" while VTK does.
    """

    def __init__(
        self,
        volume: Volume,
        lighting: Lighting = "none",
        light: LightDirection | None = None,
        sample_distance: float = 0.5,
    ) -> None:
        self.sample_distance = sample_distance
        self.reason = ""
        self._place = volume, lighting, light, sample_distance
        try:
            self._renderer: Renderer = open_renderer("vtk", *self._place)
        except CannotDrawError as error:
            self._fall_back(error)

    def render(
        self, inputs: SceneInputs, size: int | Raster, sample_distance: float | None = None
    ) -> NDArray[np.float32]:
        """Render one image; see :class:`model.rendering.renderer.Renderer`."""
        try:
            return self._renderer.render(inputs, size, sample_distance)
        except CannotDrawError as error:
            if self.reason:
                raise
            self._renderer.close()
            self._fall_back(error)
            return self._renderer.render(inputs, size, sample_distance)

    def close(self) -> None:
        """Release the renderer's threads and memory; it cannot be used afterwards."""
        self._renderer.close()

    def _fall_back(self, error: CannotDrawError) -> None:
        self.reason = f"{str(error).rstrip('.')}; the ray caster draws instead."
        self._renderer = open_renderer("raycast", *self._place)
