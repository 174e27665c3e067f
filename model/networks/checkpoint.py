"""The model folder: weights as safetensors, everything else as JSON.

``model.json`` names the weights' file and its SHA-256 and is written last, so
a folder holds either the old model or the new one, never a mixture. Loading
only reads data and executes no code.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch
import torch
from torch import Tensor

from model.errors import CheckpointError, TfscopeError
from model.files import write_atomically
from model.networks.build import build_generator
from model.networks.generator_network import GeneratorNetwork
from model.networks.size import NetworkSize
from model.scene.migration import FORMAT_VERSION, migrate_scene
from model.scene.scene import Scene

MODEL_FILE = "model.json"


@dataclass(frozen=True)
class ModelCard:
    """Description of a trained model: everything except its weights.

    Attributes
    ----------
    scene : Scene
        The scene that it was trained on.
    preset : str
        Name of the preset that the size came from.
    size : NetworkSize
    training : dict
        Options, duration and learning curve of the training.
    metrics : dict
        Most recent hold-out metrics.
    versions : dict of str
        Versions of Python and libraries used for training.
    """

    scene: Scene
    preset: str
    size: NetworkSize
    training: dict[str, Any] = field(default_factory=dict)
    metrics: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the card as plain data."""
        return {**asdict(self), "scene": self.scene.to_json()}


def save_model(folder: Path, card: ModelCard, network: GeneratorNetwork) -> None:
    """Write a model folder, replacing the model in it, with weights in half precision.

    Parameters
    ----------
    folder : Path
    card : ModelCard
    network : GeneratorNetwork

    Raises
    ------
    CheckpointError
        When the folder cannot be written.
    """
    weights = {name: _half(value) for name, value in network.state_dict().items()}
    content = safetensors.torch.save(weights)
    digest = hashlib.sha256(content).hexdigest()
    name = f"generator-{digest[:12]}.safetensors"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(folder / name, content)
        text = json.dumps(
            {
                "tfscope_model": FORMAT_VERSION,
                "weights": name,
                "sha256": digest,
                **card.to_json(),
            },
            indent=2,
            allow_nan=False,
        )
        write_atomically(folder / MODEL_FILE, (text + "\n").encode())
        for old in folder.glob("generator-*.safetensors"):
            if old.name != name:
                old.unlink()
    except OSError as error:
        raise CheckpointError(
            f"{folder}: the model cannot be written ({error.strerror}); choose another folder."
        ) from error


def load_card(folder: Path) -> ModelCard:
    """Read a model's card without its weights.

    Raises
    ------
    CheckpointError
        When the folder holds no model or one that this version cannot read.
    """
    return _card(folder, _read_json(folder))


def weights_digest(folder: Path) -> str:
    """Return the SHA-256 of a model's weights as recorded in ``model.json``.

    Raises
    ------
    CheckpointError
        When the folder holds no model.
    """
    return str(_read_json(folder).get("sha256"))


def load_model(folder: Path) -> tuple[ModelCard, GeneratorNetwork]:
    """Read a model folder.

    Returns
    -------
    card : ModelCard
    network : GeneratorNetwork
        In evaluation mode, float32, on the CPU.

    Raises
    ------
    CheckpointError
        When the folder holds no model, or its weights are missing, truncated,
        altered, not finite or inconsistent with its card.
    """
    header = _read_json(folder)
    card = _card(folder, header)
    path = folder / str(header.get("weights", ""))
    if path.parent != folder or not path.is_file():
        raise CheckpointError(f"{folder}: the weights '{path.name}' are missing; copy them too.")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise CheckpointError(f"{path}: the weights cannot be read ({error.strerror}).") from error
    if hashlib.sha256(content).hexdigest() != header.get("sha256"):
        raise CheckpointError(
            f"{path}: the weights are truncated or altered (their SHA-256 differs from "
            f"{MODEL_FILE}'s); copy the model folder again."
        )
    try:
        weights = safetensors.torch.load(content)
    except safetensors.SafetensorError as error:
        raise CheckpointError(f"{path}: the file is not safetensors ({error}).") from error
    network = build_generator(card.size, card.scene)
    _check_weights(path, weights, network.state_dict())
    network.load_state_dict({name: value.float() for name, value in weights.items()})
    return card, network.eval().requires_grad_(False)


def _half(value: Tensor) -> Tensor:
    """Convert to half precision unless the tensor is not floating point or would overflow."""
    value = value.detach().cpu().contiguous()
    if not value.is_floating_point():
        return value
    half = value.to(torch.float16)
    return half if torch.isfinite(half).all() else value


def _read_json(folder: Path) -> dict[str, Any]:
    path = folder / MODEL_FILE
    if not path.is_file():
        raise CheckpointError(
            f"{folder}: there is no model here ({MODEL_FILE} is missing); "
            "give the folder of a trained model."
        )
    try:
        header = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise CheckpointError(f"{path}: the file is damaged ({error}).") from error
    if not isinstance(header, dict) or "tfscope_model" not in header:
        raise CheckpointError(f"{path}: the file does not describe a tfscope model.")
    version = header["tfscope_model"]
    if version not in range(1, FORMAT_VERSION + 1):
        raise CheckpointError(
            f"{path}: the model has format {version!r}; this tfscope reads 1 to "
            f"{FORMAT_VERSION}, so train the model anew or update tfscope."
        )
    return {**header, "scene": migrate_scene(header.get("scene"), version)}


def _card(folder: Path, header: dict[str, Any]) -> ModelCard:
    try:
        card = ModelCard(
            scene=Scene.from_json(header["scene"]),
            preset=str(header["preset"]),
            size=NetworkSize(**header["size"]),
            training=dict(header["training"]),
            metrics=dict(header["metrics"]),
            versions=dict(header["versions"]),
        )
    except (KeyError, TypeError, ValueError, TfscopeError) as error:
        raise CheckpointError(
            f"{folder / MODEL_FILE}: the description is malformed near {error}."
        ) from error
    if card.size.image_size != card.scene.image_size:
        raise CheckpointError(
            f"{folder / MODEL_FILE}: the network draws {card.size.image_size} pixels "
            f"but the scene has {card.scene.image_size}."
        )
    return card


def _check_weights(path: Path, weights: dict[str, Tensor], expected: dict[str, Tensor]) -> None:
    """Raise :class:`CheckpointError` unless names and shapes match and values are finite."""
    missing = sorted(expected.keys() - weights.keys())
    foreign = sorted(weights.keys() - expected.keys())
    if missing or foreign:
        name = (missing or foreign)[0]
        raise CheckpointError(
            f"{path}: the weights belong to another network "
            f"('{name}' is {'missing' if missing else 'unknown'})."
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
