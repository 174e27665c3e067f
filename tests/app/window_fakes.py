"""Stand-ins for the engines: quick, and under the test's control."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.engines import Builders, GeneratorSettings, ReferenceSettings
from app.messages import RenderRequest
from app.worker import Engine
from model.errors import VolumeError
from model.scene import Scene
from model.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.view import View
from model.volume import Volume

PATIENCE_S = 20


def make_volume(name: str = "ramp", top: float = 200.0) -> Volume:
    """Every value from 100 to `top`, none twice."""
    scalars = np.linspace(100.0, top, 6 * 5 * 4, dtype=np.float32).reshape(6, 5, 4)
    return Volume(scalars, name=name, units="K")


def make_tf(*means: float) -> TransferFunction:
    """Modes over 100..200, black to white."""
    modes = tuple(GaussianMode(mean, 8.0, 0.5) for mean in means or (130.0, 170.0))
    stops = ((100.0, 0.0, 0.0, 0.0), (150.0, 0.2, 0.6, 0.4), (200.0, 1.0, 1.0, 1.0))
    return TransferFunction(OpacityTF((100.0, 200.0), modes), ColorTF((100.0, 200.0), stops))


def make_request(sequence: int, live: bool = False) -> RenderRequest:
    return RenderRequest(sequence, View(), make_tf(), 8, live)


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
        self.requests: list[RenderRequest] = []
        self.threads = [threading.current_thread()]
        self.closed = False
        self.error: Exception | None = None

    def render(self, request: RenderRequest) -> NDArray[np.float32]:
        self.threads.append(threading.current_thread())
        self.requests.append(request)
        self.started.release()
        if self.gate is not None:
            assert self.gate.acquire(timeout=PATIENCE_S)
        if self.error is not None:
            raise self.error
        image = np.zeros((request.size, request.size, 4), dtype=np.float32)
        image[..., 0] = request.sequence / 255
        image[..., 3] = 1.0
        return image

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
