"""Values of options, parsed and checked before anything heavy is imported."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.outputs import check_output
from model.errors import DatasetError, TfscopeError
from model.rendering.raster import Raster
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale, values_at
from model.scene.view import ORTHOGRAPHIC, View
from model.volume_files.checks import number_of

if TYPE_CHECKING:
    from PySide6.QtCore import QCoreApplication


def view_text(view: View) -> str:
    """Format a view as the option takes it; a pan of zero is left out."""
    numbers = [*vars(view).values()][: 6 if view.pan_x or view.pan_y else 4]
    words = [ORTHOGRAPHIC] if view.is_orthographic else []
    return ",".join([*(f"{number:g}" for number in numbers), *words])


def range_text(scalar_range: Range, scale: ValueScale) -> str:
    """Format a range in the data's units, and name the scale unless it is linear."""
    low, high = values_at(scalar_range, scale)
    return f"{low:.6g} to {high:.6g}{', logarithmic' if scale == 'log' else ''}"


def tf_text(path: Path | None) -> str:
    """Name a TF: by its file, or as the volume's first one."""
    return "first TF" if path is None else f"TF {path.name}"


@cache
def fonts() -> QCoreApplication:
    """Make Qt's fonts available without a display: Qt needs an application to draw text."""
    from PySide6.QtWidgets import QApplication

    if found := QApplication.instance():
        return found
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    return QApplication(["tfscope"])


HOME_VIEW = View(30.0, 20.0, 0.0, 1.0)  # default view of commands


def view(text: str | View) -> View:
    """Parse a view; typer also passes defaults, which are not texts."""
    return text if isinstance(text, View) else View.parse(text)


def numbers(count: int, name: str) -> Callable[[str], tuple[float, ...]]:
    """Return a parser of finite numbers between commas, for the option of a name."""

    def parse(text: str) -> tuple[float, ...]:
        found = [each for part in text.split(",") if (each := number_of(part)) is not None]
        if len(found) != count or text.count(",") != count - 1:
            raise TfscopeError(
                f"{name} takes {count} numbers with commas between them, not '{text}'."
            )
        return tuple(found)

    return parse


def scalar_window(text: str) -> Range:
    """Parse ``"LO,HI"``, two increasing numbers."""
    ends = [number_of(part) for part in text.split(",")]
    match ends:
        case [float(lo), float(hi)] if lo < hi:
            return lo, hi
    raise TfscopeError(
        f"'{text}' is not a scalar window; give its lowest and highest value, such as 0.1,0.9."
    )


def _whole_numbers(text: str) -> list[int]:
    """Parse ``"N"`` or ``"WxH"``; return an empty list for anything else."""
    try:
        return [int(part) for part in text.lower().split("x")]
    except ValueError:
        return []


def window_size(text: str) -> tuple[int, int]:
    """Parse ``"WxH"``, from 400 to 10,000 pixels."""
    sides = _whole_numbers(text)
    if len(sides) != 2 or not all(400 <= side <= 10_000 for side in sides):
        raise TfscopeError(
            f"'{text}' is not a size of the window; give width and height from 400 to 10000 "
            "pixels, such as 1280x860."
        )
    return sides[0], sides[1]


def pixels(text: str) -> Raster:
    """Parse ``"N"`` or ``"WxH"``, pixels of an image from 16 to 8192."""
    sides = _whole_numbers(text)
    if len(sides) not in (1, 2) or not all(16 <= side <= 8192 for side in sides):
        raise TfscopeError(
            f"'{text}' is not a size of an image; give its pixels from 16 to 8192, such as 512, or "
            "width and height, such as 1000x500."
        )
    return Raster(sides[0], sides[-1])


def background(text: str) -> tuple[int, int, int] | None:
    """Parse ``"black"``, ``"white"``, ``"transparent"`` (None) or ``"#rrggbb"``."""
    named = {"black": (0, 0, 0), "white": (255, 255, 255), "transparent": None}
    if text in named:
        return named[text]
    try:
        red, green, blue = bytes.fromhex(text.removeprefix("#"))
    except ValueError:
        raise TfscopeError(
            f"'{text}' is not a background; give black, white, transparent, or red, green and blue "
            "as in #2040ff."
        ) from None
    return red, green, blue


def checked(check: Callable[[Any], object]) -> Callable[[Any], Any]:
    """Return a callback that checks a value, or each of several, unless it is None."""

    def run(value: Any) -> Any:
        for each in value if isinstance(value, list) else (value,):
            if each not in (None, ""):
                check(each)
        return value

    return run


def store(path: Path) -> None:
    """Refuse a folder of samples that is missing."""
    if not path.is_dir():
        raise DatasetError(f"{path}: there is no data set here; render one first.")


def output(*suffixes: str) -> Callable[[Path], None]:
    """Return a check of an output file: its suffix, and that it can be written."""
    *most, last = suffixes
    known = f"{', '.join(most)} or {last}" if most else last

    def check(path: Path) -> None:
        if path.suffix.lower() not in suffixes:
            raise TfscopeError(f"{path}: the name must end in {known}.")
        check_output(path)

    return check
