"""Scenes of stores and models of older formats, step by step as this version has them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

FORMAT_VERSION = 2
"""Of the scene in stores and models; each has its own version beside it."""


def _with_light_range(scene: dict[str, Any]) -> dict[str, Any]:
    """1 to 2: the light of older scenes is fixed."""
    return {"light_range": None, **scene}


STEPS: tuple[Callable[[dict[str, Any]], dict[str, Any]], ...] = (_with_light_range,)
"""The first leads from format 1 to 2, and so on."""


def migrate_scene(scene: Any, version: int) -> Any:
    """Bring a scene's data of an older format to the present one; what is no scene stays."""
    if isinstance(scene, dict):
        for step in STEPS[version - 1 :]:
            scene = step(scene)
    return scene
