"""Pictures as PNG files that say in themselves what they show."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError


def save_picture(path: Path, image: NDArray[np.floating], facts: Mapping[str, str]) -> None:
    """Write an image as a PNG file, replacing an existing one.

    Parameters
    ----------
    path : Path
    image : ndarray, shape (H, W, 3)
        Colours in [0, 1], row 0 at the top.
    facts : mapping of str to str
        What is written into the file, too, as texts with keywords.

    Raises
    ------
    RenderError
        When the file cannot be written.
    """
    from PySide6.QtGui import QImage

    pixels = np.ascontiguousarray(np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8))
    height, width, _ = pixels.shape
    picture = QImage(pixels.data, width, height, 3 * width, QImage.Format.Format_RGB888)
    for keyword, text in {**facts, "Software": software()}.items():
        picture.setText(keyword, text)
    if not picture.save(str(path)):
        raise RenderError(f"{path}: the picture cannot be written; choose another place.")


def software() -> str:
    """Return tfscope's name and version."""
    try:
        return f"tfscope {version('tfscope')}"
    except PackageNotFoundError:
        return "tfscope"
