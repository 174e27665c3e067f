"""Titles of pictures: facts on what they show; and Qt's fonts to write them with."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale, values_at
from model.scene.view import View

if TYPE_CHECKING:
    from PySide6.QtCore import QCoreApplication

_kept: list[QCoreApplication] = []


def view_text(view: View) -> str:
    """Format a view as the option takes it, without a pan that is none."""
    numbers = [*vars(view).values()]
    if not (view.pan_x or view.pan_y):
        numbers = numbers[:4]
    return ",".join(f"{number:g}" for number in numbers)


def range_text(scalar_range: Range, scale: ValueScale) -> str:
    """Format a range of places on a scale in the data's units, and say if it is no linear one."""
    low, high = values_at(scalar_range, scale)
    return f"{low:.6g} to {high:.6g}{', logarithmic' if scale == 'log' else ''}"


def tf_text(path: Path | None) -> str:
    """Name a TF: by its file, or as the volume's first one."""
    return "first TF" if path is None else f"TF {path.name}"


def fonts() -> None:
    """Make Qt's fonts available, without a display: Qt wants an application for text."""
    from PySide6.QtWidgets import QApplication

    if QApplication.instance() is None:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
        _kept.append(QApplication(["tfscope"]))
