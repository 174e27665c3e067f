"""Speed of a generator with each backend, and differences from torch in float32."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils.benchmark import Timer

from model.errors import first_line
from model.generator.backends import BACKENDS, EAGER, Backend, make_decode, obstacle
from model.networks.blocks import place
from model.networks.encoding import EncodedInputs
from model.networks.generator_network import GeneratorNetwork
from model.networks.names import BackendName
from model.samples.sampling import draw_sample
from model.scene.scene import Scene

BATCHES = (1, 16)
"""Batch sizes: the window's image, and the latent browser's grid."""

SECONDS = 2.0
"""Least duration of each measurement."""


@dataclass(frozen=True)
class BackendRow:
    """Measurements of one backend at one batch size.

    Attributes
    ----------
    seconds : float or None
        Median time per batch; None if the backend cannot be used here.
    speedup : float or None
        Speedup over torch in float32.
    difference : float or None
        Largest difference from torch's images in float32, in steps of 1/255.
    obstacle : str or None
        Reason that the backend cannot be used.
    """

    backend: str
    precision: str
    batch: int
    seconds: float | None = None
    speedup: float | None = None
    difference: float | None = None
    obstacle: str | None = None


@dataclass(frozen=True)
class PartsRow:
    """Median times, in seconds, of the encoders whose results are cached between images.

    Attributes
    ----------
    features : float
        Codes of view and TFs.
    """

    batch: int
    features: float


@torch.inference_mode()
def compare_backends(
    network: GeneratorNetwork,
    scene: Scene,
    device: torch.device,
    seconds: float = SECONDS,
    names: Sequence[BackendName] = BACKENDS,
) -> Iterator[BackendRow]:
    """Time all backends on the same views and TFs.

    Parameters
    ----------
    scene : Scene
        Views and TFs are those of its first hold-out samples.
    seconds : float
        Least duration of a measurement.
    names : sequence of str
        Backends to time besides torch.

    Yields
    ------
    BackendRow
        For each batch size, torch in float32 first.
    """
    network = place(network, device).eval()
    for batch in BATCHES:
        features = network.features(_inputs(batch, scene, device))
        truth = network.decode(*features)
        eager: float | None = None
        for backend in _backends(names):
            trouble = obstacle(backend, device)
            if trouble is not None:
                yield BackendRow(*backend, batch, obstacle=trouble)
                continue
            try:
                decode = make_decode(network, backend, device)
                # Libraries convert the network for the first image, which is not timed.
                found = [part.clone() for part in decode(*features)]
            except Exception as error:
                if backend == EAGER:
                    raise
                yield BackendRow(*backend, batch, obstacle=f"it failed ({first_line(error)})")
                continue
            duration = _time(decode, features, seconds)
            eager = eager or duration
            worst = max(_difference(a, b) for a, b in zip(found, truth, strict=True))
            yield BackendRow(*backend, batch, duration, eager / duration, worst)


@torch.inference_mode()
def time_parts(
    network: GeneratorNetwork, scene: Scene, device: torch.device, seconds: float = SECONDS
) -> list[PartsRow]:
    """Time what comes before the backend, at each batch size."""
    network = place(network, device).eval()
    return [
        PartsRow(batch, _time(network.features, (_inputs(batch, scene, device),), seconds / 4))
        for batch in BATCHES
    ]


def _backends(names: Sequence[BackendName]) -> list[Backend]:
    others = [Backend(name) for name in names if name != EAGER.name]
    return [EAGER, *others, *(b._replace(precision="bfloat16") for b in [EAGER, *others])]


def _inputs(batch: int, scene: Scene, device: torch.device) -> EncodedInputs:
    """Inputs of the first hold-out samples."""
    samples = [draw_sample(scene, 0, "holdout", i) for i in range(batch)]
    return EncodedInputs.of(samples, scene).map(lambda tensor: tensor.to(device))


def _time(function: Callable[..., Any], arguments: tuple[Any, ...], seconds: float) -> float:
    """Median duration of a call in seconds."""
    timer = Timer(
        "function(*arguments)",
        globals={"function": function, "arguments": arguments},
        num_threads=torch.get_num_threads(),
    )
    return float(timer.blocked_autorange(min_run_time=seconds).median)


def _difference(image: Tensor, truth: Tensor) -> float:
    """Largest difference of images in [-1, 1], in steps of 1/255."""
    return float((image - truth).abs().max()) * 255 / 2
