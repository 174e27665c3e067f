"""The edited state: view, light, crop box and transfer function (TF), with undo."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from math import ceil, floor, isclose
from types import MappingProxyType
from typing import Any

from PySide6.QtCore import QObject, Signal

from app.engines.background import Pause
from app.engines.client import EngineName
from app.state.edited_tf import EditedTF, PaneName
from app.state.edits import Brightness, EditedInput, EditHistory, Lit
from app.state.view_navigation import ViewNavigation
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.ranges import fit_to_range, range_text, value_text
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF, Range, TransferFunction
from model.scene.value_scale import ValueScale
from model.scene.volume import FileFacts

STEP_MS = 33  # between two steps of a drag: a mouse sends more than can be drawn
INTERVAL_S = 0.15  # between two refreshes while something moves: plots take long to paint


class DelayedRefreshes(QObject):
    """Collects refreshes while something moves, so that shared parts are painted rarely."""

    def __init__(self, moves: Callable[[], bool], parent: QObject) -> None:
        super().__init__(parent)
        self._moves = moves
        self._waiting: dict[Callable[..., object], Callable[..., object]] = {}
        self._refreshed = -INTERVAL_S
        self._timer = Pause(self, 0, self.catch_up)

    def soon(self, refresh: Callable[[], object]) -> Callable[..., None]:
        """Return a slot that requests a refresh."""
        return lambda *_: self.ask(refresh, refresh)

    def ask(self, name: Callable[..., object], refresh: Callable[[], object]) -> None:
        """Request a refresh, which replaces a waiting one of the same name."""
        self._waiting[name] = refresh
        if not self._moves():
            self.catch_up()
        elif not self._timer.isActive():
            passed = time.monotonic() - self._refreshed
            self._timer.start(max(round(1000 * (INTERVAL_S - passed)), 0))

    def catch_up(self) -> None:
        """Do all waiting refreshes."""
        waiting, self._waiting = self._waiting, {}
        self._timer.stop()
        self._refreshed = time.monotonic()
        for refresh in waiting.values():
            refresh()


EMPTY_TF = TransferFunction(
    OpacityTF((0.0, 1.0)), ColorTF((0.0, 1.0), ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0)))
)
"""TF before a volume is opened."""


class ViewerState(ViewNavigation):
    """View, light, crop box, TF and brightness of both images.

    Every edit can be undone, except changes of the view (:class:`ViewNavigation`). `edited` has all
    other inputs than view and TF, by their names in :class:`~model.scene.inputs.SceneInputs`.
    """

    volumeStarting = Signal()  # emitted before another volume's TF replaces the present one
    inputsChanged = Signal()  # emitted with each of the changes of view, TF, light and crop box
    inputsChangeFinished = Signal()  # emitted at the end of each change: a final image follows

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.edits = EditHistory(self)
        self.tf_input = EditedTF(EMPTY_TF, self.edits, self)
        self.crop_input = _EditedCrop(None, "crop", self.edits, self)
        plain = partial(EditedInput[Any], None, history=self.edits, parent=self)
        self.clip_input: EditedInput[ClipPlane | None] = plain("clipping plane")
        self.interpolation_input: EditedInput[bool | None] = plain("interpolation")
        self.mask_input: EditedInput[Mask | None] = plain("mask")
        self.edited: dict[str, EditedInput[Any]] = {
            "light": _EditedLight(None, "move light", self.edits, self),
            # None means that B has the light of A.
            "light_b": plain("move light of B"),
            "crop": self.crop_input,
            "clip": self.clip_input,
            "interpolates": self.interpolation_input,
            "mask": self.mask_input,
        }
        self.brightness = Brightness(self.edits, self)
        self.file, self.units = FileFacts(), ""  # of the volume's values; may be empty
        self.default = EMPTY_TF  # TF that :meth:`reset_transfer_function` returns to
        self.viewChanged.connect(self.inputsChanged)
        self.viewChangeFinished.connect(self.inputsChangeFinished)
        for each in (self.tf_input, *self.edited.values()):
            each.changed.connect(self.inputsChanged)
            each.changeFinished.connect(self.inputsChangeFinished)
        self.refreshes = DelayedRefreshes(lambda: self.live, self)
        self.inputsChangeFinished.connect(self.refreshes.catch_up)

    @property
    def transfer_function(self) -> TransferFunction:
        """The TF under edit, over the volume's scalar range."""
        return self.tf_input.value

    @property
    def light_input(self) -> EditedInput[LightDirection | None]:
        """Light of the pane that has the focus."""
        return self.edited["light_b" if self.tf_input.pane == "B" else "light"]

    @property
    def light(self) -> LightDirection | None:
        """Direction of that pane's light, if it can be moved; None for the scene's light."""
        return self.inputs.light

    @property
    def crop(self) -> CropBox | None:
        """Part of the volume that is shown; None for all of it."""
        return self.crop_input.value

    @property
    def clip(self) -> ClipPlane | None:
        """Plane beyond which the volume is cut away; None for none."""
        return self.clip_input.value

    def face_clip(self) -> None:
        """Turn the clipping plane to the viewer; a new one cuts through the middle."""
        point, proportions = self.pivot, self.proportions
        if self.clip is not None:
            point = self.clip.nearest(point, proportions)
        self.clip_input.set(ClipPlane.through(point, self.view.basis()[2], proportions))

    def flip_clip(self) -> None:
        """Cut away the other side of the clipping plane, if there is one."""
        if self.clip is not None:
            self.clip_input.set(self.clip.flipped, "flip the plane")

    def show_whole(self) -> None:
        """Show all of the volume: one edit."""
        with self.edits.as_one("whole volume"):
            self.crop_input.set(None)
            self.clip_input.set(None)

    @property
    def interpolates(self) -> bool:
        """Whether there are values between voxels."""
        chosen = self.interpolation_input.value
        return not self.file.is_labels if chosen is None else chosen

    def set_interpolates(self, interpolates: bool) -> None:
        """Interpolate between voxels, or not: an edit that can be undone."""
        is_usual = interpolates != self.file.is_labels
        self.interpolation_input.set(None if is_usual else interpolates)

    def show_all_voxels(self) -> None:
        """Remove the mask: an edit that can be undone."""
        self.mask_input.set(None, "show all voxels")

    def label_name(self, value: float) -> str:
        """Name of the label with a rounded value; empty for none."""
        names = (label.name for label in self.file.labels if isclose(label.value, value))
        return next(names, "")

    def value_text(self, value: float) -> str:
        """Write a value to within a bin of the TF, with its unit; a label by name or number."""
        text = value_text(value, self.scalar_range, self.scale)
        text = text if self.interpolates else f"{float(text):.9g}"
        return self.label_name(value) or f"{text} {self.units}".rstrip()

    def range_text(self, values: Range) -> str:
        """Write values as a range with its unit; one label as :meth:`value_text` does."""
        if self.file.is_labels and (first := ceil(values[0])) <= (last := floor(values[1])):
            return f"{first} to {last}" if first < last else self.value_text(first)
        low, high = (self.value_text(value) for value in values)
        is_label = low == high and not self.interpolates
        text = low if is_label else range_text(values, self.scalar_range, self.scale)
        return f"{text} {self.units}".rstrip()

    def lit(self, engine: EngineName) -> Lit:
        """Return the owner of the light of an engine's image in the pane with the focus."""
        return "b" if engine == "exact" and self.tf_input.pane == "B" else engine

    @property
    def inputs(self) -> SceneInputs:
        """Current scene inputs of the pane that has the focus."""
        return self.inputs_of(self.tf_input.pane)

    @property
    def square_inputs(self) -> SceneInputs:
        """The current scene inputs of square pictures, which show as much as the image."""
        inputs = self.inputs
        return replace(inputs, view=self.for_square(inputs.view))

    def inputs_of(self, pane: PaneName) -> SceneInputs:
        """Return a pane's current scene inputs: all but TF and light are shared."""
        others = {name: each.value for name, each in self.edited.items()}
        light_b = others.pop("light_b")
        if pane == "B" and others["light"] is not None:
            others["light"] = light_b or others["light"]
        tf = self.tf_input.of(pane) or self.transfer_function
        return SceneInputs.of(self.view, tf, **others)

    @property
    def scalar_range(self) -> Range:
        """The volume's scalar range, in its own units."""
        return self.transfer_function.scalar_range

    @property
    def scale(self) -> ValueScale:
        """Scale of the TF's values."""
        return self.transfer_function.scale

    @property
    def live(self) -> bool:
        """True during a drag of the view, the light, the crop box or the TF."""
        edited = self.tf_input, *self.edited.values()
        return self._view_moving or any(each.moving for each in edited)

    def start_light(self, light: LightDirection | None) -> None:
        """Take the light of another volume or lighting, which is no edit; None for the scene's."""
        if light != self.edited["light"].value:
            self.edited["light"].start(light)

    def start_volume(
        self,
        default: TransferFunction,
        current: TransferFunction | None,
        others: Mapping[str, Any] = MappingProxyType({}),
        file: FileFacts | None = None,
        units: str = "",
    ) -> None:
        """Start editing another volume's TF, clearing the undo stack.

        Without a current TF, which is fitted to the scalar range, it is the default. Other inputs
        have first values by name, and B a TF (`tf_b`) and a look (`look_b`) if there are any, shown
        where it `compares`; the light stays, see :meth:`start_light`.
        """
        self.volumeStarting.emit()
        self.edits.stack.clear()
        self.default, self.file, self.units = default, file or FileFacts(), units
        for name, each in self.edited.items():
            if name != "light":
                each.start(others.get(name))
        known = current, others.get("tf_b")
        of_scale = (each if each and each.scale == default.scale else None for each in known)
        tf, tf_b = (each and fit_to_range(each, default.scalar_range) for each in of_scale)
        compares = bool(others.get("compares"))
        self.tf_input.start(tf or default, tf_b, compares, others.get("look_b"))
        if self.tf_input.compares:
            self.tf_input.focus(others.get("pane", "A"))

    def reset_transfer_function(self) -> None:
        """Restore the volume's default TF, as an edit that can be undone."""
        self.tf_input.exchange(self.default, "reset")


class _EditedLight(EditedInput[LightDirection | None]):
    def _may_return(self, value: LightDirection | None) -> bool:
        # The light stays unlit or fixed if it is.
        return self.value is not None and value is not None


class _EditedCrop(EditedInput[CropBox | None]):
    def _normal(self, value: CropBox | None) -> CropBox | None:
        return None if value is None or value.is_whole else value
