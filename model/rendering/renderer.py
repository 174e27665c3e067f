"""What every renderer does, and the one that a scene asks for."""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting, RendererName
from model.scene.volume import Volume


class Renderer(Protocol):
    """Renders images of one volume under one lighting.

    Attributes
    ----------
    sample_distance : float
        Distance between samples along a ray, in voxels.
    """

    sample_distance: float

    def render(
        self, inputs: SceneInputs, size: int, sample_distance: float | None = None
    ) -> NDArray[np.float32]:
        """Render RGBA, float32 (size, size, 4) in [0, 1], premultiplied, row 0 at the top.

        Parameters
        ----------
        inputs : SceneInputs
        size : int
            Width and height in pixels.
        sample_distance : float, optional
            Instead of the renderer's own.
        """

    def close(self) -> None:
        """Free what the renderer holds."""


def open_renderer(
    name: RendererName,
    volume: Volume,
    lighting: Lighting = "none",
    light: LightDirection | None = None,
    sample_distance: float = 0.5,
    threads: int | None = None,
    device: Literal["cpu", "cuda"] = "cpu",
) -> Renderer:
    """Open a renderer by its name; only the libraries that it needs are loaded.

    Parameters
    ----------
    name : {"vtk", "raycast"}
    volume, lighting, light, sample_distance
        See :class:`model.scene.scene.Scene`.
    threads : int, optional
        CPU threads of the ray caster, one per processor by default; VTK takes
        what OpenGL gives it.
    device : {"cpu", "cuda"}
        Where the ray caster runs.

    Raises
    ------
    RenderError
        When the machine cannot run it.
    """
    if name == "vtk":
        from model.rendering.vtk_renderer import VtkRenderer

        return VtkRenderer(volume, lighting, light, sample_distance)
    from model.rendering.raycast.renderer import RaycastRenderer

    return RaycastRenderer(volume, lighting, light, sample_distance, threads=threads, device=device)
