"""Pictures as PNG files that say in themselves what they show."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError, reason
from model.files import write_atomically

if TYPE_CHECKING:
    from PySide6.QtGui import QImage


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
    save_image(path, picture)


def save_image(path: Path, picture: QImage) -> None:
    """Write a picture in the format of the file's suffix, whole or not at all.

    Raises
    ------
    RenderError
        When the file cannot be written, or there is no such format.
    """
    from PySide6.QtCore import QBuffer, QIODevice

    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    if not picture.save(buffer, path.suffix.lstrip(".").upper()):  # type: ignore[call-overload]
        raise RenderError(
            f"{path}: pictures cannot be written as '{path.suffix}' of this size; choose .png."
        )
    try:
        write_atomically(path, bytes(buffer.data().data()))
    except OSError as error:
        raise RenderError(
            f"{path}: the picture cannot be written ({reason(error)}); make room, or choose "
            "another place."
        ) from error


def software() -> str:
    """Return tfscope's name and version."""
    try:
        return f"tfscope {version('tfscope')}"
    except PackageNotFoundError:
        return "tfscope"
