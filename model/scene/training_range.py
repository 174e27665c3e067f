"""Says where the user has left what a generator was trained for."""

from __future__ import annotations

from model.scene.scene import Scene
from model.scene.transfer_function import OpacityTF
from model.scene.view import View


def outside_training_range(scene: Scene, view: View, opacity: OpacityTF) -> str:
    """Return one line on what lies outside the training range, empty when nothing does.

    Parameters
    ----------
    scene : Scene
        Of the generator.
    view : View
    opacity : OpacityTF
    """
    trained = scene.view_range
    parts = []
    if abs(view.elevation) > trained.max_elevation:
        parts.append(f"elevation {view.elevation:.0f}° (±{trained.max_elevation:g}°)")
    if abs(view.roll) > trained.max_roll:
        parts.append(f"roll {view.roll:.0f}° (±{trained.max_roll:g}°)")
    if not trained.nearest <= view.distance <= trained.farthest:
        parts.append(f"distance {view.distance:.2f} ({trained.nearest:g} to {trained.farthest:g})")
    lo, hi = scene.scalar_window
    strays = sum(not lo <= mode.mean <= hi for mode in opacity.modes)
    if strays:
        what = "a mode" if strays == 1 else f"{strays} modes"
        parts.append(f"{what} beyond {lo:.4g} to {hi:.4g}")
    if opacity.points:
        parts.append("a free opacity curve")
    return f"Outside the training range: {', '.join(parts)}" if parts else ""
