"""Values of options, checked while the command line is read: before anything heavy is imported."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from app.cli.outputs import check_output, check_output_folder
from model.errors import DatasetError, TfscopeError, VolumeError
from model.networks.card import read_header
from model.rendering.raster import Raster
from model.scene.axes import axis_direction
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.range_choice import RangeChoice
from model.scene.region import Region
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import ValueScale
from model.scene.view import View
from model.volume_files.source import VolumeSource

HOME_VIEW = View(30.0, 20.0, 0.0, 1.0)
"""View of commands that are given none."""


# typer also passes defaults, which are no text, to its parsers.
def view(text: str | View) -> View:
    """Parse a view; see :meth:`model.scene.view.View.parse`."""
    return text if isinstance(text, View) else View.parse(text)


def light(text: str) -> LightDirection:
    """Parse a light direction; see :meth:`model.scene.light.LightDirection.parse`."""
    return LightDirection.parse(text)


def crop_box(text: str) -> CropBox:
    """Parse a crop box; see :meth:`model.scene.crop.CropBox.parse`."""
    return CropBox.parse(text)


def region(text: str) -> Region:
    """Parse a rectangle of pixels; see :meth:`model.scene.region.Region.parse`."""
    return Region.parse(text)


def numbers(text: str | None, count: int, name: str) -> tuple[float, ...] | None:
    """Parse finite numbers between commas; None stays None.

    Raises
    ------
    TfscopeError
        When the text is something else; `name` is the option's.
    """
    if text is None:
        return None
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise TfscopeError(f"{name} takes {count} numbers with commas between them, not '{text}'.")
    return found


def scalar_window(text: str | None) -> Range | None:
    """Parse ``"LO,HI"``; None stays None.

    Raises
    ------
    TfscopeError
        When the text is not a pair of increasing numbers.
    """
    if text is None:
        return None
    try:
        lo, hi = (float(part) for part in text.split(","))
    except ValueError:
        lo = hi = math.nan
    if not lo < hi:
        raise TfscopeError(
            f"'{text}' is not a scalar window; give its lowest and highest value, such as 0.1,0.9."
        )
    return lo, hi


def window_size(text: str | None) -> tuple[int, int] | None:
    """Parse ``"WxH"`` in pixels; None stays None.

    Raises
    ------
    TfscopeError
        When the text is something else, or not from 400 to 10,000.
    """
    if text is None:
        return None
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        width = height = 0
    if not all(400 <= length <= 10_000 for length in (width, height)):
        raise TfscopeError(
            f"'{text}' is not a size of the window; give width and height from 400 to 10000 "
            "pixels, such as 1280x860."
        )
    return width, height


def pixels(text: str | None) -> Raster | None:
    """Parse ``"N"`` or ``"WxH"``, pixels of an image from 16 to 8192; None stays None.

    Raises
    ------
    TfscopeError
        When the text is something else.
    """
    if text is None:
        return None
    try:
        sides = [int(part) for part in text.lower().split("x")]
    except ValueError:
        sides = []
    if len(sides) not in (1, 2) or not all(16 <= side <= 8192 for side in sides):
        raise TfscopeError(
            f"'{text}' is not a size of an image; give its pixels from 16 to 8192, such as 512, or "
            "width and height, such as 1000x500."
        )
    return Raster(sides[0], sides[-1])


def background(text: str) -> tuple[int, int, int] | None:
    """Parse ``"black"``, ``"white"``, ``"transparent"`` (None) or ``"#rrggbb"``.

    Raises
    ------
    TfscopeError
        When the text is no colour.
    """
    named = {"black": (0, 0, 0), "white": (255, 255, 255), "transparent": None}
    if text in named:
        return named[text]
    digits = text.removeprefix("#")
    try:
        red, green, blue = bytes.fromhex(digits)
    except ValueError:
        raise TfscopeError(
            f"'{text}' is not a background; give black, white, transparent, or red, green and blue "
            "as in #2040ff."
        ) from None
    return red, green, blue


def volume(path: Path | None) -> Path | None:
    """Refuse a volume whose file or folder is missing."""
    if path is not None and not path.exists():
        raise VolumeError(f"{path}: there is no such file or folder; check the path.")
    return path


def volumes(paths: list[Path] | None) -> list[Path] | None:
    """Refuse volumes that cannot be read because they are missing, or of an unknown kind."""
    for path in paths or []:
        VolumeSource(path).check()
    return paths


def scalar_range(text: str | None) -> str | None:
    """Refuse a text that is not a scalar range; see :class:`RangeChoice`."""
    if text is not None:
        RangeChoice.parse(text)
    return text


def up_axis(text: str | None) -> str | None:
    """Refuse a text that names no axis; see :data:`model.scene.axes.AXES`."""
    if text is not None:
        axis_direction(text)
    return text


def source(
    path: Path | None,
    raw: str | None = None,
    component: str | None = None,
    scalar_range: str | None = None,
    series: str | None = None,
    array: str | None = None,
    time: str | None = None,
    channel: str | None = None,
    scale: ValueScale | None = None,
) -> VolumeSource:
    """Return the source of a volume, checked as far as that goes without reading it."""
    found = VolumeSource(path, raw, component, scalar_range, series, array, time, channel, scale)
    found.check()
    return found


def model(folder: Path | None) -> Path | None:
    """Refuse a folder that holds no model."""
    if folder is not None:
        read_header(folder)
    return folder


def models(folders: list[Path] | None) -> list[Path] | None:
    """Refuse folders that hold no model."""
    for folder in folders or ():
        model(folder)
    return folders


def tf(path: Path | None) -> Path | None:
    """Refuse a file that holds no TF."""
    if path is not None:
        TransferFunction.load(path)
    return path


def store(path: Path | None) -> Path | None:
    """Refuse a folder of samples that is missing."""
    if path is not None and not path.is_dir():
        raise DatasetError(f"{path}: there is no data set here; render one first.")
    return path


def output(*suffixes: str) -> Callable[[Path | None], Path | None]:
    """Return a check of an output file: of its suffix, in any case, and that it can be written."""
    *most, last = suffixes
    known = f"{', '.join(most)} or {last}" if most else last

    def check(path: Path | None) -> Path | None:
        if path is not None:
            if path.suffix.lower() not in suffixes:
                raise TfscopeError(f"{path}: the name must end in {known}.")
            check_output(path)
        return path

    return check


def output_folder(path: Path | None) -> Path | None:
    """Refuse a folder that can neither be written to nor made."""
    if path is not None:
        check_output_folder(path)
    return path
