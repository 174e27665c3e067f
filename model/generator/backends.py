"""Backends for a generator's decoder: torch, compiled torch, or an inference library.

Torch computes the features of views and TFs; a backend decodes them into images.
Inference libraries build a model for each batch size when it first occurs: for single images, and
for :data:`TOGETHER` of them, which more are divided into.
"""

from __future__ import annotations

import importlib.util
import locale
import logging
import os
import shutil
import sysconfig
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, cast, get_args

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from model.errors import DeviceError
from model.networks.generator_network import GeneratorNetwork
from model.networks.names import BackendName, Precision, PrecisionChoice

BACKENDS: tuple[BackendName, ...] = get_args(BackendName)

Decode = Callable[..., tuple[Tensor, Tensor]]
"""A function with the signature of :meth:`GeneratorNetwork.decode`."""

TOGETHER = 4
"""Images that are one call of an inference library.

On 2 cores, 4 of the paper's networks' images take less than 4 calls, and 16 of them in one call
more than in 4. Each other number would take seconds
to build.
"""

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

    @property
    def text(self) -> str:
        """Name, and the precision if it is another than float32."""
        return self.name if self.precision == "float32" else f"{self.name} {self.precision}"


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

    Compilation takes most of a minute and has not been faster than the libraries,
    so "auto" excludes it; on GPUs nothing has been
    measured yet, and torch is used.

    Parameters
    ----------
    name : str
        One of :data:`BACKENDS`, or "auto".
    precision : {"auto", "float32", "bfloat16"}
        "auto" may take bfloat16 of libraries, which rounds images by some 1/255: a network's own
        error is many times that.

    Returns
    -------
    list of Backend
        At least one; for "auto", torch in float32 last.

    Raises
    ------
    DeviceError
        When the backend or the precision is unknown.
    """
    if precision not in get_args(PrecisionChoice):
        names = ", ".join(get_args(PrecisionChoice))
        raise DeviceError(f"The precision '{precision}' is unknown; choose {names}.")
    if name != "auto" and name not in BACKENDS:
        names = ", ".join(BACKENDS)
        raise DeviceError(f"The backend '{name}' is unknown; choose auto, {names}.")
    digits: Precision = "bfloat16" if precision == "bfloat16" else "float32"
    rounded: list[Precision] = ["bfloat16"] if precision == "auto" else []
    libraries = ["openvino", "onnxruntime"] if name == "auto" else [name]
    found = [
        Backend(cast(BackendName, library), each)
        for library in libraries
        if library != EAGER.name
        for each in (*(rounded if library in MODULES else ()), digits)
    ]
    if name not in ("auto", EAGER.name):
        # What cannot be had is said when it is made; a rounded one is only an offer.
        return [b for b in found if b.precision == digits or obstacle(b, device) is None]
    there = [backend for backend in found if obstacle(backend, device) is None]
    return [*there, Backend("eager", digits)]


def make_decode(network: GeneratorNetwork, backend: Backend, device: torch.device) -> Decode:
    """Return a function equivalent to the network's `decode` that uses a backend.

    Parameters
    ----------
    network : GeneratorNetwork
        In evaluation mode, on the device.

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
        _read_utf8()
        decode = torch.compile(network.decode, dynamic=False, mode=mode)
    return _rounded(decode, device) if backend.precision == "bfloat16" else decode


def _read_utf8() -> None:
    """Have text files read as UTF-8, where another library has left the locale at plain ASCII.

    Torch's compiler reads sources of its own in the locale's encoding, which are not plain ASCII.
    """
    if locale.getencoding().upper().replace("-", "") != "UTF8":
        with suppress(locale.Error):
            locale.setlocale(locale.LC_CTYPE, "C.UTF-8")


class _Decoding(nn.Module):
    """The decoder as a module of plain tensors, for conversion by libraries."""

    def __init__(self, network: GeneratorNetwork) -> None:
        super().__init__()
        self._network = network

    def forward(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        return self._network.decode(*features)


class _ForEachSize:
    """Decoder that builds a library's model for single images, and one for several."""

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
                # A copy, as the library may reuse its memory; of filled up rows it has more.
                images[first : first + TOGETHER] = part[: count - first]
        image, opacity = map(torch.from_numpy, found)
        return image, opacity

    def _draw(self, *features: Tensor) -> list[Any]:
        """Decode at most :data:`TOGETHER` rows; those that are missing are the last one again."""
        count = len(features[0])
        size = 1 if count == 1 else TOGETHER
        if count < size:
            rows = torch.arange(size).clamp(max=count - 1)
            features = tuple(x[rows] for x in features)
        if size not in self._models:
            self._models[size] = self._make(*features)
        return self._models[size](*(x.contiguous().numpy() for x in features))


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
