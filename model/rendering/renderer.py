"""The interface of renderers, and their creation by name."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting, RendererName
from model.scene.volume import Volume

SMOOTH = 5
"""Samples of the ray caster's final pictures for each one of VTK's."""


class Renderer(Protocol):
    """Renders images of one volume under one lighting.

    Attributes
    ----------
    sample_distance : float
        Default distance between samples along a ray, in voxels.
    """

    sample_distance: float

    def render(
        self, inputs: SceneInputs, size: int | Raster, sample_distance: float | None = None
    ) -> NDArray[np.float32]:
        """Render RGBA, float32 (rows, columns, 4) in [0, 1], premultiplied, row 0 at the top.

        Parameters
        ----------
        size : int or Raster
            Width and height in pixels, or the pixels of a wider image or of a part.
        sample_distance : float, optional
            In voxels; the renderer's own by default.
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
    """Create a renderer by name, importing only the libraries that it needs.

    Parameters
    ----------
    name : {"vtk", "raycast"}
    threads : int, optional
        Number of the ray caster's CPU threads, one per processor by default;
        ignored by VTK.

    Raises
    ------
    RenderError
        When the renderer cannot run on this machine.
    """
    if name == "vtk":
        from model.rendering.vtk_renderer import VtkRenderer

        return VtkRenderer(volume, lighting, light, sample_distance)
    if lighting == "path":
        from model.rendering.path_tracing.renderer import PathTracer

        return PathTracer(volume, light, sample_distance, threads=threads)
    from model.rendering.raycast.renderer import RaycastRenderer

    return RaycastRenderer(volume, lighting, light, sample_distance, threads=threads)


def smooth_distance(distance: float, lighting: Lighting) -> float:
    """Return the sample distance of the ray caster's final pictures, in voxels.

    Thin layers of a TF show rings where samples are half a voxel apart, in VTK's pictures, too.
    The ray caster's can do without, as close samples take little time.

    Parameters
    ----------
    distance : float
        Of VTK's pictures of the scene, of models' training images and of derivatives.
    lighting : {"none", "direct", "soft", "path"}
        Paths have no steps: it is kept.
    """
    return distance if lighting == "path" else distance / SMOOTH
