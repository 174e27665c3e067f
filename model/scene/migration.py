"""Migration of scenes in stores and models of older formats to the present format."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

FORMAT_VERSION = 5
"""Version of the scene's format in stores and models."""


def _with_light_range(scene: dict[str, Any]) -> dict[str, Any]:
    """Convert format 1 to 2: older scenes have a fixed light."""
    return {"light_range": None, **scene}


def _with_tf_family(scene: dict[str, Any]) -> dict[str, Any]:
    """Convert format 2 to 3: older samples have the paper's TFs; dimensions are not known."""
    return {"dimensions": None, "tf_family": "paper", **scene}


def _with_up_axis(scene: dict[str, Any]) -> dict[str, Any]:
    """Convert format 3 to 4: views were about the volume's z axis."""
    view_range = scene.get("view_range")
    if isinstance(view_range, dict):
        view_range = {"up": "+z", **view_range}
    return {**scene, "view_range": view_range}


def _with_named_shadows(scene: dict[str, Any]) -> dict[str, Any]:
    """Convert format 4 to 5: what was called global was another light by each renderer."""
    if scene.get("lighting") != "global":
        return scene
    return {**scene, "lighting": "shadows" if scene.get("renderer") == "vtk" else "soft"}


STEPS: tuple[Callable[[dict[str, Any]], dict[str, Any]], ...] = (
    _with_light_range,
    _with_tf_family,
    _with_up_axis,
    _with_named_shadows,
)
"""Conversions between successive formats, from 1 to 2 onwards."""


def migrate_scene(scene: Any, version: int) -> Any:
    """Convert a scene's data from an older format to the present one; keep other data."""
    if isinstance(scene, dict):
        for step in STEPS[version - 1 :]:
            scene = step(scene)
    return scene
