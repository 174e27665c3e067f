"""A scalar range as it is asked for: by values, or by percentiles of the voxels."""

from __future__ import annotations

import math
from dataclasses import dataclass

from model.errors import TfscopeError, VolumeError
from model.scene.robust_range import percentile_range
from model.scene.transfer_function import Range
from model.scene.value_scale import place_of
from model.scene.volume import Volume


@dataclass(frozen=True)
class RangeChoice:
    """Scalar range over which to look at a volume.

    Attributes
    ----------
    low, high : float
        In the data's own units, or per cent of the voxels, 0 to 100; low < high.

    Raises
    ------
    TfscopeError
        For numbers that do not increase, or percentages beyond 0 to 100.
    """

    low: float
    high: float
    are_percentiles: bool = False

    def __post_init__(self) -> None:
        low, high = self.low, self.high
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise TfscopeError(
                f"The scalar range from {low:g} to {high:g} does not increase; "
                "give its lowest and its highest value."
            )
        if self.are_percentiles and not (low >= 0 and high <= 100):
            raise TfscopeError(
                f"{low:g} and {high:g} per cent are no percentiles; give numbers from 0 to 100."
            )

    @classmethod
    def parse(cls, text: str) -> RangeChoice:
        """Parse ``"LO,HI"``, or ``"LO%,HI%"`` for percentiles.

        Raises
        ------
        TfscopeError
            When the text is not a range.
        """
        parts = [part.strip() for part in text.split(",")]
        are_percentiles = all(part.endswith("%") for part in parts)
        try:
            low, high = (float(p[:-1] if are_percentiles else p) for p in parts)
        except ValueError:
            raise TfscopeError(
                f"'{text}' is not a scalar range; give its lowest and highest value, such as "
                "0,1500, or percentiles of the voxels, such as 1%,99%."
            ) from None
        return cls(low, high, are_percentiles)

    def of(self, volume: Volume) -> Range:
        """Return the range on a volume's scale.

        Raises
        ------
        VolumeError
            When the percentiles are the same value, or a value has no logarithm that the volume's
            scale needs.
        """
        if self.are_percentiles:
            return percentile_range(volume, self.low, self.high)
        if volume.scale == "log" and self.low <= 0:
            raise VolumeError(
                f"{volume.name}: the scalar range from {self.low:g} begins where there is no "
                "logarithm; give one above zero, or the linear scale."
            )
        return place_of(self.low, volume.scale), place_of(self.high, volume.scale)
