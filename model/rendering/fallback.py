"""VTK with the ray caster behind it, which draws what VTK cannot, or only slowly."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

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

    Where no graphics card draws for VTK, the ray caster may do so from the start: by the processor
    it is many times as fast, and draws the same. Soft light is the ray caster's.

    For whoever looks at pictures, not for data sets, whose images are all of one renderer.

    Parameters
    ----------
    ray_caster : Renderer, optional
        That one; by default it is opened when it is needed.

    Attributes
    ----------
    reason : str
        One sentence that says what VTK failed in, so that the ray caster draws; "" if it did not.
    remark : str
        One sentence that says why the ray caster draws though VTK did not fail, such as that no
        graphics card is there; "" if VTK draws.
    """

    def __init__(
        self,
        volume: Volume,
        lighting: Lighting = "none",
        light: LightDirection | None = None,
        sample_distance: float = 0.5,
        spares_processor: bool = False,
        ray_caster: Renderer | None = None,
    ) -> None:
        self.sample_distance = sample_distance
        self.reason = self.remark = ""
        self._place = volume, lighting, light, sample_distance
        self._ray_caster = ray_caster
        self._renderer: Renderer
        if lighting in ("soft", "path"):
            self.remark = {
                "soft": "Soft light is the ray caster's.",
                "path": "The path tracer draws.",
            }[lighting]
            self._renderer = self._opened_ray_caster()
            return
        if spares_processor:
            from model.rendering.opengl import software_name

            software = software_name()
            if software:
                self.remark = (
                    f"No graphics card draws here ({software} does), so the ray caster draws at "
                    "rest, too: VTK would take many times as long. Choose VTK to see its image."
                )
                self._renderer = self._opened_ray_caster()
                return
        try:
            self._renderer = open_renderer("vtk", *self._place)
        except CannotDrawError as error:
            self._fall_back(error)

    @property
    def by_raycast(self) -> bool:
        """Whether the ray caster draws."""
        return bool(self.reason or self.remark)

    def render(
        self, inputs: SceneInputs, size: int | Raster, sample_distance: float | None = None
    ) -> NDArray[np.float32]:
        """Render one image; see :class:`model.rendering.renderer.Renderer`."""
        try:
            return self._renderer.render(inputs, size, sample_distance)
        except CannotDrawError as error:
            if self.by_raycast:
                raise
            self._renderer.close()
            self._fall_back(error)
            return self._renderer.render(inputs, size, sample_distance)

    def asking(self, go_on: Callable[[], object]) -> AbstractContextManager[None]:
        """Call this before each part that the ray caster draws meanwhile; it may raise."""
        asking = getattr(self._renderer, "asking", None)
        return asking(go_on) if asking else nullcontext()

    def close(self) -> None:
        """Release the renderer's threads and memory; it cannot be used afterwards."""
        self._renderer.close()

    def _fall_back(self, error: CannotDrawError) -> None:
        self.reason = f"{str(error).rstrip('.')}; the ray caster draws instead."
        self._renderer = self._opened_ray_caster()

    def _opened_ray_caster(self) -> Renderer:
        return self._ray_caster or open_renderer("raycast", *self._place)
