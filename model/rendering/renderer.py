"""The interface of renderers, their creation by name, and VTK with the ray caster behind it."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from model.errors import CannotDrawError
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection, Lighting, RendererName
from model.scene.volume import Volume

SMOOTH = 5  # samples of the ray caster's final pictures per sample of VTK's


class Renderer(Protocol):
    """Renders images of one volume under one lighting."""

    sample_distance: float  # default distance between samples along a ray, in voxels

    def render(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        *,
        go_on: Callable[[], object] | None = None,
    ) -> NDArray[np.float32]:
        """Render RGBA, float32 (rows, columns, 4) in [0, 1], premultiplied, row 0 at the top.

        The size is width and height in pixels, or a raster; the sample distance, in voxels,
        defaults to the renderer's own. The ray caster calls `go_on` before each part, in any
        thread; it may raise to cancel the image.
        """

    def close(self) -> None:
        """Release the renderer's threads and memory; it cannot be used afterwards."""


def open_renderer(
    name: RendererName,
    volume: Volume,
    lighting: Lighting = "none",
    light: LightDirection | None = None,
    sample_distance: float = 0.5,
    threads: int | None = None,
) -> Renderer:
    """Create a renderer by name; :class:`RenderError` if it cannot run on this machine."""
    if name == "vtk":
        from model.rendering.vtk_renderer import VtkRenderer

        return VtkRenderer(volume, lighting, light, sample_distance)
    if lighting == "path":
        from model.rendering.path_tracing.renderer import PathTracer

        return PathTracer(volume, light, sample_distance, threads=threads)
    from model.rendering.raycast.renderer import RaycastRenderer

    return RaycastRenderer(volume, lighting, light, sample_distance, threads=threads)


def smooth_distance(distance: float, lighting: Lighting) -> float:
    """Return the sample distance of the ray caster's final pictures, in voxels, from VTK's.

    Samples half a voxel apart show rings in thin layers of a TF, also with VTK. The ray caster
    avoids them, as dense samples take little time. Path-traced light does not use the distance.
    """
    return distance if lighting == "path" else distance / SMOOTH


class FallbackRenderer:
    """Draws by VTK and, once that fails, by the ray caster.

    Without a graphics card, the ray caster may draw from the start. Not for data sets, which need a
    single renderer. `reason` describes VTK's failure, `remark` why the ray caster draws although
    VTK did not fail; both are "" if VTK draws.
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
        if lighting == "soft":
            self.remark = "Only the ray caster draws soft light."
        elif spares_processor:
            from model.rendering.opengl import software_name

            if software := software_name():
                self.remark = (
                    f"VTK has no graphics card here ({software} draws on the CPU). It is much "
                    "slower than the ray caster, which draws instead. Choose VTK to see its image."
                )
        if self.remark:
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
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        *,
        go_on: Callable[[], object] | None = None,
    ) -> NDArray[np.float32]:
        """Render one image; see :class:`model.rendering.renderer.Renderer`."""
        try:
            return self._renderer.render(inputs, size, sample_distance, go_on=go_on)
        except CannotDrawError as error:
            if self.by_raycast:
                raise
            self._renderer.close()
            self._fall_back(error)
            return self._renderer.render(inputs, size, sample_distance, go_on=go_on)

    def close(self) -> None:
        """Release the renderer's threads and memory; it cannot be used afterwards."""
        self._renderer.close()

    def _fall_back(self, error: CannotDrawError) -> None:
        self.reason = f"{str(error).rstrip('.')}; the ray caster draws instead."
        self._renderer = self._opened_ray_caster()

    def _opened_ray_caster(self) -> Renderer:
        return self._ray_caster or open_renderer("raycast", *self._place)
