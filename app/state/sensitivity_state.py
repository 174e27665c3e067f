"""Questions of the user about sensitivities: regions, a band of values, choices."""

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

from msgspec import Meta
from PySide6.QtCore import QObject, Signal

from model.scene.region import SQUARE, Outline, Reach
from model.scene.tf_perturbation import EDIT_WIDTH
from model.scene.transfer_function import TF_SAMPLES
from model.sensitivity.display import Measure

EngineChoice = Literal["automatic", "exact", "learned"]
Tool = Literal["rectangle", "lasso"]
Layer = Literal["curve", "visible"]

NARROWEST, WIDEST = 1.0, TF_SAMPLES / 8  # limits of the width of edits, in bins
FARTHEST = 1e3  # greatest coordinate of a region's corner, in sides of the image's square

WIDTH_PER_NOTCH = 1.15


@dataclass(frozen=True)
class NamedRegion:
    """A region that the user has drawn."""

    name: str
    outline: Outline

    def __post_init__(self) -> None:
        points = self.outline.points
        if len(points) < 3 or any(abs(place) > FARTHEST for point in points for place in point):
            raise ValueError(f"no region has the corners {points}")


@dataclass(frozen=True)
class Choices:
    """Choices of how sensitivities are measured and shown."""

    shown: bool = True  # whether sensitivities are computed at all
    curve: bool = True  # whether the plot has the curve of changes of a region
    whole_curve: bool = False  # whether it has the whole image's curve without an active region
    visible: bool = True  # whether the plot has the area of visibility
    measure: Measure = "signed"
    engine: EngineChoice = "automatic"  # automatic takes the exact engine where it is fast enough
    width: Annotated[float, Meta(ge=NARROWEST, le=WIDEST)] = EDIT_WIDTH  # of edits, in bins
    height: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.05  # opacity of the predicted modes
    locked: bool = False  # whether scales are locked
    panel: bool | None = None  # open or closed by the user; None: open if there is room


@dataclass(frozen=True)
class Band:
    """Scalar values, equal or an interval, whose field is shown."""

    low: float
    high: float
    kept: bool = False  # whether it stays when the mouse leaves
    effect: bool = True  # whether the question is about an edit, not about visibility

    @property
    def values(self) -> tuple[float, float]:
        """Lowest and highest value."""
        return self.low, self.high


class SensitivityState(QObject):
    """Regions, the band of values, the clicked place and the choices."""

    changed = Signal(str)
    """Emitted with "choices", "regions", "band", "place", "carried" or "tool"."""
    finished = Signal(str)  # emitted with "regions" or "band" after a drag or a change

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.choices, self.over_bright = Choices(), False
        self.regions: tuple[NamedRegion, ...] = ()
        self.active: int | None = None
        self.band: Band | None = None
        self.place: tuple[float, float] | None = None
        self.tool: Tool | None = None
        self.dragging = False
        self.count = 0  # number of the last region that was numbered

    @property
    def outline(self) -> Outline:
        """Outline of the active region; the whole image without one."""
        return Outline() if self.active is None else self.regions[self.active].outline

    @property
    def region_name(self) -> str:
        """Name of the active region."""
        return "Whole image" if self.active is None else self.regions[self.active].name

    def choose(self, **changes: Any) -> None:
        """Change some of the :class:`Choices`."""
        choices = replace(self.choices, **changes)
        if choices != self.choices:
            self.choices = choices
            self.changed.emit("choices")

    def set_over_bright(self, over_bright: bool) -> None:
        """Set whether images are over a bright background; changes are those over black."""
        if over_bright != self.over_bright:
            self.over_bright = over_bright
            self.changed.emit("choices")

    def open_panel(self, is_open: bool = True) -> None:
        """Open the panel of values and edits, which also shows sensitivities, or close it."""
        self.choose(panel=is_open, shown=is_open or self.choices.shown)

    @property
    def shows_curve(self) -> bool:
        """Whether the plot has the curve of changes now."""
        return self.choices.shown and bool(getattr(self.choices, self._curve_choice))

    @property
    def _curve_choice(self) -> str:
        return "whole_curve" if self.active is None else "curve"

    def show_layer(self, layer: Layer, on: bool) -> None:
        """Show or hide the curve or the area in the plot; alone if sensitivities were hidden."""
        names = {"curve": self._curve_choice, "visible": "visible"}
        layers = {name: False for name in names.values() if not self.choices.shown}
        layers[names[layer]] = on
        self.choose(shown=True, **layers)

    def widen(self, notches: float) -> None:
        """Make edits wider by notches of the mouse wheel, within the limits."""
        width = self.choices.width * WIDTH_PER_NOTCH**notches
        self.choose(width=min(max(width, NARROWEST), WIDEST))

    def set_tool(self, tool: Tool | None) -> None:
        """Choose what the next drag in an image draws; None to turn the view."""
        if tool != self.tool:
            self.tool = tool
            self.changed.emit("tool")

    def add_region(self, outline: Outline) -> None:
        """Add a region with a name of its own, and make it the active one."""
        self.count += 1
        self.regions = (*self.regions, NamedRegion(f"Region {self.count}", outline))
        self.active = len(self.regions) - 1
        self.pick(None)
        self.changed.emit("regions")

    def change_region(self, outline: Outline, reach: Reach = SQUARE) -> None:
        """Move or reshape the active region during a drag; some of it stays within reach."""
        outline = outline.kept_inside(reach)
        if self.active is not None and outline != self.outline:
            self._replace_active(replace(self.regions[self.active], outline=outline))
            self.dragging = True
            self.changed.emit("regions")

    def finish(self, what: Literal["regions", "band"]) -> None:
        """End a drag of a region or of the band."""
        self.dragging = False
        self.finished.emit(what)

    def rename_region(self, name: str) -> None:
        """Name the active region; an empty name is ignored."""
        if self.active is not None and name.strip():
            self._replace_active(replace(self.regions[self.active], name=name.strip()))
            self.changed.emit("regions")

    def remove_region(self) -> None:
        """Remove the active region; then the whole image is active."""
        if self.active is not None:
            regions = self.regions
            self.regions = regions[: self.active] + regions[self.active + 1 :]
            self.activate(None)

    def activate(self, index: int | None) -> None:
        """Make a region the active one; None for the whole image. Its answer is asked for now."""
        self.active = index
        self.pick(None)
        self.changed.emit("regions")
        self.finished.emit("regions")

    def hover(self, value: float | None, effect: bool = True) -> None:
        """Show a field of a value under the mouse, or none, unless a band is kept."""
        if self.band is None or not self.band.kept:
            self._set_band(None if value is None else Band(value, value, effect=effect))

    def drag_band(self, one: float, other: float, effect: bool = True) -> None:
        """Show a field of an interval while it is dragged."""
        self.dragging = True
        self._set_band(Band(min(one, other), max(one, other), kept=True, effect=effect))

    def show_effect(self, effect: bool) -> None:
        """Show what an edit at the value under the mouse would change, or where it is visible."""
        if self.band is not None and not (self.band.kept or self.dragging):
            self._set_band(replace(self.band, effect=effect))

    def keep(self, low: float | None = None, high: float | None = None) -> None:
        """Keep the present band, or another one."""
        if low is not None:
            self._set_band(Band(low, low if high is None else high, kept=True))
        elif self.band is not None:
            self._set_band(replace(self.band, kept=True))
        self.finished.emit("band")

    def release(self) -> None:
        """Hide the field until the mouse is over a value."""
        self._set_band(None)

    def pick(self, place: tuple[float, float] | None) -> None:
        """Ask what shows at a place of the image; None for nowhere."""
        if place != self.place:
            self.place = place
            self.changed.emit("place")

    def carry(self, place: tuple[float, float]) -> None:
        """Move the clicked place with what showed there, in a view that has changed."""
        if self.place is not None:
            self.place = place
            self.changed.emit("carried")

    def start_volume(
        self,
        is_next: bool,
        regions: tuple[NamedRegion, ...] = (),
        active: int | None = None,
        count: int = 0,
    ) -> None:
        """Take another volume's regions; a time step without regions keeps the present ones."""
        if regions or not is_next:
            had_any, self.regions, self.count = bool(self.regions), regions, count
            if had_any or regions:
                self.activate(active)
        self._set_band(None)
        self.pick(None)

    def _replace_active(self, region: NamedRegion) -> None:
        regions = list(self.regions)
        assert self.active is not None
        regions[self.active] = region
        self.regions = tuple(regions)

    def _set_band(self, band: Band | None) -> None:
        if band != self.band:
            self.band = band
            self.changed.emit("band")
