"""Pictures for files and the clipboard: a rendering over a background."""

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QBuffer, QIODevice, QRect, Qt
from PySide6.QtGui import QColor, QImage, QImageWriter, QLinearGradient, QPainter

from model.errors import RenderError, os_errors_as
from model.files import write_atomically
from model.rendering.brightness import brighten

Background = tuple[int, int, int] | Literal["gradient"]
"""Red, green and blue, each 0..255; or grey that is darker towards the bottom."""

BLACK, WHITE = (0, 0, 0), (255, 255, 255)

GRADIENT = (104, 110, 120), (26, 28, 32)  # the gradient's colours at the top and at the bottom
DPI = 300  # dots per inch at which figures are usually printed
LARGEST_SIZE = 8192  # largest width and height of a picture
BAND_ROWS = 64  # rows computed at once, so that large pictures take little more memory


def is_bright(background: Background | None) -> bool:
    """Whether a background is so bright that marks on it are black."""
    if background is None or background == "gradient":
        return False
    red, green, blue = background
    return 0.299 * red + 0.587 * green + 0.114 * blue > 140


def compose(
    rgba: NDArray[np.float32] | NDArray[np.uint8],
    background: Background | None,
    brightness: float = 1.0,
) -> QImage:
    """Put a rendering (H, W, 4) of premultiplied colours, 0..1 or 0..255, over a background.

    Without a background the picture is transparent, of format RGBA8888_Premultiplied, else RGB888.
    Brightness: see :func:`model.rendering.brightness.brighten`. Raises RenderError when there is
    not enough memory.
    """
    height, width = rgba.shape[:2]
    image = empty_picture(width, height, background)
    if background == "gradient":
        painter = QPainter(image)
        painter.drawImage(0, 0, compose(rgba, None, brightness))
        painter.end()
        return image
    channels = 4 if background is None else 3
    stored = np.frombuffer(image.bits(), np.uint8).reshape(height, image.bytesPerLine())
    levels = stored[:, : width * channels].reshape(height, width, channels)
    full = np.float32(255 if rgba.dtype == np.uint8 else 1)
    for top in range(0, height, BAND_ROWS):
        rows = slice(top, top + BAND_ROWS)
        # fmax and fmin take the number where the other is NaN.
        band = np.fmin(np.fmax(rgba[rows], np.float32(0)), full)
        band /= full
        if background is None or any(background):
            brighten_clear(band, brightness)
            for channel, level in enumerate(background or ()):
                band[..., channel] += (1 - band[..., 3]) * np.float32(level / 255)
        else:
            brighten(band[..., :3], brightness)
        band *= 255
        band += 0.5  # rounds to the nearest, as uint8 cuts off
        levels[rows] = band[..., :channels].astype(np.uint8)
    return image


def empty_picture(width: int, height: int, background: Background | None) -> QImage:
    """Return a picture of the background alone, in :func:`compose`'s format."""
    formats = QImage.Format
    opaque, clear = formats.Format_RGB888, formats.Format_RGBA8888_Premultiplied
    image = QImage(width, height, clear if background is None else opaque)
    if image.isNull():
        raise RenderError(
            f"A picture of {width} × {height} pixels does not fit into the memory; "
            "choose a smaller one."
        )
    if background is None:
        image.fill(Qt.GlobalColor.transparent)
        return image
    painter = QPainter(image)
    paint_background(painter, image.rect(), background)
    painter.end()
    return image


def paint_background(painter: QPainter, rect: QRect, background: Background) -> None:
    """Fill a rectangle with a background."""
    if background != "gradient":
        painter.fillRect(rect, QColor(*background))
        return
    gradient = QLinearGradient(rect.topLeft(), rect.bottomLeft())
    for place, color in enumerate(GRADIENT):
        gradient.setColorAt(place, QColor(*color))
    painter.fillRect(rect, gradient)


def brighten_clear(rgba: NDArray[np.float32], brightness: float) -> None:
    """Brighten a rendering (H, W, 4) in [0, 1] in place, and make it valid premultiplied colours.

    Only what a pixel itself shows gets brighter: added to a bright background behind it, more would
    be white.
    """
    opacity = rgba[..., 3]
    channels = [rgba[..., channel] for channel in range(3)]
    for channel in channels:
        # Light may be brighter than its opacity allows; more opacity keeps the colour.
        np.maximum(opacity, channel, out=opacity)
    if brightness != 1:
        seen = np.maximum(opacity, np.float32(1e-6))
        for channel in channels:
            channel /= seen
        brighten(rgba[..., :3], brightness)
        for channel in channels:
            channel *= seen


def millimetres(pixels: int) -> float:
    """Length of a printed picture's side."""
    return 25.4 * pixels / DPI


def save_image(path: Path, picture: QImage) -> None:
    """Write a picture in the format of the file's suffix; raise RenderError where that fails."""
    for set_density in (picture.setDotsPerMeterX, picture.setDotsPerMeterY):
        set_density(round(1000 / millimetres(1)))
    picture.setText("Software", software())
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    if not picture.save(buffer, path.suffix.lstrip(".").upper()):  # type: ignore[call-overload]
        raise RenderError(
            f"{path}: a picture of this size cannot be written as '{path.suffix}'; choose .png."
        )
    remedy = "make room, or choose another place"
    with os_errors_as(RenderError, f"{path}: the picture cannot be written", remedy):
        write_atomically(path, bytes(buffer.data().data()))


def suffixes() -> tuple[str, ...]:
    """Suffixes of the image files that Qt can write, PNG first."""
    endings = {bytes(e.data()).decode() for e in QImageWriter.supportedImageFormats()} - {"png"}
    return ".png", *sorted(f".{ending}" for ending in endings)


def software() -> str:
    """Return tfscope's name and version."""
    try:
        return f"tfscope {version('tfscope')}"
    except PackageNotFoundError:
        return "tfscope"


def pixels_of(image: QImage) -> NDArray[np.uint8]:
    """Return an opaque picture's pixels as uint8 (H, W, 3)."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    stored = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())
    pixels = stored[:, : 3 * rgb.width()].reshape(rgb.height(), rgb.width(), 3)
    return pixels.copy()
