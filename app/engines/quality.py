"""Size and quality of an image that an engine is asked for."""

from __future__ import annotations

from dataclasses import dataclass

from model.rendering.raster import Raster

GOOD_ENOUGH = 0.003
"""Error of an image, root mean square of its colours, that no eye sees: less than an 8-bit step."""


@dataclass(frozen=True)
class Quality:
    """Quality of a requested image; generators have a fixed size.

    Attributes
    ----------
    size : int
        Width and height in pixels; of a picture that is not square, the shorter of the two.
    coarseness : float
        Factor of a renderer's sample distance in small pictures.
    live : bool
        True while the user is dragging and speed matters more than quality.
    raster : Raster or None
        Pixels of a picture that is not square; None for a square one.
    samples : int
        Of each pixel of a path-traced picture to save; other renderers ignore it.
    """

    size: int
    coarseness: float = 1.0
    live: bool = False
    raster: Raster | None = None
    samples: int = 1

    @property
    def pixels(self) -> Raster:
        """Pixels of the picture."""
        return self.raster or Raster(self.size, self.size)
