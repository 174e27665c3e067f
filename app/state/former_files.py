"""Files of earlier versions, read as data of this one; they are never written."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from model.errors import TransferFunctionError
from model.json_files import MalformedError, read_json
from model.scene.scene import LightDirection
from model.scene.transfer_function import TransferFunction
from model.scene.view import View

MARK = "tfscope_preferences"
"""Key that only the file of settings had."""


def former_settings(folder: Path) -> dict[str, Any]:
    """Return the settings of a user's folder."""
    data = _preferences(folder)
    volumes = _part(data, "volumes")
    places = {_part(volumes, name).get("path"): name for name in volumes}
    kept = {name: value for name, value in data.items() if name not in ("volumes", MARK)}
    return {**kept, "places": {place: name for place, name in places.items() if place}}


def former_memory(folder: Path, fingerprint: str) -> dict[str, Any]:
    """Return the memory of a volume in a user's folder."""
    data = _memory_of(_part(_part(_preferences(folder), "volumes"), fingerprint))
    path = folder / "transfer_functions" / f"{fingerprint[:32]}.json"
    with suppress(OSError, MalformedError):
        data["tf"] = _tf_of(read_json(path))
    return data


def former_session(data: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a session's file of the first version."""
    memory = {**_memory_of(_part(data, "look")), "tf": _tf_of(data.get("transfer_function"))}
    shown = {"settings": data.get("window", {}), "band": data.get("band") or None}
    return {**data, "memory": memory, **shown}


def _tf_of(content: Any) -> dict[str, Any]:
    """Return a memory's TF of the content of a TF file; what is no TF in either is empty."""
    with suppress(TransferFunctionError):
        return asdict(TransferFunction.from_json(content))
    return {}


def _memory_of(look: dict[str, Any]) -> dict[str, Any]:
    """Return a memory whose view, light and crop box were lists of numbers, empty for none."""
    memory = {name: value for name, value in look.items() if value != []}
    for name, kind in (("view", View), ("light", LightDirection)):
        if isinstance(numbers := memory.get(name), list):
            names = [field.name for field in fields(kind)]
            memory[name] = dict(zip(names, numbers, strict=False))
    if isinstance(planes := memory.get("crop"), list):
        memory["crop"] = {"low": planes[:3], "high": planes[3:]}
    if isinstance(regions := memory.get("regions"), list):
        parts = [_part({"region": region}, "region") for region in regions]
        memory["regions"] = [
            {"name": part.get("name"), "outline": {"points": part.get("points")}} for part in parts
        ]
    if memory.get("lighting") == "shadows":
        # A light that is no more; this one has shadows, too.
        memory["lighting"] = "soft"
    return memory


def _preferences(folder: Path) -> dict[str, Any]:
    with suppress(OSError, MalformedError):
        return _part({"file": read_json(folder / "preferences.json")}, "file")
    return {}


def _part(data: dict[str, Any], name: str) -> dict[str, Any]:
    part = data.get(name)
    return part if isinstance(part, dict) else {}
