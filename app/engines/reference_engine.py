"""The ray caster, which draws at once and while something moves, and VTK, which draws at rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from app.engines.drawer import Drawer
from app.engines.image import Image
from app.engines.renderer_engine import RendererEngine
from app.engines.requests import UNWATCHED, ImageRequest, Request, Watch
from app.engines.sizes import SOON_SECONDS
from model.rendering.raster import Raster

STAND_IN_SECONDS = 1.5
"""Time that the ray caster's image at rest may take, which is shown until VTK's is there."""


class ReferenceEngine(RendererEngine):
    """Draws by the ray caster until VTK is opened, which follows its first image at rest.

    From then on VTK's image at rest follows the ray caster's, unless it is there as soon. Without a
    graphics card, and where VTK fails, the ray caster's is the last.

    Parameters
    ----------
    drawer : Drawer
        Of the ray caster.
    open_final : callable
        Opens what draws at rest, given that; it may be the ray caster again.
    """

    def __init__(self, drawer: Drawer, open_final: Callable[[Drawer], Drawer]) -> None:
        super().__init__(drawer)
        self._open_final = open_final
        self._final: Drawer | None = None

    def _moving(self, request: Request, raster: Raster, watch: Watch = UNWATCHED) -> Image:
        image = super()._moving(request, raster, watch)
        return replace(image, stands_in=self._final is not self._drawer)

    def _resting(self, request: ImageRequest, watch: Watch, width: int) -> Iterator[Image]:
        whole, preview = request.quality.pixels, None
        if width < whole.width and self._is_slow(whole):
            limits = SOON_SECONDS, STAND_IN_SECONDS
            for preview in self._drawer.resting(request, watch, width, limits):
                yield replace(preview, is_last=False, stands_in=True)
                width = preview.width
        final = self._own()
        if preview is not None and final.by_raycast and width >= whole.width:
            yield replace(preview, by=final.description)
            return
        yield from final.resting(request, watch, width)

    def _is_slow(self, whole: Raster) -> bool:
        """Whether the ray caster's image is to be seen before the last one."""
        final = self._final
        return final is None or (not final.by_raycast and final.is_slow(whole))

    def _own(self) -> Drawer:
        if self._final is None:
            self._final = self._open_final(self._drawer)
            if self._final.by_raycast:
                self._drawer = self._final
        return self._final

    def close(self) -> None:
        """Release both."""
        super().close()
        if self._final is not None:
            self._final.renderer.close()
