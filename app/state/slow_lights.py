"""Kinds of light that take too long here for who has not asked for them."""

from __future__ import annotations

from app.engines.messages import Result
from app.engines.pace import FIRST_SIZE, FIRST_SLOW_SCALE
from model.rendering.raster import Raster
from model.scene.scene import Lighting

SLOW_SOFT_S = 0.1
"""Time of a moving image from which soft light is not chosen automatically: 10 images a second."""

SLOW_LIGHT_S = 3.0
"""Time of the ray caster's image in direct light from which no light is chosen automatically. The
image has as many pixels as the first one, however wide the pane."""


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
        self._is_loaded = False

    def judge(self, lighting: Lighting, result: Result, whole: Raster) -> float:
        """Note how long an image took in a light.

        Parameters
        ----------
        lighting : {"none", "direct", "soft", "path"}
        result : Result
            Of an image of the reference.
        whole : Raster
            Pixels of an image at rest.

        Returns
        -------
        float
            Seconds that such an image takes if this has now been found to be too long; else 0.
        """
        if lighting in self._judged or result.image is None:
            return 0.0
        if lighting == "soft":
            # By as many pixels as an image has while something moves.
            limit, pixels = SLOW_SOFT_S, FIRST_SLOW_SCALE**2 * whole.width * whole.height
        elif lighting == "direct" and result.image.by_raycast and not result.request.quality.live:
            limit, pixels = SLOW_LIGHT_S, FIRST_SIZE**2
        else:
            return 0.0
        rows, columns = result.image.rgba.shape[:2]
        seconds = result.seconds * min(1.0, pixels / (rows * columns))
        if lighting == "soft" and seconds > limit and not self._is_loaded:
            # With the first image, what draws it was loaded or compiled.
            self._is_loaded = True
            return 0.0
        self._judged |= {lighting}
        if seconds <= limit:
            return 0.0
        self.found |= {lighting}
        return seconds
