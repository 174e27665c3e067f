"""A model's card: all that is known about it besides its weights. Read without torch."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from model.errors import CheckpointError, TfscopeError, reason
from model.files import write_atomically
from model.json_files import MalformedError, build, read_json
from model.networks.size import NetworkSize
from model.scene.scene import FORMAT_VERSION, Scene

MODEL_FILE = "model.json"


@dataclass(frozen=True)
class ModelCard:
    """All that is known about a trained model besides its weights.

    Attributes
    ----------
    scene : Scene
        What it was trained to render.
    preset : str
        Name of the preset that the size came from.
    training : dict
        Options, budget and course of the training.
    metrics : dict
        Hold-out metrics at the end of the training.
    versions : dict
        Versions of the software that trained it.
    """

    scene: Scene
    preset: str
    size: NetworkSize
    training: dict[str, Any] = field(default_factory=dict)
    metrics: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The card as plain data."""
        return {**asdict(self), "scene": self.scene.to_json()}


def load_card(folder: Path) -> ModelCard:
    """Read a model's card without its weights.

    Raises
    ------
    CheckpointError
        When the folder holds no model, or one that this version cannot read.
    """
    return card_of(folder, read_header(folder))


def weights_digest(folder: Path) -> str:
    """SHA-256 of a model's weights, as its card has it.

    Raises
    ------
    CheckpointError
        When the folder holds no model.
    """
    return str(read_header(folder).get("sha256"))


def read_header(folder: Path) -> dict[str, Any]:
    """Read a model folder's description as plain data.

    Raises
    ------
    CheckpointError
        When there is none, or it is not of the format that this version reads.
    """
    path = folder / MODEL_FILE
    if not path.is_file():
        raise CheckpointError(
            f"{folder}: there is no model here ({MODEL_FILE} is missing); "
            "give the folder of a trained model."
        )
    try:
        header = read_json(path)
    except OSError as error:
        raise CheckpointError(f"{path}: the file cannot be read ({reason(error)}).") from error
    except MalformedError as error:
        raise CheckpointError(
            f"{path}: the file is damaged ({error}); copy the model folder again."
        ) from error
    if not isinstance(header, dict) or "tfscope_model" not in header:
        raise CheckpointError(
            f"{path}: the file does not describe a tfscope model; choose another folder."
        )
    version = header["tfscope_model"]
    if type(version) is not int or version != FORMAT_VERSION:
        raise CheckpointError(
            f"{path}: the model has format {version!r}; this tfscope reads {FORMAT_VERSION}, "
            "so train the model anew or update tfscope."
        )
    return header


def write_header(folder: Path, header: dict[str, Any]) -> None:
    """Write a model folder's description, whole or not at all; raise :class:`OSError` if not."""
    text = json.dumps(header, indent=2, allow_nan=False)
    write_atomically(folder / MODEL_FILE, (text + "\n").encode())


def _clause(error: Exception) -> str:
    """Return an error's message for the middle of a sentence."""
    return str(error).rstrip(".")


def recorded_agreement(folder: Path) -> float | None:
    """Return the median cosine of a model's sensitivities with exact ones; None if unknown."""
    try:
        agreement = read_header(folder)["metrics"]["sensitivity_agreement"]
        return float(agreement["image_cosine"]["median"])
    except (CheckpointError, KeyError, TypeError, ValueError):
        return None


def add_metrics(folder: Path, **metrics: Any) -> None:
    """Write further metrics into a model's card.

    Raises
    ------
    CheckpointError
        When the folder holds no model, or cannot be written.
    """
    header = read_header(folder)
    header["metrics"] = {**card_of(folder, header).metrics, **metrics}
    try:
        write_header(folder, header)
    except OSError as error:
        raise CheckpointError(f"{folder}: the card cannot be written ({reason(error)}).") from error


def card_of(folder: Path, header: dict[str, Any]) -> ModelCard:
    """Build a card from :func:`read_header`'s data.

    Raises
    ------
    CheckpointError
        When the data is no card.
    """
    try:
        card = build(ModelCard, header)
    except (MalformedError, TfscopeError) as error:
        raise CheckpointError(
            f"{folder / MODEL_FILE}: the description is malformed near {_clause(error)}; "
            "copy the model folder again."
        ) from error
    if card.size.image_size != card.scene.image_size:
        raise CheckpointError(
            f"{folder / MODEL_FILE}: the network draws {card.size.image_size} pixels "
            f"but the scene has {card.scene.image_size}."
        )
    return card
