"""The codec folder: a browser's codec as safetensors, with a description as JSON."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch

from model.errors import CheckpointError, reason
from model.json_files import build, read_json
from model.networks.codec import BrowserCodec
from model.volume_files.shipped import RESOURCES

CODEC_FILE = "codec.json"
WEIGHTS_FILE = "codec.safetensors"
FORMAT = 1

SHIPPED_CODEC = RESOURCES / "codec"


@dataclass(frozen=True)
class CodecCard:
    """All that is known about a browser's codec besides its weights.

    Attributes
    ----------
    width : float
        Number of channels as a fraction of the paper's.
    training : dict
        Design, steps and seed of its training.
    metrics : dict
        What it was measured at.
    digest : str
        SHA-256 of the weights' file.
    """

    latent_dim: int
    width: float
    training: dict[str, Any]
    metrics: dict[str, Any]
    digest: str = ""


def load_codec(folder: Path = SHIPPED_CODEC) -> tuple[CodecCard, BrowserCodec]:
    """Read a codec folder.

    Returns
    -------
    card : CodecCard
    codec : BrowserCodec
        In evaluation mode, float32, on the CPU.

    Raises
    ------
    CheckpointError
        When the folder holds no codec, or one that is damaged or of another version.
    """
    try:
        described = read_json(folder / CODEC_FILE)
        content = (folder / WEIGHTS_FILE).read_bytes()
    except OSError as error:
        raise CheckpointError(
            f"{folder}: the folder holds no codec ({reason(error)}); install tfscope again."
        ) from error
    except ValueError as error:
        raise CheckpointError(f"{folder / CODEC_FILE}: the file is not JSON ({error}).") from error
    try:
        version = described.pop("tfscope_codec")
        card = build(CodecCard, described, exact=True)
        codec = BrowserCodec(card.latent_dim, card.width)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise CheckpointError(
            f"{folder / CODEC_FILE}: the description is malformed near {error}."
        ) from error
    if version != FORMAT:
        raise CheckpointError(
            f"{folder}: the codec's format is {version!r}; this tfscope reads {FORMAT}."
        )
    if _digest(content) != card.digest:
        raise CheckpointError(
            f"{folder / WEIGHTS_FILE}: the weights are truncated or altered; copy the folder again."
        )
    try:
        weights = safetensors.torch.load(content)
        codec.load_state_dict({name: value.float() for name, value in weights.items()})
    except (safetensors.SafetensorError, RuntimeError) as error:
        raise CheckpointError(
            f"{folder / WEIGHTS_FILE}: the weights are not those of the described codec."
        ) from error
    return card, codec.eval().requires_grad_(False)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
