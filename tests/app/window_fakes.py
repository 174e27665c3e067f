"""Stand-ins for the engines: quick, and under the test's control."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ramp import make_tf, make_volume

from app.engines.engine import Engine
from app.engines.engines import Builders, GeneratorSettings, ReferenceSettings
from app.engines.messages import ImageRequest, Quality, Request, VisibilityRequest
from model.errors import NotOfferedError, VolumeError
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.view import View
from model.scene.volume import Volume

PATIENCE_S = 20


def make_request(sequence: int, live: bool = False) -> ImageRequest:
    return ImageRequest(sequence, SceneInputs.of(View(), make_tf()), Quality(8, live=live))


class FakeEngine:
    """Renders images whose red channel is the request's sequence number.

    With a gate it waits in every render until the test opens it.
    """

    def __init__(
        self,
        scene: Scene | None = None,
        gate: threading.Semaphore | None = None,
        description: str = "",
    ) -> None:
        self.scene = scene
        self.description = description
        self.gate = gate
        self.started = threading.Semaphore(0)
        self.requests: list[ImageRequest] = []
        self.others: list[Request] = []
        self.threads = [threading.current_thread()]
        self.closed = False
        self.error: Exception | None = None

    def image(self, request: ImageRequest) -> NDArray[np.float32]:
        self.threads.append(threading.current_thread())
        self.requests.append(request)
        self.started.release()
        if self.gate is not None:
            assert self.gate.acquire(timeout=PATIENCE_S)
        if self.error is not None:
            raise self.error
        image = np.zeros((request.quality.size, request.quality.size, 4), dtype=np.float32)
        image[..., 0] = request.sequence / 255
        image[..., 3] = 1.0
        return image

    def visibility(self, request: VisibilityRequest) -> NDArray[np.float32]:
        self.others.append(request)
        return np.full(256, request.sequence, dtype=np.float32)

    def _not_offered(self, request: Request) -> NDArray[np.float32]:
        self.others.append(request)
        raise NotOfferedError("The fake does not offer that.")

    images = region_sensitivity = value_sensitivity = latent_images = _not_offered

    def close(self) -> None:
        self.threads.append(threading.current_thread())
        self.closed = True


@dataclass
class FakeBuilders:
    """Builders whose volumes and engines the test can look at and break."""

    volumes: dict[str, Volume] = field(default_factory=lambda: {"ramp": make_volume()})
    scene: Scene | None = None
    generators: list[FakeEngine] = field(default_factory=list)
    references: list[FakeEngine] = field(default_factory=list)
    settings: list[ReferenceSettings] = field(default_factory=list)
    generator_error: Exception | None = None
    loading: threading.Event | None = None

    def make(self) -> Builders:
        return Builders(self.read_volume, self.reference, self.generator)

    def read_volume(self, path: Path) -> Volume:
        if path.stem not in self.volumes:
            raise VolumeError(f"{path}: the file is missing; choose another.")
        return self.volumes[path.stem]

    def reference(self, volume: Volume, settings: ReferenceSettings) -> Engine:
        self.settings.append(settings)
        self.references.append(FakeEngine())
        return self.references[-1]

    def generator(self, folder: Path, settings: GeneratorSettings) -> Engine:
        if self.loading is not None:
            assert self.loading.wait(PATIENCE_S)
        if self.generator_error is not None:
            raise self.generator_error
        scene = self.scene or Scene.of(self.volumes["ramp"], image_size=16)
        self.generators.append(FakeEngine(scene, description="CPU"))
        return self.generators[-1]
