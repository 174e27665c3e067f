"""Pictures as files, written whole or not at all."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from model.errors import RenderError, reason
from model.files import write_atomically

if TYPE_CHECKING:
    from PySide6.QtGui import QImage


def save_image(path: Path, picture: QImage) -> None:
    """Write a picture in the format of the file's suffix; raise RenderError where that fails."""
    from PySide6.QtCore import QBuffer, QIODevice

    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    if not picture.save(buffer, path.suffix.lstrip(".").upper()):  # type: ignore[call-overload]
        raise RenderError(
            f"{path}: a picture of this size cannot be written as '{path.suffix}'; choose .png."
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
