"""Kinds of light that take too long here for who has not asked for them."""

from __future__ import annotations

from app.engines.messages import Result
from app.engines.requests import ImageRequest
from app.state.dispatcher import FIRST_SIZE
from model.rendering.raster import Raster
from model.scene.scene import Lighting

SLOW_SHADOWS_S = 1.5
"""Time of an image at rest from which nobody is given shadows who has not asked for them."""

FEWER = 1.5
"""Factor of the pixels of an image from which one with fewer is coarse."""

CERTAINLY = 2.0
"""Factor by which a coarse image must foretell more than that time to be believed: what is
prepared for each image weighs more in it."""

SLOW_LIGHT_S = 3.0
"""Time of the ray caster's image in direct light from which nobody is given light who has not asked
for it; that of as many pixels as the first image has, however wide the pane."""


class SlowLights:
    """Kinds of light of a volume that took too long, by the first images in each.

    Each is judged once a volume: nobody wants the light to change later because the machine is
    busy.

    Attributes
    ----------
    found : frozenset of str
        Those that take too long.
    """

    def __init__(self) -> None:
        self.found: frozenset[Lighting] = frozenset()
        self._judged: frozenset[Lighting] = frozenset()

    def judge(self, lighting: Lighting, result: Result, whole: Raster) -> float:
        """Note how long an image took in a light.

        Parameters
        ----------
        lighting : {"none", "direct", "soft", "shadows", "path"}
        result : Result
            Of an image, or of another request, which tells nothing.
        whole : Raster
            Pixels of an image at rest.

        Returns
        -------
        float
            Seconds that such an image takes if this has now been found to be too long; else 0.
        """
        request = result.request
        if lighting in self._judged or result.value is None:
            return 0.0
        if not isinstance(request, ImageRequest) or request.is_measured:
            return 0.0
        if lighting == "shadows":
            return self._judge_shadows(result, whole)
        if lighting == "none" or not request.stands_in or request.quality.live:
            return 0.0
        self._judged |= {lighting}
        share = min(1.0, FIRST_SIZE**2 / _count(request.quality.pixels))
        return self._found(lighting, result.seconds * share, SLOW_LIGHT_S)

    def _judge_shadows(self, result: Result, whole: Raster) -> float:
        request = result.request
        if request.quality.coarseness > 1:
            return 0.0
        factor = _count(whole) / _count(request.quality.pixels)
        is_coarse = factor > FEWER
        if not is_coarse:
            self._judged |= {"shadows"}
        limit = SLOW_SHADOWS_S * (CERTAINLY if is_coarse else 1.0)
        return self._found("shadows", result.seconds * factor, limit)

    def _found(self, lighting: Lighting, seconds: float, limit: float) -> float:
        if seconds <= limit:
            return 0.0
        self._judged |= {lighting}
        self.found |= {lighting}
        return seconds


def _count(raster: Raster) -> int:
    return raster.width * raster.height
