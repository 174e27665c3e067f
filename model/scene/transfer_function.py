"""Opacity and colour transfer functions (TFs), and the file format of a pair.

All scalar values are in the data's own units, or their logarithms on a logarithmic scale. For a
renderer or a network a TF is sampled at 256 values spread evenly over the volume's scalar range,
both ends included (the paper's t_o and t_c, section 4). Only in files, values may be fractions of
whatever range a volume has.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from model.errors import TransferFunctionError, os_errors_as
from model.files import write_atomically
from model.json_files import MalformedError, build, read_json
from model.scene.value_scale import ValueScale

TF_SAMPLES = 256  # resolution at which TFs are sampled, the paper's n_t
FILE_VERSION = 1

Range = tuple[float, float]
Point = tuple[float, float]
Stop = tuple[float, float, float, float]


@dataclass(frozen=True)
class GaussianMode:
    """Gaussian mode of an opacity TF: ``amplitude * exp(-(s - mean)^2 / width^2)``."""

    mean: float
    width: float  # in the data's own units; width > 0 (there is no 1/2 in the exponent)
    amplitude: float  # opacity at the mean, 0..1

    def __post_init__(self) -> None:
        if not math.isfinite(self.mean):
            raise TransferFunctionError(f"A mode's mean is {self.mean}; give a finite number.")
        if not (math.isfinite(self.width) and self.width > 0):
            raise TransferFunctionError(
                f"A mode's width is {self.width:g}; give a number above 0, in the data's units."
            )
        if not 0 <= self.amplitude <= 1:
            raise TransferFunctionError(
                f"A mode's amplitude is {self.amplitude:g}; give an opacity from 0 to 1."
            )


@dataclass(frozen=True)
class OpacityTF:
    """Opacity as a function of the scalar value: Gaussian modes or a free curve.

    Raises :class:`TransferFunctionError` for a range that is not increasing, points that are not
    sorted or opacities outside 0..1, or modes and points given together.
    """

    scalar_range: Range  # the range the TF was made for, lowest first
    modes: tuple[GaussianMode, ...] = ()
    """Opacity is ``min(1, sum of the modes)``. Modes narrower than one bin (1/256 of the range)
    are drawn one bin wide, so that sampling misses none; over a narrower range they are what
    they are."""
    points: tuple[Point, ...] = ()
    """A free curve, linear between the points and constant outside them; used instead of modes if
    not empty."""
    scale: ValueScale = "linear"  # scale of all its values and widths, see `value_scale`

    def __post_init__(self) -> None:
        check_range(self.scalar_range)
        if self.modes and self.points:
            raise TransferFunctionError(
                "An opacity TF has either modes or points; remove one of the two."
            )
        check_increasing([p[0] for p in self.points], "opacity points")
        for value, opacity in self.points:
            if not 0 <= opacity <= 1:
                raise TransferFunctionError(
                    f"The opacity {opacity:g} at value {value:g} is outside 0 to 1."
                )

    @property
    def bin_width(self) -> float:
        """Width of one of the 256 bins of the scalar range, the least that modes are drawn with."""
        return (self.scalar_range[1] - self.scalar_range[0]) / TF_SAMPLES

    def __call__(self, values: ArrayLike) -> NDArray[np.float64]:
        """Opacity (0..1) at scalar values of any shape."""
        s = np.asarray(values, dtype=np.float64)
        if self.points:
            xs, ys = np.array(self.points).T
            return np.asarray(np.interp(s, xs, ys))
        total = np.zeros_like(s)
        for mode in self.modes:
            width = max(mode.width, self.bin_width)
            total += mode.amplitude * np.exp(-(((s - mode.mean) / width) ** 2))
        return np.minimum(total, 1.0)

    def sample(
        self, scalar_range: Range | None = None, count: int = TF_SAMPLES
    ) -> NDArray[np.float32]:
        """Sample (count,) evenly over a range (the TF's own by default), both ends included."""
        return self(np.linspace(*(scalar_range or self.scalar_range), count)).astype(np.float32)


@dataclass(frozen=True)
class ColorTF:
    """Colour as a function of the scalar value: stops, linear in RGB between them.

    Raises :class:`TransferFunctionError` for no stops, stops that are not sorted, or components
    outside 0..1.
    """

    scalar_range: Range  # the range the TF was made for, lowest first
    stops: tuple[Stop, ...]  # sorted by value, components in 0..1; constant outside the stops

    def __post_init__(self) -> None:
        check_range(self.scalar_range)
        if not self.stops:
            raise TransferFunctionError("A colour TF needs at least one stop: [value, r, g, b].")
        check_increasing([s[0] for s in self.stops], "colour stops")
        for value, *rgb in self.stops:
            if not all(0 <= c <= 1 for c in rgb):
                raise TransferFunctionError(
                    f"The colour {tuple(rgb)} at value {value:g} is outside 0 to 1."
                )

    def __call__(self, values: ArrayLike) -> NDArray[np.float64]:
        """RGB (0..1) at scalar values of shape S, as an array of shape S + (3,)."""
        s = np.asarray(values, dtype=np.float64)
        table = np.array(self.stops)
        return np.stack([np.interp(s, table[:, 0], table[:, c]) for c in (1, 2, 3)], axis=-1)

    def sample(
        self, scalar_range: Range | None = None, count: int = TF_SAMPLES
    ) -> NDArray[np.float32]:
        """Sample (count, 3) evenly over a range (the TF's own by default), both ends included."""
        return self(np.linspace(*(scalar_range or self.scalar_range), count)).astype(np.float32)


@dataclass(frozen=True)
class TransferFunction:
    """An opacity TF and a colour TF over one scalar range.

    Raises :class:`TransferFunctionError` for a relative TF with values outside 0..1.
    """

    opacity: OpacityTF
    color: ColorTF
    is_relative: bool = False
    """Whether the values are not scalars, but fractions of any volume's scalar range. The TF shows
    nothing meaningful before :func:`model.scene.ranges.fit_to_range` has made scalars of them."""

    def __post_init__(self) -> None:
        if not self.is_relative:
            return
        opacity, color = self.opacity, self.color
        values = [
            *opacity.scalar_range,
            *(mode.mean for mode in opacity.modes),
            *(point[0] for point in opacity.points),
            *(stop[0] for stop in color.stops),
        ]
        for value in values:
            if not 0 <= value <= 1:
                raise TransferFunctionError(
                    f"The value {value:g} is no fraction from 0 to 1 of a volume's range; "
                    'if values are in the data\'s own units, add their "range": [lowest, highest].'
                )

    @property
    def scalar_range(self) -> Range:
        """Scalar range of both TFs."""
        return self.opacity.scalar_range

    @property
    def scale(self) -> ValueScale:
        """Scale of the values of both TFs."""
        return self.opacity.scale

    def on_scale(self, scale: ValueScale) -> TransferFunction:
        """Return a TF of the same numbers, taken for places on another scale."""
        return replace(self, opacity=replace(self.opacity, scale=scale))

    def to_json(self) -> dict[str, Any]:
        """Return the file's content as plain data."""
        if self.opacity.points:
            opacity: dict[str, Any] = {"points": [list(p) for p in self.opacity.points]}
        else:
            opacity = {"modes": [dict(vars(m)) for m in self.opacity.modes]}
        scalar_range = {} if self.is_relative else {"range": list(self.scalar_range)}
        scale = {} if self.scale == "linear" else {"scale": self.scale}
        return {
            "tfscope_tf": FILE_VERSION,
            **scale,
            **scalar_range,
            "opacity": opacity,
            "color": {"stops": [list(s) for s in self.color.stops]},
        }

    @classmethod
    def from_json(cls, data: Any) -> TransferFunction:
        """Build the pair from a file's content; without a range it is relative.

        Raises :class:`TransferFunctionError` when the content is not a TF of this version.
        """
        if not isinstance(data, dict) or "tfscope_tf" not in data:
            raise TransferFunctionError("It is not a tfscope TF: the key 'tfscope_tf' is missing.")
        if data["tfscope_tf"] != FILE_VERSION:
            raise TransferFunctionError(
                f"Its format version is {data['tfscope_tf']!r}; this tfscope reads {FILE_VERSION}."
            )
        try:
            content = build(_Content, data)
        except MalformedError as error:
            raise TransferFunctionError(
                f"Its content is malformed near {error}; it needs opacity with "
                "modes {mean, width, amplitude} or points [value, opacity], "
                "color stops [value, r, g, b], and range [lo, hi] unless the values are fractions."
            ) from error
        scalar_range = content.range or (0.0, 1.0)
        opacity = OpacityTF(
            scalar_range, content.opacity.modes, content.opacity.points, content.scale
        )
        return cls(opacity, ColorTF(scalar_range, content.color.stops), content.range is None)

    def save(self, path: Path, remedy: str = "choose another place") -> None:
        """Write the file; an existing one is replaced only once the new one is complete.

        Raises :class:`TransferFunctionError` with a remedy if it cannot be written.
        """
        with os_errors_as(TransferFunctionError, f"{path}: the TF cannot be written", remedy):
            write_atomically(path, (json.dumps(self.to_json(), indent=2) + "\n").encode())

    @classmethod
    def load(cls, path: Path) -> TransferFunction:
        """Read a file of :meth:`save`; raise :class:`TransferFunctionError` for any other."""
        try:
            with os_errors_as(TransferFunctionError, f"{path}: the TF file cannot be read"):
                content = read_json(path)
            return cls.from_json(content)
        except MalformedError as error:
            raise TransferFunctionError(f"{path}: the file is not valid JSON ({error}).") from error
        except TransferFunctionError as error:
            raise TransferFunctionError(f"{path}: {error}") from error


MOST_HANDLES = 10_000  # largest number of modes, points or stops of a file


@dataclass(frozen=True)
class _OpacityContent:
    modes: Annotated[tuple[GaussianMode, ...], Meta(max_length=MOST_HANDLES)] = ()
    points: Annotated[tuple[Point, ...], Meta(max_length=MOST_HANDLES)] = ()


@dataclass(frozen=True)
class _ColorContent:
    stops: Annotated[tuple[Stop, ...], Meta(max_length=MOST_HANDLES)]


@dataclass(frozen=True)
class _Content:
    """Content of a TF file; without a range, values are fractions of one.

    On the scale "log" all values and widths are decimal logarithms.
    """

    tfscope_tf: int
    opacity: _OpacityContent
    color: _ColorContent
    range: Range | None = None
    scale: ValueScale = "linear"


def check_range(scalar_range: Range) -> None:
    """Raise :class:`TransferFunctionError` unless the range is finite and increasing."""
    lo, hi = scalar_range
    if not (math.isfinite(lo) and math.isfinite(hi) and lo < hi):
        raise TransferFunctionError(
            f"The scalar range [{lo:g}, {hi:g}] is not increasing; give [lowest, highest]."
        )


def check_increasing(values: Iterable[float], what: str) -> None:
    """Raise :class:`TransferFunctionError` unless the values are finite and do not decrease."""
    array = np.fromiter(values, dtype=np.float64)
    if not np.isfinite(array).all():
        raise TransferFunctionError(f"The {what} hold a value that is not a finite number.")
    if (np.diff(array) < 0).any():
        raise TransferFunctionError(f"The {what} must be sorted by increasing value.")
