"""How a picture is drawn: what is traded for its time, and the renderers that draw at settings."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.rendering.renderer import Renderer, open_renderer
from model.rendering.resizing import enlarged, resized
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting, RendererName
from model.scene.volume import Volume

if TYPE_CHECKING:
    from model.rendering.path_tracing.cleaning import Cleaning
    from model.rendering.path_tracing.renderer import PathTracer

FINEST_DISTANCE = 1 / 64
"""Sample distance of the exact picture, in voxels; the volume is read at every fourth sample."""

SMOOTH = 5
"""Samples of the ray caster's final pictures for each one of what they are compared with."""

EXACT_SAMPLES = 1024
"""Samples of each pixel of the exact picture in path-traced light."""

EXACT_SEED = 1
"""Of the exact picture's paths: other random numbers than those of what it is compared with."""


Others = Mapping[str, Callable[[SceneInputs, Raster], NDArray[np.float32]]]
"""Others that draw, beside VTK, the ray caster and the path tracer."""


@dataclass(frozen=True)
class Setting:
    """Everything about a picture's drawing that trades accuracy for time.

    Attributes
    ----------
    renderer : {"vtk", "raycast"}
        The path tracer stands in the ray caster's place in path-traced light.
    sample_distance : float
        Along view rays, in voxels.
    pixels : float
        Drawn for each pixel shown, above 0 and at most 1; the rest is interpolated.
    samples : int
        Of each pixel in path-traced light.
    denoised : bool
        Whether a path-traced picture is cleaned while that brings it nearer.
    other : str
        Name of who else draws: a network, or the ray caster with a compressed volume. Nothing of
        the above counts then. Empty for the renderer.
    """

    renderer: RendererName = "raycast"
    sample_distance: float = 0.5
    pixels: float = 1.0
    samples: int = 1
    denoised: bool = False
    other: str = ""

    @classmethod
    def exact(cls, lighting: Lighting = "none") -> Setting:
        """Return the setting that errors under a lighting are measured against."""
        if lighting == "path":
            return cls(samples=EXACT_SAMPLES)
        return cls(sample_distance=FINEST_DISTANCE)

    def raster(self, shown: Raster) -> Raster:
        """Return the pixels that are drawn where others are shown, or a part of them."""
        if self.pixels == 1:
            return shown
        whole = shown.scaled(self.pixels**0.5)
        left, columns = _covering(shown.left, shown.right, shown.width, whole.width)
        top, rows = _covering(shown.top, shown.bottom, shown.height, whole.height)
        return replace(whole, left=left, top=top, columns=columns, rows=rows)

    def text(self, lighting: Lighting) -> str:
        """Say what it is under a lighting, in few words."""
        if self.other:
            words = [self.other]
        elif lighting == "path":
            words = [f"path tracer, {self.samples} sample{'s' * (self.samples > 1)}"]
        else:
            name = "VTK" if self.renderer == "vtk" else "ray caster"
            words = [f"{name}, {self.sample_distance:g} voxels"]
        if self.denoised:
            words.append("denoised")
        if self.pixels != 1:
            words.append(f"1 of {1 / self.pixels:g} pixels")
        return ", ".join(words)


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


class SettingRenderer:
    """Draws one volume under one lighting at any setting.

    Parameters
    ----------
    volume, lighting, light
        See :func:`model.rendering.renderer.open_renderer`.
    threads : int, optional
        Of the ray caster and the path tracer, one per processor by default.
    cleaning : callable, optional
        Gives what denoises path-traced pictures; without it none can be denoised.
    others : mapping of str to callable, optional
        Who else draws, by name: a function of inputs and raster, which may return an image of
        another size.
    """

    def __init__(
        self,
        volume: Volume,
        lighting: Lighting = "none",
        light: LightDirection | None = None,
        threads: int | None = None,
        cleaning: Cleaning | None = None,
        others: Others | None = None,
    ) -> None:
        self.cleaning = cleaning
        self._others = others or {}
        self._volume, self._lighting, self._light = volume, lighting, light
        self._threads = threads
        self._renderers: dict[tuple[Any, ...], Renderer] = {}

    def draw(
        self, setting: Setting, inputs: SceneInputs, shown: Raster
    ) -> tuple[NDArray[np.float32], float]:
        """Draw a picture.

        Parameters
        ----------
        shown : Raster
            Pixels that are shown, or a part of them.

        Returns
        -------
        rgba : ndarray of float32, shape (rows, columns, 4)
            With all pixels that are shown.
        seconds : float
            To draw it, without the interpolation of pixels, which a screen does.
        """
        if setting.other:
            start = time.perf_counter()
            drawn = self._others[setting.other](inputs, shown)
            seconds = time.perf_counter() - start
            return resized(drawn, (shown.rows, shown.columns)), seconds
        renderer = self._renderer(setting)
        raster = setting.raster(shown)
        start = time.perf_counter()
        drawn = renderer.render(inputs, raster, setting.sample_distance)
        seconds = time.perf_counter() - start
        return enlarged(drawn, raster, shown), seconds

    def close(self) -> None:
        """Release the renderers; none can be used afterwards."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers.clear()

    def tracer(self, samples: int = 1, seed: int = 0) -> PathTracer:
        """Return the path tracer; the caller closes it."""
        from model.rendering.path_tracing.renderer import PathTracer

        return PathTracer(
            self._volume, self._light, samples=samples, seed=seed, threads=self._threads
        )

    def _renderer(self, setting: Setting) -> Renderer:
        is_path = self._lighting == "path"
        samples = setting.samples if is_path else 0
        key = setting.renderer, setting.denoised, samples
        known = self._renderers.get(key)
        if known is None:
            if is_path:
                from model.rendering.path_tracing.refinement import RefiningRenderer

                seed = EXACT_SEED if setting == Setting.exact("path") else 0
                cleaning = self.cleaning if setting.denoised else None
                known = RefiningRenderer(self.tracer(samples, seed), cleaning, samples)
            else:
                known = open_renderer(
                    setting.renderer,
                    self._volume,
                    self._lighting,
                    self._light,
                    threads=self._threads,
                )
            self._renderers[key] = known
        return known


def _covering(first: int, end: int, shown: int, drawn: int) -> tuple[int, int]:
    """Return the first and the number of the drawn pixels that some shown ones lie between."""
    low = max(math.floor((first + 0.5) * drawn / shown - 0.5), 0)
    high = min(math.floor((end - 0.5) * drawn / shown - 0.5) + 2, drawn)
    return low, high - low
