"""Backends for a generator's decoder: torch, compiled torch, or an inference library.

Torch computes the features of views and TFs; a backend decodes them into images.
Inference libraries build a model for each batch size when it first occurs.
"""

from __future__ import annotations

import importlib.util
import logging
import os
import shutil
import sysconfig
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast, get_args

import torch
from torch import Tensor, nn

from model.errors import DeviceError
from model.networks.generator_network import GeneratorNetwork

BackendName = Literal["eager", "compiled", "openvino", "onnxruntime"]
Precision = Literal["float32", "bfloat16"]
BACKENDS: tuple[BackendName, ...] = get_args(BackendName)

Decode = Callable[..., tuple[Tensor, Tensor]]
"""A function with the signature of :meth:`GeneratorNetwork.decode`."""

MODULES = {"openvino": ("openvino",), "onnxruntime": ("onnxruntime", "onnx", "onnxscript")}


class Backend(NamedTuple):
    """Library that decodes images, and its precision.

    Attributes
    ----------
    name : {"eager", "compiled", "openvino", "onnxruntime"}
    precision : {"float32", "bfloat16"}
    """

    name: BackendName
    precision: Precision = "float32"


EAGER = Backend("eager")
"""Torch in float32, always available, and the reference for the others."""


def obstacle(backend: Backend, device: torch.device) -> str | None:
    """Return the reason that a backend cannot be used here, as a clause, or None."""
    missing = [m for m in MODULES.get(backend.name, ()) if importlib.util.find_spec(m) is None]
    if missing:
        return f"{' and '.join(missing)} must be installed for it"
    if backend.name in MODULES and device.type != "cpu":
        return "it runs on the CPU only here"
    if backend.name == "onnxruntime" and backend.precision == "bfloat16":
        return "its convolutions know no bfloat16 on CPUs"
    if backend.name == "openvino" and backend.precision == "bfloat16" and not _knows_bfloat16():
        return "this CPU knows no bfloat16"
    if backend.name == "compiled" and device.type == "cpu":
        if shutil.which(os.environ.get("CXX", "g++")) is None:
            return "a C++ compiler must be installed for it"
        if not Path(sysconfig.get_paths()["include"], "Python.h").exists():
            return "Python's header files must be installed for it"
    return None


def library_version(backend: Backend) -> str:
    """Return the version of the library behind a backend."""
    return version(MODULES.get(backend.name, ("torch",))[0])


@cache
def _openvino_core() -> Any:
    """Return the single OpenVINO core of this process.

    Each core installs an alternate signal stack in its thread and restores the
    previous one when it ends. If two cores end in the order of their creation, the
    thread keeps a freed stack, and Ctrl-C causes a segmentation fault.
    """
    import openvino

    return openvino.Core()


@cache
def _knows_bfloat16() -> bool:
    return "BF16" in _openvino_core().get_property("CPU", "OPTIMIZATION_CAPABILITIES")


def choose_backends(name: str, precision: str, device: torch.device) -> list[Backend]:
    """Return the backend of a name, or for "auto" all candidates worth timing here.

    Compilation takes most of a minute and has not been faster than the libraries
    (``python main.py bench generator``), so "auto" excludes it; on GPUs nothing has been
    measured yet, and torch is used.

    Returns
    -------
    list of Backend
        At least one; for "auto", torch last.

    Raises
    ------
    DeviceError
        When the backend or the precision is unknown.
    """
    if precision not in get_args(Precision):
        names = ", ".join(get_args(Precision))
        raise DeviceError(f"The precision '{precision}' is unknown; choose {names}.")
    digits = cast(Precision, precision)
    if name == "auto":
        libraries = [Backend(library, digits) for library in ("openvino", "onnxruntime")]
        there = [backend for backend in libraries if obstacle(backend, device) is None]
        return [*there, Backend("eager", digits)]
    if name not in BACKENDS:
        names = ", ".join(BACKENDS)
        raise DeviceError(f"The backend '{name}' is unknown; choose auto, {names}.")
    return [Backend(name, digits)]


def make_decode(network: GeneratorNetwork, backend: Backend, device: torch.device) -> Decode:
    """Return a function equivalent to the network's `decode` that uses a backend.

    Parameters
    ----------
    network : GeneratorNetwork
        In evaluation mode, on the device.
    backend : Backend
    device : torch.device

    Raises
    ------
    DeviceError
        When the backend cannot be used here.
    """
    trouble = obstacle(backend, device)
    if trouble is not None:
        names = ", ".join(b for b in BACKENDS if obstacle(Backend(b), device) is None)
        raise DeviceError(f"The backend '{backend.name}' is not there: {trouble}; choose {names}.")
    if backend.name == "openvino":
        return _ForEachSize(lambda *inputs: _openvino(network, backend.precision, inputs))
    if backend.name == "onnxruntime":
        return _ForEachSize(lambda *inputs: _onnxruntime(network, inputs))
    decode: Decode = network.decode
    if backend.name == "compiled":
        # On GPUs this mode replays CUDA graphs.
        mode = "reduce-overhead" if device.type == "cuda" else "default"
        decode = torch.compile(network.decode, dynamic=False, mode=mode)
    return _rounded(decode, device) if backend.precision == "bfloat16" else decode


class _Decoding(nn.Module):
    """The decoder as a module of plain tensors, for conversion by libraries."""

    def __init__(self, network: GeneratorNetwork) -> None:
        super().__init__()
        self._network = network

    def forward(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        return self._network.decode(*features)


class _ForEachSize:
    """Decoder that builds a library's model for each batch size."""

    def __init__(self, make: Callable[..., Callable[..., list[Any]]]) -> None:
        self._make = make
        self._models: dict[int, Callable[..., list[Any]]] = {}

    def __call__(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        count = len(features[0])
        if count not in self._models:
            self._models[count] = self._make(*features)
        image, opacity = self._models[count](*(x.contiguous().numpy() for x in features))
        # The library may reuse its memory.
        return torch.from_numpy(image.copy()), torch.from_numpy(opacity.copy())


@contextmanager
def _reading() -> Iterator[None]:
    """Context for conversion of a network by libraries, without gradients and warnings.

    The libraries warn of deprecated torch functions, which they use themselves, and
    of sizes that become constants, which is intended.
    """
    torch_log = logging.getLogger("torch.onnx")
    level = torch_log.level
    torch_log.setLevel(logging.ERROR)
    try:
        with torch.inference_mode(False), torch.no_grad(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        torch_log.setLevel(level)


def _openvino(
    network: GeneratorNetwork, precision: Precision, inputs: tuple[Tensor, ...]
) -> Callable[..., list[Any]]:
    from openvino.frontend import FrontEndManager
    from openvino.frontend.pytorch.ts_decoder import TorchScriptPythonDecoder

    with _reading():
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


def _onnxruntime(network: GeneratorNetwork, inputs: tuple[Tensor, ...]) -> Callable[..., list[Any]]:
    import onnxruntime

    with _reading():
        example = tuple(x.clone() for x in inputs)
        program = torch.onnx.export(_Decoding(network).eval(), example, dynamo=True, verbose=False)
    assert program is not None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = torch.get_num_threads()
    session = onnxruntime.InferenceSession(
        program.model_proto.SerializeToString(), options, providers=["CPUExecutionProvider"]
    )
    names = [port.name for port in session.get_inputs()]

    def run(*arrays: Any) -> list[Any]:
        found: list[Any] = session.run(None, dict(zip(names, arrays, strict=True)))
        return found

    return run


def _rounded(decode: Decode, device: torch.device) -> Decode:
    """Return a decoder that runs under torch's autocast to bfloat16."""

    def rounded(*features: Tensor) -> tuple[Tensor, Tensor]:
        with torch.autocast(device.type, torch.bfloat16):
            image, opacity = decode(*features)
        return image.float(), opacity.float()

    return rounded
