"""A computed sensitivity with the data to interpret it, and its files."""

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError, os_errors_as
from model.files import write_atomically
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.value_scale import ValueScale, values_at
from model.sensitivity.display import Measure

Kind = Literal["region", "value", "blocks"]

NUMBER_SUFFIXES = (".npz", ".csv")


@dataclass(frozen=True, eq=False)
class SensitivityResult:
    """The sensitivity of one image to edits whose 256 opacities sum to 1."""

    kind: Kind
    scalar_range: Range
    scalar_window: Range  # values of interest; the background may be 100 times as sensitive
    units: str  # unit of the scalars; may be empty
    opacity: NDArray[np.float32]  # of the TF (256,), at even scalar values
    image: NDArray[np.float32]  # shape (S, S, 3)
    sensitivity: NDArray[np.float32]
    """Shape (256,) for a region, (rows, columns, 256) for blocks, (S, S, 3) for a value: dI."""
    width: float  # standard deviation of the edits in bins
    measure: Measure
    source: str  # origin for titles, such as "exact, by the ray caster"
    place: str  # the region or the values, for titles
    pixels: int  # number of the region's or of a block's pixels
    edit: NDArray[np.float32] | None = None  # (256,), that a value's sensitivity is to
    colors: NDArray[np.floating] | None = None  # (256, 3) of the colour TF, for figures
    whole_scale: float | None = None
    """End of the scale of all values' fields, to colour a value's field by it; see
    :func:`model.sensitivity.display.global_scale`."""
    scale: ValueScale = "linear"

    @property
    def scalar_values(self) -> NDArray[np.float64]:
        """The 256 scalar values in the data's units."""
        return values_at(np.linspace(*self.scalar_range, TF_SAMPLES), self.scale)

    @property
    def in_window(self) -> NDArray[np.bool_]:
        """Whether each of the 256 values is of interest."""
        lo, hi = self.scalar_window
        places = np.linspace(*self.scalar_range, TF_SAMPLES)
        return (places >= lo) & (places <= hi)

    @property
    def axis_label(self) -> str:
        """Label of an axis of scalar values."""
        return f"scalar value{f' ({self.units})' if self.units else ''}"


def save_numbers(path: Path, result: SensitivityResult) -> None:
    """Write a result as ``.npz``, or as ``.csv`` with a line per number; else `RenderError`."""
    suffix = path.suffix.lower()
    if suffix not in NUMBER_SUFFIXES:
        raise RenderError(f"{path}: numbers are written to a .npz or a .csv file; name one.")
    if suffix == ".npz":
        buffer, names = io.BytesIO(), ("scalar_values", "opacity", "image", "sensitivity")
        np.savez_compressed(buffer, **{name: getattr(result, name) for name in names})
        content = buffer.getvalue()
    else:
        content = _csv(result)
    with os_errors_as(RenderError, f"{path}: it cannot be written"):
        write_atomically(path, content)


def _csv(result: SensitivityResult) -> bytes:
    found, values = result.sensitivity, result.scalar_values.tolist()
    rows: Iterable[Iterable[Any]]
    if result.kind == "region":
        header: tuple[str, ...] = ("scalar_value", "opacity", "sensitivity")
        rows = zip(values, result.opacity.tolist(), found.tolist(), strict=True)
    elif result.kind == "value":
        header = ("row", "column", "red", "green", "blue")
        rows = (
            (row, column, *found[row, column].tolist())
            for row, column in np.ndindex(found.shape[:2])
        )
    else:
        header = ("row", "column", "scalar_value", "sensitivity")
        rows = (
            (row, column, values[i], found[row, column, i].item())
            for row, column, i in np.ndindex(*found.shape)
        )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue().encode()
