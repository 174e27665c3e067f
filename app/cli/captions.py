"""What a picture shows, in a line for its title."""

from __future__ import annotations

from pathlib import Path

from model.scene.transfer_function import Range
from model.scene.view import View


def view_text(view: View) -> str:
    """Format a view as the option takes it, without a pan that is none."""
    numbers = [*vars(view).values()]
    if not (view.pan_x or view.pan_y):
        numbers = numbers[:4]
    return ",".join(f"{number:g}" for number in numbers)


def range_text(scalar_range: Range) -> str:
    """Format a range of scalar values."""
    return "{:.6g} to {:.6g}".format(*scalar_range)


def tf_text(path: Path | None) -> str:
    """Name a TF: by its file, or as the volume's first one."""
    return "first TF" if path is None else f"TF {path.name}"
