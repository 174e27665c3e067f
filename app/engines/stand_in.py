"""The analyst under path-traced light: other lights stand in for its pictures and derivatives."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from app.engines.drawer import Drawer
from app.engines.renderer_engine import RendererEngine
from app.engines.requests import UNWATCHED, Array, BatchRequest, Engine, Watch
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.light import LightDirection
from model.scene.scene import PATH_CURVES, PATH_FIELDS
from model.scene.volume import Volume

FIRST_GUESS_S = 5e-6
"""Expected time of a traced pixel before the first: that on two cores."""

TRACED_SECONDS = 2.0
"""Time of several small pictures up to which they are traced."""

FORGOTTEN = 0.8
"""Factor of the expected time each time that it was too long."""


class StandInEngine(RendererEngine):
    """Draws in soft light, the nearest to path-traced light, in which its fields are, too.

    Parameters
    ----------
    sample_distance : float
        Of final images, in voxels.
    tracing : callable, optional
        Builds what traces small pictures that are wanted so, where there is time for them.
    """

    def __init__(
        self,
        volume: Volume,
        light: LightDirection | None,
        sample_distance: float,
        tracing: Callable[[], Engine] | None = None,
    ) -> None:
        place = light, sample_distance
        super().__init__(Drawer(RaycastRenderer(volume, PATH_FIELDS, *place), sample_distance))
        self._curves, self._tracing = RaycastRenderer(volume, PATH_CURVES, *place), tracing
        self._tracer: Engine | None = None
        self._traced_seconds = FIRST_GUESS_S

    def images(self, request: BatchRequest, watch: Watch = UNWATCHED) -> Array:
        """Trace the images if that is wanted and fast enough; else draw them in soft light."""
        pixels = request.quality.pixels
        count = pixels.columns * pixels.rows * (1 + len(request.more))
        if not request.traced or self._tracing is None:
            return super().images(request, watch)
        if self._traced_seconds * count > TRACED_SECONDS:
            # The processors may have been busy: another time it is tried again.
            self._traced_seconds *= FORGOTTEN
            return super().images(request, watch)
        if self._tracer is None:
            self._tracer = self._tracing()
            # What is loaded then says nothing of the next ones.
            self._tracer.images(replace(request, more=()), watch)
        begun = time.perf_counter()
        images = self._tracer.images(request, watch)
        self._traced_seconds = (time.perf_counter() - begun) / count
        return images

    def close(self) -> None:
        """Release all of them."""
        super().close()
        self._curves.close()
        if self._tracer is not None:
            self._tracer.close()

    def _of_curves(self) -> RaycastRenderer:
        return self._curves
