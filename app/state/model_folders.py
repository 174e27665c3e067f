"""Folders for models that the window trains."""

from __future__ import annotations

import re
from contextlib import suppress
from itertools import count
from pathlib import Path

from app.state.user_folder import user_folder
from model.errors import TrainingError, reason
from model.training.stopping import LOCK_FILE, STOP_FILE


def new_model_folder(volume_name: str, place: Path | None = None) -> Path:
    """Make an empty folder for a model of a volume; none that is there already.

    Parameters
    ----------
    place : Path or None
        Folder of the models; by default in the user's application data folder.

    Raises
    ------
    TrainingError
        When it cannot be made.
    """
    if place is None:
        place = user_folder() / "models"
    name = re.sub(r"[^\w.-]+", "_", volume_name)[:80].strip("._-") or "volume"
    try:
        place.mkdir(parents=True, exist_ok=True)
        for number in count(1):
            folder = place / f"{name}-{number}"
            with suppress(FileExistsError):
                folder.mkdir()
                return folder
    except OSError as error:
        raise TrainingError(
            f"{place}: a folder for the model cannot be made ({reason(error)}); make room there."
        ) from error
    raise AssertionError


def remove_if_unused(folder: Path) -> None:
    """Remove a folder in which no run has saved anything."""
    if {path.name for path in folder.glob("*")} <= {LOCK_FILE, STOP_FILE}:
        with suppress(OSError):
            for name in (LOCK_FILE, STOP_FILE):
                (folder / name).unlink(missing_ok=True)
            folder.rmdir()
