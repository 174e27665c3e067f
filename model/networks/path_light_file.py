"""The file of the network behind the denoiser: safetensors, with its size and history as metadata.

Reading it only reads data and executes no code.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch

from model.errors import CheckpointError, reason
from model.files import write_atomically
from model.networks.checkpoint import half_precision, network_with
from model.networks.path_light_network import PathLightNetwork, PathLightSize

FORMAT = "tfscope_path_light"
VERSION = 1


@dataclass(frozen=True)
class PathLightCard:
    """All that is known about a network behind the denoiser besides its weights.

    Attributes
    ----------
    size : PathLightSize
    training : dict
        Volumes, pairs, steps and time of the training.
    errors : dict
        RMSE on held-out pairs by the number of samples: denoised alone, and finished.
    """

    size: PathLightSize
    training: dict[str, Any] = field(default_factory=dict)
    errors: dict[str, Any] = field(default_factory=dict)


def save_path_light(path: Path, card: PathLightCard, network: PathLightNetwork) -> None:
    """Write a network, replacing the file whole or not at all, with weights in half precision.

    Raises
    ------
    CheckpointError
        When the file cannot be written.
    """
    weights = {name: half_precision(value) for name, value in network.state_dict().items()}
    about = {FORMAT: VERSION, **asdict(card)}
    content = safetensors.torch.save(weights, {FORMAT: json.dumps(about, allow_nan=False)})
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content)
    except OSError as error:
        raise CheckpointError(
            f"{path}: the network cannot be written ({reason(error)}); choose another file."
        ) from error


def load_path_light(path: Path) -> tuple[PathLightCard, PathLightNetwork]:
    """Read a network.

    Returns
    -------
    card : PathLightCard
    network : PathLightNetwork
        In evaluation mode, float32, on the CPU.

    Raises
    ------
    CheckpointError
        When the file is missing, damaged, or of another network.
    """
    try:
        with safetensors.safe_open(path, "pt") as file:
            about = json.loads((file.metadata() or {}).get(FORMAT, "null"))
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except OSError as error:
        raise CheckpointError(f"{path}: the network cannot be read ({reason(error)}).") from error
    except (safetensors.SafetensorError, ValueError) as error:
        raise CheckpointError(
            f"{path}: the file is damaged ({error}); copy or install it again."
        ) from error
    card = _card(path, about)
    return card, network_with(path, weights, lambda: PathLightNetwork(card.size))


def _card(path: Path, about: Any) -> PathLightCard:
    if not isinstance(about, dict) or about.get(FORMAT) != VERSION:
        raise CheckpointError(
            f"{path}: the file holds no network behind the denoiser that this version reads; "
            "choose another file, or train one with 'light train'."
        )
    try:
        size = PathLightSize(int(about["size"]["width"]))
        return PathLightCard(size, dict(about["training"]), dict(about["errors"]))
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(
            f"{path}: the description of the network is damaged ({error}); install it again."
        ) from error
