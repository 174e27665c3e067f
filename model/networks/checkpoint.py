"""The model folder: weights as safetensors, everything else as JSON.

``model.json`` names the weights' file and its SHA-256 and is written last, so a folder holds either
the old model or the new one, never a mixture. Loading only reads data and executes no code.
"""

import hashlib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import safetensors
import safetensors.torch
import torch
from torch import Tensor, nn
from torch.overrides import TorchFunctionMode

from model.errors import CheckpointError, os_errors_as
from model.files import write_atomically
from model.networks.card import ModelCard, card_of, read_header, read_weights, write_header
from model.networks.generator_network import GeneratorNetwork
from model.networks.paper import build_generator
from model.scene.scene import FORMAT_VERSION

_N = TypeVar("_N", bound=nn.Module)


def save_model(folder: Path, card: ModelCard, network: GeneratorNetwork) -> None:
    """Write a model folder in half precision, or raise :class:`CheckpointError`."""
    weights = {name: half_precision(value) for name, value in network.state_dict().items()}
    content = safetensors.torch.save(weights)
    digest = hashlib.sha256(content).hexdigest()
    name = f"generator-{digest[:12]}.safetensors"
    what = f"{folder}: the model cannot be written"
    with os_errors_as(CheckpointError, what, "choose another folder"):
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(folder / name, content)
        write_header(
            folder,
            {"tfscope_model": FORMAT_VERSION, "weights": name, "sha256": digest, **asdict(card)},
        )
        for old in folder.glob("generator-*.safetensors"):
            if old.name != name:
                old.unlink()


def load_model(folder: Path) -> tuple[ModelCard, GeneratorNetwork]:
    """Read a model folder in evaluation mode, float32, on the CPU, or raise `CheckpointError`."""
    header = read_header(folder)
    card = card_of(folder, header)
    content = read_weights(folder, header)
    path = folder / str(header["weights"])
    try:
        weights = safetensors.torch.load(content)
    except safetensors.SafetensorError as error:
        raise CheckpointError(
            f"{path}: the file is not safetensors ({error}); copy it again."
        ) from error
    return card, network_with(path, weights, lambda: build_generator(card.size, card.scene))


class _NoNumbers(TorchFunctionMode):
    """Skips the initialization of weights, for which torch imports its compiler for a second."""

    def __torch_function__(self, func: Any, _types: Any, args: Any = (), kwargs: Any = None) -> Any:
        kwargs = kwargs or {}
        if getattr(func, "__name__", "") in ("normal_", "uniform_", "kaiming_uniform_"):
            return args[0] if args else kwargs["tensor"]
        return func(*args, **kwargs)


def network_with(path: Path, weights: dict[str, Tensor], build: Callable[[], _N]) -> _N:
    """Build a network with a file's weights, in float32, for inference."""
    # Without memory: a card may claim a network of many gigabytes.
    with torch.device("meta"), _NoNumbers():
        network = build()
    check_weights(path, weights, network.state_dict())
    full = {name: v.float() if v.is_floating_point() else v for name, v in weights.items()}
    network.load_state_dict(full, assign=True)
    return network.eval().requires_grad_(False)


def half_precision(value: Tensor) -> Tensor:
    """Convert to half precision unless the tensor is not floating point or would overflow."""
    value = value.detach().cpu().contiguous()
    if not value.is_floating_point():
        return value
    half = value.to(torch.float16)
    return half if torch.isfinite(half).all() else value


def check_weights(path: Path, weights: dict[str, Tensor], expected: dict[str, Tensor]) -> None:
    """Raise :class:`CheckpointError` unless names and shapes match and values are finite."""
    missing = sorted(expected.keys() - weights.keys())
    foreign = sorted(weights.keys() - expected.keys())
    if missing or foreign:
        name = (missing or foreign)[0]
        raise CheckpointError(
            f"{path}: the weights belong to another network "
            f"('{name}' is {'missing' if missing else 'unknown'}); copy the folder again."
        )
    for name, value in weights.items():
        if value.shape != expected[name].shape:
            raise CheckpointError(
                f"{path}: the weights belong to a network of another size "
                f"('{name}' is {tuple(value.shape)}, not {tuple(expected[name].shape)})."
            )
        if value.is_floating_point() and not torch.isfinite(value).all():
            raise CheckpointError(
                f"{path}: '{name}' holds NaN or infinite weights; "
                "the training went wrong, so use an earlier model."
            )
