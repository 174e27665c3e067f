"""Sizes of images that keep up with the mouse, by the time that they took before."""

from __future__ import annotations

SCALES = (1.0, 0.75, 0.5, 0.35, 0.25, 0.18)
"""Sizes of a picture, as fractions of the whole one."""


class Pace:
    """Remembers the time per pixel of each kind of answer.

    Parameters
    ----------
    growth : float
        Power of the number of pixels with which the time is expected to grow.
    """

    def __init__(self, growth: float = 1.0) -> None:
        self._growth = growth
        self._per_pixel: dict[object, float] = {}
        self._first: set[object] = set()

    def note(self, kind: object, size: float, seconds: float) -> None:
        """Note how long an answer of a size took."""
        now = seconds / self._pixels(size)
        before = self._per_pixel.get(kind)
        if before is None:
            self._first.add(kind)
            self._per_pixel[kind] = now
        elif kind in self._first:
            # With the first one, what answers it was loaded or compiled.
            self._first.remove(kind)
            self._per_pixel[kind] = min(before, now)
        else:
            # One slow answer, while something else runs, does not count in full.
            self._per_pixel[kind] = (before + now) / 2

    def forget(self) -> None:
        """Forget all times: another volume or light takes others."""
        self._per_pixel.clear()
        self._first.clear()

    def expected(self, kind: object, size: float) -> float | None:
        """Return the expected seconds of an answer; None if unknown."""
        per_pixel = self._per_pixel.get(kind)
        return None if per_pixel is None else per_pixel * self._pixels(size)

    def scale(self, kind: object, size: float, seconds: float, first: float) -> float:
        """Return the largest of :data:`SCALES` at which a picture takes at most some seconds.

        Parameters
        ----------
        size : float
            Of the whole picture: the square root of its number of pixels.
        first : float
            Scale as long as nothing is known.
        """
        per_pixel = self._per_pixel.get(kind)
        if per_pixel is None:
            return first
        return next(
            (s for s in SCALES if per_pixel * self._pixels(s * size) <= seconds), SCALES[-1]
        )

    def _pixels(self, size: float) -> float:
        """Number of pixels, as far as it counts."""
        return float(size ** (2 * self._growth))
