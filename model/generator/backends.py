"""Backends for a generator's decoder: torch, or OpenVINO on CPUs.

Torch computes the features of views and TFs; a backend decodes them into images. OpenVINO builds a
model for single images, and one for :data:`TOGETHER` images, on first use.
"""

import warnings
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from model.errors import TfscopeError, missing
from model.networks.generator_network import GeneratorNetwork
from model.networks.names import BackendName, Precision

Decode = Callable[..., tuple[Tensor, Tensor]]  # a function with the signature of `decode`

TOGETHER = 4
"""Images per call of OpenVINO: on 2 cores, 4 take less than 4 calls, 16 more than 4 of 4. Each
other number would take seconds to build."""


class Backend(NamedTuple):
    """Library that decodes images, and its precision."""

    name: BackendName
    precision: Precision = "float32"

    @property
    def text(self) -> str:
        """Name, with the precision unless it is float32."""
        return self.name if self.precision == "float32" else f"{self.name} {self.precision}"


EAGER = Backend("eager")  # Torch in float32, always available, and the reference for the other


def obstacle(backend: Backend, device: torch.device) -> str | None:
    """Return why a backend is unavailable, as a clause, or None."""
    if backend.name == EAGER.name:
        return None
    if (clause := missing("openvino")) is not None:
        return clause
    if device.type != "cpu":
        return "it runs on CPUs only"
    if backend.precision == "bfloat16" and not _knows_bfloat16():
        return "this CPU has no bfloat16"
    return None


def library_version(backend: Backend) -> str:
    """Return the version of the library behind a backend."""
    return version("torch" if backend.name == EAGER.name else backend.name)


@cache
def _openvino_core() -> Any:
    """Return the single OpenVINO core of this process, as two would crash it."""
    import openvino

    return openvino.Core()


@cache
def _knows_bfloat16() -> bool:
    return "BF16" in _openvino_core().get_property("CPU", "OPTIMIZATION_CAPABILITIES")


def candidates(device: torch.device) -> list[Backend]:
    """Return the backends that can be used here, torch last."""
    offered = Backend("openvino", "bfloat16"), Backend("openvino"), EAGER
    return [backend for backend in offered if obstacle(backend, device) is None]


def make_decode(network: GeneratorNetwork, backend: Backend, device: torch.device) -> Decode:
    """Return a function equivalent to the network's `decode` that uses a backend."""
    trouble = obstacle(backend, device)
    if trouble is not None:
        raise TfscopeError(f"The backend '{backend.name}' is not available: {trouble}.")
    if backend.name == "openvino":
        return _ForEachSize(lambda *inputs: _openvino(network, backend.precision, inputs))
    return network.decode


class _Decoding(nn.Module):
    """The decoder as a module of plain tensors, for conversion."""

    def __init__(self, network: GeneratorNetwork) -> None:
        super().__init__()
        self._network = network

    def forward(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        return self._network.decode(*features)


class _ForEachSize:
    """Decoder that builds a model of OpenVINO for single images, and one for several."""

    def __init__(self, make: Callable[..., Callable[..., list[Any]]]) -> None:
        self._make = make
        self._models: dict[int, Callable[..., list[Any]]] = {}

    def __call__(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        count = len(features[0])
        found: list[NDArray[np.float32]] = []
        for first in range(0, count, TOGETHER):
            drawn = self._draw(*(x[first : first + TOGETHER] for x in features))
            if not found:
                found = [np.empty((count, *part.shape[1:]), np.float32) for part in drawn]
            for images, part in zip(found, drawn, strict=True):
                # A copy, as OpenVINO may reuse its memory; without rows that only fill up.
                images[first : first + TOGETHER] = part[: count - first]
        image, opacity = map(torch.from_numpy, found)
        return image, opacity

    def _draw(self, *features: Tensor) -> list[Any]:
        """Decode at most :data:`TOGETHER` rows, filled up with the last one."""
        count = len(features[0])
        size = 1 if count == 1 else TOGETHER
        if count < size:
            rows = torch.arange(size).clamp(max=count - 1)
            features = tuple(x[rows] for x in features)
        if size not in self._models:
            self._models[size] = self._make(*features)
        return self._models[size](*(x.contiguous().numpy() for x in features))


def _openvino(
    network: GeneratorNetwork, precision: Precision, inputs: tuple[Tensor, ...]
) -> Callable[..., list[Any]]:
    from openvino.frontend import FrontEndManager
    from openvino.frontend.pytorch.ts_decoder import TorchScriptPythonDecoder

    # OpenVINO warns of torch functions that it uses itself, and of sizes that become constants, as
    # intended.
    with torch.inference_mode(False), torch.no_grad(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        example = tuple(x.clone() for x in inputs)
        # Manually: openvino.convert_model would send telemetry.
        decoder = TorchScriptPythonDecoder(_Decoding(network).eval(), example_input=example)
        reader = FrontEndManager().load_by_framework("pytorch")
        model = reader.convert(reader.load(decoder))
        shapes = [list(x.shape) for x in example]
        model.reshape(dict(zip(model.inputs, shapes, strict=True)))
    hints = {
        "INFERENCE_PRECISION_HINT": {"float32": "f32", "bfloat16": "bf16"}[precision],
        "PERFORMANCE_HINT": "LATENCY",
    }
    compiled = _openvino_core().compile_model(model, "CPU", hints)

    def run(*arrays: Any) -> list[Any]:
        return list(compiled(arrays).values())

    return run
