"""The engines behind the two images, and how each is built in its worker thread.

The heavy libraries (VTK, torch) are imported only there: the window appears
before they are loaded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.engines.messages import RenderRequest
from app.engines.worker import Engine
from model.scene.light import LightDirection
from model.scene.scene import Lighting, RendererName, Scene
from model.scene.volume import Volume

if TYPE_CHECKING:
    from model.generator.backends import BackendName
    from model.generator.generator import Generator
    from model.rendering.renderer import Renderer

LIVE_COARSENESS = 4.0
"""How much farther apart a live image's samples lie along the rays."""

BACKEND_NAMES: dict[BackendName, str] = {
    "eager": "",
    "compiled": "compiled",
    "openvino": "OpenVINO",
    "onnxruntime": "ONNX Runtime",
}

LIVE_MAX_SIZE = 256
"""Largest live image, pixels; a larger one is rendered at half its size."""


@dataclass(frozen=True)
class ReferenceSettings:
    """How the reference image is rendered.

    Attributes
    ----------
    lighting : {"none", "direct", "global"}
    light : LightDirection or None
    sample_distance : float
        Of the final image, in voxels.
    renderer : {"vtk", "raycast"}
    """

    lighting: Lighting = "none"
    light: LightDirection | None = None
    sample_distance: float = 0.5
    renderer: RendererName = "vtk"

    @classmethod
    def of(cls, scene: Scene) -> ReferenceSettings:
        """The lighting and sample distance that a generator's training images have."""
        return cls(scene.lighting, scene.light, scene.sample_distance)


@dataclass(frozen=True)
class GeneratorSettings:
    """How generators are run.

    Attributes
    ----------
    device : str
        "auto", "cpu" or "cuda".
    backend : str
        What draws: "eager", "compiled", "openvino", "onnxruntime", or "auto"; see
        :func:`model.generator.backends.choose_backends`.
    precision : str
        "float32" or "bfloat16".
    """

    device: str = "auto"
    backend: str = "auto"
    precision: str = "float32"


FASTEST = GeneratorSettings()


@dataclass(frozen=True)
class Builders:
    """The three calls that do the work; tests put fakes in their place."""

    read_volume: Callable[[Path], Volume]
    reference: Callable[[Volume, ReferenceSettings], Engine]
    generator: Callable[[Path, GeneratorSettings], Engine]


class ReferenceEngine:
    """VTK or the ray caster as an engine: coarser while live."""

    description = ""
    scene = None

    def __init__(self, renderer: Renderer, sample_distance: float) -> None:
        self._renderer = renderer
        self._sample_distance = sample_distance

    def render(self, request: RenderRequest) -> NDArray[np.float32]:
        """Render at the request's size, or half of it while live."""
        coarseness = LIVE_COARSENESS if request.live else 1.0
        halve = request.live and request.size > LIVE_MAX_SIZE
        size = request.size // 2 if halve else request.size
        return self._renderer.render(request.inputs, size, self._sample_distance * coarseness)

    def close(self) -> None:
        """Free the OpenGL context, or the threads."""
        self._renderer.close()


class GeneratorEngine:
    """A trained generator as an engine: the same image, live or final."""

    def __init__(self, generator: Generator) -> None:
        self._generator = generator

    @property
    def description(self) -> str:
        """The device and the backend in people's words."""
        device = {"cpu": "CPU", "cuda": "GPU"}.get(self._generator.device.type, "")
        name, precision = self._generator.backend
        words = [device, BACKEND_NAMES[name], "" if precision == "float32" else precision]
        return ", ".join(filter(None, words))

    @property
    def scene(self) -> Scene:
        """The scene that the generator was trained for."""
        return self._generator.scene

    def render(self, request: RenderRequest) -> NDArray[np.float32]:
        """Generate the image at the size that the generator was trained for."""
        return self._generator.render(request.inputs)

    def close(self) -> None:
        """Nothing to free: the weights go with the object."""


def _read_volume(path: Path) -> Volume:
    from model.volume_files import read_volume

    return read_volume(path)


def _reference_engine(volume: Volume, settings: ReferenceSettings) -> Engine:
    from model.rendering.renderer import open_renderer

    renderer = open_renderer(
        settings.renderer, volume, settings.lighting, settings.light, settings.sample_distance
    )
    return ReferenceEngine(renderer, settings.sample_distance)


def _generator_engine(folder: Path, settings: GeneratorSettings) -> Engine:
    from model.generator.generator import Generator

    return GeneratorEngine(
        Generator.load(folder, settings.device, settings.backend, settings.precision)
    )


REAL_BUILDERS = Builders(_read_volume, _reference_engine, _generator_engine)
