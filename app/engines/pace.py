"""Sizes of images and answers that can be computed in time, from the times of earlier ones."""

from collections.abc import Iterator, Sequence

from model.rendering.raster import TIME_GROWTH, Raster

SCALES = (1.0, 0.75, 0.5, 0.35, 0.25, 0.18)  # sizes of an image, as fractions of the whole one
LEAST_SCALE = 0.12  # of an image where the smallest of these takes more than twice its time
SOON_SECONDS = 0.2  # time for a first, coarse image at rest, if all pixels take longer
SHARP_SECONDS = 0.6  # longest time for all pixels without a coarser image before them
REST_SECONDS = 2.0  # time for the image after a first, coarse one
BRIEF_SECONDS = 5.0  # longest time for an image that another renderer's replaces soon
BETWEEN = 0.5  # greatest width of an image before that of all pixels, which it delays

LONGEST_SECONDS = 120.0
"""Longest time for an image of all pixels; it has fewer if that is not enough, unless the user
chose their number."""

FINER = 1.2  # smallest factor by which the next image is wider
FIRST_SIZE = 384  # largest side of the first image, whose time per pixel is unknown

FIRST_SCALE, FIRST_SLOW_SCALE = 0.35, 0.25
"""Width of the first image, as a fraction of the whole one's, without and with slow light."""


class Pace:
    """Remembers the time of each kind of answer, which may grow as a power of the pixels."""

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
            # The first answer includes the time for loading and compiling.
            self._first.remove(kind)
            self._per_pixel[kind] = min(before, now)
        else:
            # One slow answer, while something else runs, does not count in full.
            self._per_pixel[kind] = (before + now) / 2

    def forget(self) -> None:
        """Forget all times: they differ for another volume or light."""
        self._per_pixel.clear()
        self._first.clear()

    def expected(self, kind: object, size: float) -> float | None:
        """Return the expected seconds of an answer; None if unknown."""
        per_pixel = self._per_pixel.get(kind)
        return None if per_pixel is None else per_pixel * self._pixels(size)

    def scale(self, kind: object, size: float, seconds: float, first: float) -> float:
        """Return the largest of :data:`SCALES` at which an image takes at most some seconds.

        Where the smallest takes twice as long, it is :data:`LEAST_SCALE`: the machine is busy.
        """
        per_pixel = self._per_pixel.get(kind)
        if per_pixel is None:
            return first
        takes = {scale: per_pixel * self._pixels(scale * size) for scale in SCALES}
        is_hopeless = takes[SCALES[-1]] > 2 * seconds
        last = LEAST_SCALE if is_hopeless else SCALES[-1]
        return next((scale for scale in SCALES if takes[scale] <= seconds), last)

    def _pixels(self, size: float) -> float:
        """Effective number of pixels."""
        return float(size ** (2 * self._growth))


class Sizes(Pace):
    """Chooses the sizes of images; the first one has part of the width."""

    def __init__(self, first: float = FIRST_SCALE) -> None:
        # Much of the time of small images does not depend on their pixels.
        super().__init__(TIME_GROWTH)
        self._first_part = first

    def is_slow(self, kind: object, raster: Raster, seconds: float = SHARP_SECONDS) -> bool:
        """Return whether a coarse image is drawn before one of this size."""
        expected = self.expected(kind, raster.side)
        return expected is None or expected > seconds

    def within(self, kind: object, whole: Raster, seconds: float) -> Raster:
        """Return the largest size, up to the whole image's, that can be drawn in time."""
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
        """Yield the sizes of ever finer images, and whether each is the last.

        The time that one took determines the size of the next. None is coarser than the shown
        image, whose width is given, except the last one if time runs out.
        """
        finest, limits = None, list(limits if self.is_slow(kind, whole) else limits[-1:])
        while limits:
            seconds = limits.pop(0)
            is_known = self.expected(kind, whole.side) is not None
            raster = self.within(kind, whole, seconds) if limits or is_known else whole
            if limits and raster != whole:
                raster = min(raster, whole.scaled(BETWEEN), key=lambda each: each.width)
            if finest is not None and raster.width <= FINER * finest.width:
                raster = finest
            is_last = raster.width >= whole.width or (not limits and raster == finest)
            if raster.width > FINER * width or (must_end and (is_last or not limits)):
                finest, width = raster, raster.width
                yield raster, is_last
                if not limits and not is_last:
                    # Once more: compiling or other work may have delayed the last image.
                    limits = [seconds]
            if is_last:
                return
