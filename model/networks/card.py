"""A model folder's card, and the bytes of its weights, read without torch."""

import hashlib
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from model.errors import CheckpointError, TfscopeError, os_errors_as
from model.files import write_atomically
from model.json_files import MalformedError, build, read_json
from model.networks.size import NetworkSize
from model.scene.scene import FORMAT_VERSION, Scene

MODEL_FILE = "model.json"


@dataclass(frozen=True)
class ModelCard:
    """Metadata of a trained model."""

    scene: Scene
    preset: str  # name of the preset that the size came from
    size: NetworkSize
    training: dict[str, Any] = field(default_factory=dict)  # options, budget and course of training
    metrics: dict[str, Any] = field(default_factory=dict)  # on hold-out samples at the end
    versions: dict[str, str] = field(default_factory=dict)  # of the software that trained it


def load_card(folder: Path) -> ModelCard:
    """Read a model's card without its weights; raise :class:`CheckpointError` if there is none."""
    return card_of(folder, read_header(folder))


def read_header(folder: Path) -> dict[str, Any]:
    """Read a model folder's description as plain data; raises like :func:`load_card`."""
    path = folder / MODEL_FILE
    if not path.is_file():
        raise CheckpointError(
            f"{folder}: there is no model here ({MODEL_FILE} is missing); "
            "give the folder of a trained model."
        )
    try:
        with os_errors_as(CheckpointError, f"{path}: the file cannot be read"):
            header = read_json(path)
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
    """Write a model folder's description atomically, or raise :class:`OSError`."""
    text = json.dumps(header, indent=2, allow_nan=False)
    write_atomically(folder / MODEL_FILE, (text + "\n").encode())


def recorded_agreement(folder: Path) -> float | None:
    """Return the median cosine of a model's sensitivities with exact ones; None if unknown."""
    try:
        agreement = read_header(folder)["metrics"]["sensitivity_agreement"]
        return float(agreement["image_cosine"]["median"])
    except (CheckpointError, KeyError, TypeError, ValueError):
        return None


def add_metrics(folder: Path, **metrics: Any) -> None:
    """Add metrics to a model's card, or raise :class:`CheckpointError`."""
    header = read_header(folder)
    header["metrics"] = {**card_of(folder, header).metrics, **metrics}
    with os_errors_as(CheckpointError, f"{folder}: the card cannot be written"):
        write_header(folder, header)


def card_of(folder: Path, header: dict[str, Any]) -> ModelCard:
    """Build a card from :func:`read_header`'s data; raise :class:`CheckpointError` for others."""
    try:
        card = build(ModelCard, header)
    except (MalformedError, TfscopeError) as error:
        raise CheckpointError(
            f"{folder / MODEL_FILE}: the description is malformed near {str(error).rstrip('.')}; "
            "copy the model folder again."
        ) from error
    if card.size.image_size != card.scene.image_size:
        raise CheckpointError(
            f"{folder / MODEL_FILE}: the network draws {card.size.image_size} pixels "
            f"but the scene has {card.scene.image_size}; copy the model folder again."
        )
    return card


LONGEST_NAME = 100  # of weights' files; other names are truncated, and thus not found


def read_weights(folder: Path, header: dict[str, Any]) -> bytes:
    """Read the weights' file that a header names, or raise `CheckpointError`."""
    path = folder / str(header.get("weights", ""))[:LONGEST_NAME]
    if path.parent != folder or not path.is_file():
        raise CheckpointError(f"{folder}: the weights '{path.name}' are missing; copy them too.")
    with os_errors_as(CheckpointError, f"{path}: the weights cannot be read"):
        content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != header.get("sha256"):
        raise CheckpointError(
            f"{path}: the weights are truncated or altered (their SHA-256 differs from "
            f"{MODEL_FILE}'s); copy the model folder again."
        )
    return content


KIND_NAMES = {
    "modes": "mixtures of modes", "ramp": "ramps", "plateau": "plateaus", "step": "steps",
    "band": "bands", "curve": "free curves", "constant": "constants",
    "nearly empty": "nearly empty", "empty": "empty",
}  # fmt: skip
"""Names of the kinds of opacity TFs (:data:`model.scene.random_inputs.OpacityKind`) for display."""


def errors_by_kind(metrics: dict[str, Any]) -> dict[str, float]:
    """Mean RMSE of a model's colour images (0..1) by kind of opacity TF, largest first."""
    kinds = metrics.get("kinds")
    found = {}
    for kind, name in KIND_NAMES.items():
        entry = kinds.get(kind) if isinstance(kinds, dict) else None
        error: Any = entry.get("rmse") if isinstance(entry, dict) else None
        if _is_number(error):
            found[name] = float(error)
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def error_text(metrics: dict[str, Any]) -> str:
    """Describe a model's recorded errors in a sentence; empty without any."""
    holdout = metrics.get("holdout")
    count = metrics.get("holdout_count")
    parts = []
    if isinstance(holdout, dict) and _is_number(holdout.get("rmse")):
        of = f" of {count:,} hold-out images" if isinstance(count, int) else ""
        emd = f", colour EMD {holdout['emd']:.3f}" if _is_number(holdout.get("emd")) else ""
        parts.append(f"RMSE{of} {holdout['rmse']:.3f}{emd}")
    kinds = errors_by_kind(metrics)
    if kinds:
        listed = ", ".join(f"{name} {error:.3f}" for name, error in kinds.items())
        parts.append(f"by kind of TF: {listed}" if parts else f"RMSE by kind of TF: {listed}")
    return f"{'; '.join(parts)}." if parts else ""


def recorded_error(folder: Path) -> float:
    """Return the mean RMSE (0..1) of a model's worst kind of TF, or infinity."""
    try:
        return max(errors_by_kind(load_card(folder).metrics).values(), default=math.inf)
    except CheckpointError:
        return math.inf


def recorded_errors(folder: Path) -> str:
    """Describe the recorded errors of a model's folder; empty if it is unreadable."""
    try:
        return error_text(load_card(folder).metrics)
    except CheckpointError:
        return ""


def _is_number(value: object) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and math.isfinite(value)  # type: ignore[arg-type]
