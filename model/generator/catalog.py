"""The models shipped with tfscope, listed without torch."""

from pathlib import Path

from model.json_files import read_json
from model.volume_files import read_volume
from model.volume_files.shipped import RESOURCES, shipped_volumes

PATH_LIGHT = RESOURCES / "models" / "path_light.safetensors"  # improves path-traced pictures


def shipped_models() -> list[Path]:
    """Return the folders of the shipped models, in alphabetical order."""
    return sorted(path.parent for path in (RESOURCES / "models").glob("*/model.json"))


def volume_for(model: Path) -> Path | None:
    """Return the shipped volume that a model was trained on, or None if it is not shipped."""
    fingerprint = _fingerprint(model)
    if fingerprint is None:
        return None
    volumes = (path for path in shipped_volumes() if read_volume(path).fingerprint == fingerprint)
    return next(volumes, None)


def model_for(volume_fingerprint: str) -> Path | None:
    """Return the first shipped model of a volume in alphabetical order, or None without any."""
    return next((f for f in shipped_models() if _fingerprint(f) == volume_fingerprint), None)


def _fingerprint(model: Path) -> str | None:
    """Return the fingerprint of a model's volume; None if unreadable. Torch is not imported."""
    try:
        return str(read_json(model / "model.json")["scene"]["volume_fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
