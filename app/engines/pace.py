"""Sizes of images and answers for which there is time, by the time that earlier ones took."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from model.rendering.raster import TIME_GROWTH, Raster

SCALES = (1.0, 0.75, 0.5, 0.35, 0.25, 0.18)  # sizes of an image, as fractions of the whole one
SOON_SECONDS = 0.2  # of a first, coarse image at rest, where all pixels take longer
SHARP_SECONDS = 0.6  # of all pixels up to which a coarser image would only hold them up
REST_SECONDS = 3.0  # time that the image after a first, coarse one may take

LONGEST_SECONDS = 120.0
"""Time that an image of all pixels may take, unless their number is the user's choice; otherwise
there are as many as that allows."""

FINER = 1.2  # smallest factor by which the next image is wider
FIRST_SIZE = 384  # largest side of the first image, before it is known how long its pixels take

FIRST_SCALE, FIRST_SLOW_SCALE = 0.35, 0.25
"""Parts of the width that it has, without and with light that takes long."""


class Pace:
    """Remembers the time per pixel of each kind of answer, which may grow by a power of them."""

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
        """Return the largest of :data:`SCALES` at which an image takes at most some seconds.

        The size is the square root of its number of pixels; `first` holds while nothing is known.
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


class Sizes(Pace):
    """Chooses the pixels of images; the first one has a part of the width."""

    def __init__(self, first: float = FIRST_SCALE) -> None:
        # Of small images a good part of the time has nothing to do with their pixels.
        super().__init__(TIME_GROWTH)
        self._first_part = first

    def is_slow(self, kind: object, raster: Raster, seconds: float = SHARP_SECONDS) -> bool:
        """Return whether a coarse image comes before one of these pixels."""
        expected = self.expected(kind, raster.side)
        return expected is None or expected > seconds

    def within(self, kind: object, whole: Raster, seconds: float) -> Raster:
        """Return the most pixels, at most the whole image's, that there is time for."""
        first = min(self._first_part, FIRST_SIZE / whole.side)
        return whole.scaled(self.scale(kind, whole.side, seconds, first))

    def at_rest(
        self,
        kind: object,
        whole: Raster,
        width: int,
        limits: Sequence[float],
        must_end: bool = True,
    ) -> Iterator[tuple[Raster, bool]]:
        """Yield the pixels of ever finer images, and whether it is the last.

        How long one of them took, at most the seconds of its limit, tells the size of the next.
        None is coarser than the image of this width that is shown, but the last where it must end.
        """
        finest, limits = None, list(limits if self.is_slow(kind, whole) else limits[-1:])
        while limits:
            seconds = limits.pop(0)
            is_known = self.expected(kind, whole.side) is not None
            raster = self.within(kind, whole, seconds) if limits or is_known else whole
            if finest is not None and raster.width <= FINER * finest.width:
                raster = finest
            is_last = raster.width >= whole.width or (not limits and raster == finest)
            if raster.width > FINER * width or (must_end and (is_last or not limits)):
                finest, width = raster, raster.width
                yield raster, is_last
                if not limits and not is_last:
                    # Once more: what was compiled or busy before may have held up the last one.
                    limits = [seconds]
            if is_last:
                return
