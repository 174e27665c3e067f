"""The file of a model's weights: found, read and compared with the card, without torch."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from model.errors import CheckpointError, reason
from model.networks.card import MODEL_FILE

LONGEST_NAME = 100
"""Longest name of a weights' file; that of others is cut off, so that it is not found."""


def read_weights(folder: Path, header: dict[str, Any]) -> bytes:
    """Read a model's weights as they are in the file.

    Parameters
    ----------
    header : dict
        The folder's description, of :func:`model.networks.card.read_header`.

    Raises
    ------
    CheckpointError
        When the file is missing, cannot be read, or is not the one that the description
        was written for.
    """
    path = folder / str(header.get("weights", ""))[:LONGEST_NAME]
    if path.parent != folder or not path.is_file():
        raise CheckpointError(f"{folder}: the weights '{path.name}' are missing; copy them too.")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise CheckpointError(f"{path}: the weights cannot be read ({reason(error)}).") from error
    if hashlib.sha256(content).hexdigest() != header.get("sha256"):
        raise CheckpointError(
            f"{path}: the weights are truncated or altered (their SHA-256 differs from "
            f"{MODEL_FILE}'s); copy the model folder again."
        )
    return content
