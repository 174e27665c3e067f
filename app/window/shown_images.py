"""Both images as they are on the screen: what a figure or movie begins with."""

from __future__ import annotations

from app.image_view.engine_pane import EnginePane
from app.image_view.picture import Background
from app.state.brightness import Brightness
from app.state.reference_work import ReferenceWork
from app.window.difference import Image
from app.window.figure import GAP, Subject, Which
from app.window.image_error import ImageError
from app.window.overlays import Overlays

Size = tuple[int, int]


class ShownImages:
    """Knows which images are there, how large they are, and what lies over them."""

    def __init__(
        self,
        generator: EnginePane,
        reference: EnginePane,
        overlays: Overlays,
        error: ImageError,
        brightness: Brightness,
        reference_work: ReferenceWork,
    ) -> None:
        self.panes = {"generator": generator, "reference": reference}
        self._overlays = overlays
        self._error = error
        self._brightness = brightness
        self._work = reference_work

    @property
    def subject(self) -> Subject:
        """The volume that they show."""
        return self._overlays.subject

    @property
    def is_path_traced(self) -> bool:
        """Whether the ground truth has path-traced light."""
        return self._work.settings.lighting == "path"

    @property
    def background(self) -> Background:
        """Background of the images."""
        return self._overlays.background

    @property
    def legend(self) -> bool:
        """Whether they have a colour legend."""
        return self._overlays.has_legend

    @property
    def scale_bar(self) -> bool:
        """Whether they have a scale bar."""
        return self._overlays.has_scale_bar

    @property
    def compared(self) -> tuple[Image, Image] | None:
        """Both images, (H, W, 3), as far as they show the same; else None."""
        return self._error.compared

    def brightness(self, name: str) -> float:
        """Brightness of one of them."""
        return self._brightness.of(self.panes[name].engine)

    def sizes(self) -> dict[Which, Size]:
        """Width and height, in pixels of the screen, of all that can be drawn now."""
        found: dict[Which, Size] = {}
        for which in ("reference", "generator"):
            pane = self.panes[which]
            image = pane.canvas.image
            if image is None or not pane.client.is_ready:
                continue
            found[which] = image.width(), image.height()
            if pane.engine == "exact":
                # An image that is still refined has fewer pixels than it will have.
                whole = pane.canvas.picture_rect.size() * pane.canvas.devicePixelRatioF()
                found[which] = max(found[which], (whole.width(), whole.height()))
        if len(found) == 2:
            side = min(found["reference"])
            found["both"] = round(2 * side / (1 - GAP)), side
            if self.compared is not None:
                found["difference"] = side, side
        return found

    def which(self) -> Which:
        """What of them is on the screen."""
        seen = [name for name, pane in self.panes.items() if pane.isVisible()]
        if "generator" not in seen:
            return "reference"
        if self._error.is_wanted:
            return "difference"
        return "both" if "reference" in seen else "generator"
