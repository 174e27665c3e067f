"""How fast a generator draws by each backend, and how far from torch in float32."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils.benchmark import Timer

from model.errors import first_line
from model.generator.backends import BACKENDS, EAGER, Backend, BackendName, make_decode, obstacle
from model.networks.blocks import place
from model.networks.encoding import EncodedInputs
from model.networks.generator_network import GeneratorNetwork
from model.samples.sampling import draw_sample
from model.scene.scene import Scene

BATCHES = (1, 16)
"""The window's image, and the latent browser's grid."""

SECONDS = 2.0
"""Time that each measurement gets, at least."""


@dataclass(frozen=True)
class BackendRow:
    """One backend at one batch size.

    Attributes
    ----------
    backend : str
    precision : str
    batch : int
    seconds : float or None
        Median time of a batch; None where the backend cannot be used here.
    speedup : float or None
        Over torch in float32.
    difference : float or None
        Largest difference from its images, in steps of 1/255.
    obstacle : str or None
        Why it cannot be used.
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
    """Median seconds of what is kept between images.

    Attributes
    ----------
    batch : int
    view : float
        What the view alone decides; kept while TFs are edited.
    opacity_tf, color_tf : float
        Codes of the TFs; kept while the view moves.
    """

    batch: int
    view: float
    opacity_tf: float
    color_tf: float


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
    network : GeneratorNetwork
    scene : Scene
        Views and TFs are its first hold-out samples.
    device : torch.device
    seconds : float
        Least time of a measurement.
    names : sequence of str
        Backends to time beside torch.

    Yields
    ------
    BackendRow
        For each batch size, torch in float32 first.
    """
    network = place(network, device).eval()
    for batch in BATCHES:
        conditions, opacity_tf, color_tf = _inputs(batch, scene, device)
        view_features = network.encode_view(conditions)
        latent, color = network.opacity.encode(opacity_tf), network.encode_color(color_tf)
        truth = network.decode(view_features, latent, color)
        eager: float | None = None
        for backend in _backends(names):
            trouble = obstacle(backend, device)
            if trouble is not None:
                yield BackendRow(*backend, batch, obstacle=trouble)
                continue
            try:
                decode = make_decode(network, backend, device)
                # Libraries read the network when they first draw: that is not timed.
                found = [part.clone() for part in decode(view_features, latent, color)]
            except Exception as error:
                if backend == EAGER:
                    raise
                yield BackendRow(*backend, batch, obstacle=f"it failed ({first_line(error)})")
                continue
            duration = _time(decode, (view_features, latent, color), seconds)
            eager = eager or duration
            worst = max(_difference(a, b) for a, b in zip(found, truth, strict=True))
            yield BackendRow(*backend, batch, duration, eager / duration, worst)


@torch.inference_mode()
def time_parts(
    network: GeneratorNetwork, scene: Scene, device: torch.device, seconds: float = SECONDS
) -> list[PartsRow]:
    """Time what the generator keeps between images, at each batch size."""
    network = place(network, device).eval()
    rows = []
    for batch in BATCHES:
        conditions, opacity_tf, color_tf = _inputs(batch, scene, device)
        parts: list[tuple[Callable[..., Any], Tensor]] = [
            (network.encode_view, conditions),
            (network.opacity.encode, opacity_tf),
            (network.encode_color, color_tf),
        ]
        rows.append(PartsRow(batch, *(_time(f, (x,), seconds / 4) for f, x in parts)))
    return rows


def _backends(names: Sequence[BackendName]) -> list[Backend]:
    others = [Backend(name) for name in names if name != EAGER.name]
    return [EAGER, *others, *(b._replace(precision="bfloat16") for b in [EAGER, *others])]


def _inputs(batch: int, scene: Scene, device: torch.device) -> EncodedInputs:
    """The first hold-out samples' inputs."""
    samples = [draw_sample(scene, 0, "holdout", i) for i in range(batch)]
    return EncodedInputs.of(samples, scene).map(lambda tensor: tensor.to(device))


def _time(function: Callable[..., Any], arguments: tuple[Any, ...], seconds: float) -> float:
    """Median time of a call."""
    timer = Timer(
        "function(*arguments)",
        globals={"function": function, "arguments": arguments},
        num_threads=torch.get_num_threads(),
    )
    return float(timer.blocked_autorange(min_run_time=seconds).median)


def _difference(image: Tensor, truth: Tensor) -> float:
    """Largest difference of images in [-1, 1], in steps of 8 bits."""
    return float((image - truth).abs().max()) * 255 / 2
