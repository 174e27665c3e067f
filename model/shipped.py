"""The volumes and models that come with tfscope."""

from __future__ import annotations

from pathlib import Path

from model.checkpoint import MODEL_FILE, load_card
from model.errors import CheckpointError
from model.volume import Volume

RESOURCES = Path(__file__).resolve().parent.parent / "resources"

DEFAULT_VOLUME = RESOURCES / "volumes" / "reacting_jet_temperature_112x112x192_float32.nrrd"


def shipped_models() -> list[Path]:
    """Folders of the models that are there, in alphabetical order."""
    return sorted(path.parent for path in (RESOURCES / "models").glob(f"*/{MODEL_FILE}"))


def shipped_volumes() -> list[Path]:
    """Files of the volumes that are there, in alphabetical order."""
    return sorted((RESOURCES / "volumes").glob("*.nrrd"))


def model_for(volume: Volume) -> Path | None:
    """The shipped model of a volume, if there is one."""
    for folder in shipped_models():
        try:
            if load_card(folder).scene.volume_fingerprint == volume.fingerprint:
                return folder
        except CheckpointError:
            continue
    return None
