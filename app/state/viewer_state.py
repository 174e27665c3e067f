"""The edited state: view, light, crop box and transfer function (TF), with undo.

Signals come in pairs, as in pyqtgraph: `...Changed` at every step of a drag, and
`...ChangeFinished` at its end.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

from app.state.view_navigation import HOME_VIEW, ViewNavigation
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.range_fitting import fit_to_range
from model.scene.transfer_function import ColorTF, OpacityTF, Range, TransferFunction
from model.scene.value_scale import ValueScale

__all__ = ["EMPTY_TF", "HOME_VIEW", "ViewerState"]

EMPTY_TF = TransferFunction(
    OpacityTF((0.0, 1.0)), ColorTF((0.0, 1.0), ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0)))
)
"""TF before a volume is opened."""

SAME_GESTURE_S = 1.0
"""Longest time between two changes of one gesture, such as those of a key that is held."""


class ViewerState(ViewNavigation):
    """View, light and TF of both images.

    Every edit of the TF, the light and the crop box can be undone. A drag is previewed and becomes
    one undo step at its end. The view is :class:`ViewNavigation`'s, with a history of its own.

    Attributes
    ----------
    clock : callable
        Returns the time in seconds.
    """

    volumeStarting = Signal()
    """Emitted before another volume's TF replaces the present one."""
    transferFunctionChanged = Signal(object)
    transferFunctionChangeFinished = Signal(object)
    lightChanged = Signal(object)
    lightChangeFinished = Signal(object)
    cropChanged = Signal(object)
    cropChangeFinished = Signal(object)
    inputsChanged = Signal()
    """Emitted with each of the changes of view, TF, light and crop box."""
    inputsChangeFinished = Signal()
    """Emitted at the end of each: an image of :attr:`inputs` will be the final one."""
    edited = Signal()
    """Emitted after a completed edit, undo or redo by the user."""
    undone = Signal()
    """Emitted after an undo or redo."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.undo_stack = QUndoStack(self)
        self.clock: Callable[[], float] = time.monotonic
        self._default = EMPTY_TF
        self._transfer_function = EMPTY_TF
        self._before_drag: TransferFunction | None = None
        self._light: LightDirection | None = None
        self._light_before: LightDirection | None = None
        self._light_moving = False
        self._crop: CropBox | None = None
        self._crop_before: CropBox | None = None
        self._crop_moving = False
        for changed, finished in (
            (self.viewChanged, self.viewChangeFinished),
            (self.transferFunctionChanged, self.transferFunctionChangeFinished),
            (self.lightChanged, self.lightChangeFinished),
            (self.cropChanged, self.cropChangeFinished),
        ):
            changed.connect(self.inputsChanged)
            finished.connect(self.inputsChangeFinished)

    @property
    def transfer_function(self) -> TransferFunction:
        """The current TF, over the volume's scalar range."""
        return self._transfer_function

    @property
    def light(self) -> LightDirection | None:
        """Direction of a movable light; None for the scene's light."""
        return self._light

    @property
    def inputs(self) -> SceneInputs:
        """Current scene inputs of the images."""
        return SceneInputs.of(
            self._view, self._transfer_function, light=self._light, crop=self._crop
        )

    @property
    def scalar_range(self) -> Range:
        """The volume's scalar range, in its own units."""
        return self._transfer_function.scalar_range

    @property
    def scale(self) -> ValueScale:
        """Scale of the TF's values."""
        return self._transfer_function.scale

    @property
    def live(self) -> bool:
        """True during a drag of the view, the light, the crop box or the TF."""
        moving = self._view_moving or self._light_moving or self._crop_moving
        return moving or self._before_drag is not None

    def move_light(self, light: LightDirection | None) -> None:
        """Change the light during a drag."""
        if light != self._light:
            if not self._light_moving:
                self._light_before = self._light
            self._light = light
            self._light_moving = True
            self.lightChanged.emit(light)

    def finish_light(self) -> None:
        """End a drag of the light, if there is one, making it one undo step."""
        if self._light_moving:
            self._light_moving = False
            self.change(self._show_light, self._light_before, self._light, "move light")

    def set_light(self, light: LightDirection) -> None:
        """Change the light without a drag: one undo step."""
        self.move_light(light)
        self.finish_light()

    def place_light(self, light: LightDirection | None) -> None:
        """Set the light of another volume or lighting, which is no edit; None for the scene's."""
        self._light_moving = False
        if light != self._light:
            self._light = light
            self.lightChanged.emit(light)
            self.lightChangeFinished.emit(light)

    @property
    def crop(self) -> CropBox | None:
        """Part of the volume that is shown; None for all of it."""
        return self._crop

    def move_crop(self, crop: CropBox | None) -> None:
        """Change the crop box during a drag; None, or a box of everything, shows all."""
        crop = None if crop is None or crop.is_whole else crop
        if crop != self._crop:
            if not self._crop_moving:
                self._crop_before = self._crop
            self._crop = crop
            self._crop_moving = True
            self.cropChanged.emit(crop)

    def finish_crop(self) -> None:
        """End a drag of the crop box, if there is one, making it one undo step."""
        if self._crop_moving:
            self._crop_moving = False
            if self._crop == self._crop_before:
                self.cropChangeFinished.emit(self._crop)
            else:
                text = "crop" if self._crop is not None else "whole volume"
                self.change(self._show_crop, self._crop_before, self._crop, text)

    def set_crop(self, crop: CropBox | None) -> None:
        """Change the crop box without a drag: one undo step."""
        self.move_crop(crop)
        self.finish_crop()

    def start_volume(
        self,
        default: TransferFunction,
        current: TransferFunction | None,
        crop: CropBox | None = None,
    ) -> None:
        """Start editing another volume's TF, clearing the undo stack.

        Parameters
        ----------
        default : TransferFunction
            TF that :meth:`reset_transfer_function` returns to.
        current : TransferFunction or None
            Initial TF, fitted to the scalar range; None for the default.
        crop : CropBox or None
            Part of the volume that is shown at first; None for all of it.
        """
        self.volumeStarting.emit()
        self._crop, self._crop_moving = crop, False
        self.cropChanged.emit(crop)
        self._before_drag = None
        self.undo_stack.clear()
        self._default = default
        if current is None or current.scale != default.scale:
            current = default
        first = fit_to_range(current, default.scalar_range)
        # Emitted even for an equal TF, as the volume is new.
        self._transfer_function = first
        self.transferFunctionChanged.emit(first)
        self.transferFunctionChangeFinished.emit(first)

    def preview(self, transfer_function: TransferFunction) -> None:
        """Change the TF during a drag."""
        if self._before_drag is None:
            self._before_drag = self._transfer_function
        if transfer_function != self._transfer_function:
            self._transfer_function = transfer_function
            self.transferFunctionChanged.emit(transfer_function)

    def finish_preview(self, text: str) -> None:
        """End a drag, making it one undo step named `text` in the menu."""
        before, self._before_drag = self._before_drag, None
        if before is not None and before != self._transfer_function:
            self.change(self._show, before, self._transfer_function, text)

    def cancel_preview(self) -> None:
        """Restore the TF from before the drag."""
        before, self._before_drag = self._before_drag, None
        if before is not None and before != self._transfer_function:
            self._show(before)

    def commit(
        self, transfer_function: TransferFunction, text: str, merge_key: str | None = None
    ) -> None:
        """Make an edit that can be undone.

        Parameters
        ----------
        text : str
            Name of the edit in the menu.
        merge_key : str, optional
            Edits with the same key that follow each other within :data:`SAME_GESTURE_S` are
            merged into one undo step, such as those of a key that is held.
        """
        self.finish_preview(text)
        if transfer_function != self._transfer_function:
            self.change(self._show, self._transfer_function, transfer_function, text, merge_key)

    def change(
        self,
        show: Callable[[Any], object],
        before: object,
        after: object,
        text: str,
        merge_key: str | None = None,
    ) -> None:
        """Make a change of anything that the picture depends on, to be undone among the edits.

        Parameters
        ----------
        show : callable
            Shows a value; it is called with `after` now.
        text : str
            Name of the change in the menu.
        merge_key : str, optional
            As in :meth:`commit`.
        """
        self._push(_Change(show, before, after, text, merge_key, self.clock()))

    def undo(self) -> None:
        """Undo the last edit; a current drag is ended and counts as one."""
        self.finish_preview("drag")
        self.finish_crop()
        self.finish_light()
        self.undo_stack.undo()
        self.edited.emit()
        self.undone.emit()

    def redo(self) -> None:
        """Redo the edit undone last; a current drag is ended, and nothing is left to be redone."""
        self.finish_preview("drag")
        self.finish_crop()
        self.finish_light()
        self.undo_stack.redo()
        self.edited.emit()
        self.undone.emit()

    @property
    def default_transfer_function(self) -> TransferFunction:
        """TF that :meth:`reset_transfer_function` returns to."""
        return self._default

    def set_default(self, default: TransferFunction) -> None:
        """Have another default TF, as the same volume is on another scale."""
        self._default = default

    def reset_transfer_function(self) -> None:
        """Restore the volume's default TF, as an edit that can be undone."""
        self.commit(self._default, "reset")

    def save_transfer_function(self, path: Path) -> None:
        """Write the current TF to a file.

        Raises
        ------
        TransferFunctionError
            When the file cannot be written.
        """
        self._transfer_function.save(path)

    def _push(self, edit: QUndoCommand) -> None:
        self.undo_stack.push(edit)
        self.edited.emit()

    def _show(self, transfer_function: TransferFunction) -> None:
        # The end of a drag does not change the TF, so that nothing is redrawn.
        if transfer_function != self._transfer_function:
            self._transfer_function = transfer_function
            self.transferFunctionChanged.emit(transfer_function)
        self.transferFunctionChangeFinished.emit(transfer_function)

    def _show_light(self, light: LightDirection | None) -> None:
        # An image that is unlit by now, or whose light is fixed, stays so.
        if light != self._light and self._light is not None and light is not None:
            self._light = light
            self.lightChanged.emit(light)
        self.lightChangeFinished.emit(self._light)

    def _show_crop(self, crop: CropBox | None) -> None:
        if crop != self._crop:
            self._crop = crop
            self.cropChanged.emit(crop)
        self.cropChangeFinished.emit(crop)


class _Change(QUndoCommand):
    """One change that can be undone.

    Parameters
    ----------
    show : callable
        Shows a value.
    before, after : object
        The values.
    text : str
        Name of the edit in the menu.
    merge_key : str or None
        Whether, and with what, it may be merged.
    at : float
        When it was made, in seconds.
    """

    def __init__(
        self,
        show: Callable[[Any], object],
        before: Any,
        after: Any,
        text: str,
        merge_key: str | None,
        at: float,
    ) -> None:
        super().__init__(text)
        self._show = show
        self._before, self._after = before, after
        self._merge_key, self._at = merge_key, at

    def redo(self) -> None:
        """Show the value after the change."""
        self._show(self._after)

    def undo(self) -> None:
        """Show the value before the change."""
        self._show(self._before)

    def id(self) -> int:
        """Return 1 if the change can be merged; Qt merges only commands of equal id, not -1."""
        return -1 if self._merge_key is None else 1

    def mergeWith(self, other: QUndoCommand) -> bool:
        """Merge the next change of the same gesture by adopting its result."""
        if not isinstance(other, _Change) or other._merge_key != self._merge_key:
            return False
        if other._at - self._at > SAME_GESTURE_S:
            return False
        self._after, self._at = other._after, other._at
        return True
