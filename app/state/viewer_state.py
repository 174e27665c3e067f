"""What the user is editing: one view and one transfer function (TF), with undo.

Changes are announced in pairs, as in pyqtgraph: `...Changed` at every step of a
drag, `...ChangeFinished` once it has come to rest.
"""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.range_fitting import fit_to_range
from model.scene.transfer_function import ColorTF, OpacityTF, Range, TransferFunction
from model.scene.view import View

HOME_VIEW = View(azimuth=30.0, elevation=15.0, roll=0.0, distance=0.8)
"""Where the camera stands at first, and after a reset."""

EMPTY_TF = TransferFunction(
    OpacityTF((0.0, 1.0)), ColorTF((0.0, 1.0), ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0)))
)
"""What is edited before a volume is there."""


class ViewerState(QObject):
    """The view and the TF that both images show.

    Every edit of the TF can be undone. A drag is previewed and becomes one
    undo step when it is finished.
    """

    volumeStarting = Signal()
    """Another volume comes; what is shown is still the last one's TF."""
    viewChanged = Signal(object)
    viewChangeFinished = Signal(object)
    transferFunctionChanged = Signal(object)
    transferFunctionChangeFinished = Signal(object)
    lightChanged = Signal(object)
    lightChangeFinished = Signal(object)
    edited = Signal()
    """The user has changed the TF by an edit, an undo or a redo that is complete."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.undo_stack = QUndoStack(self)
        self._view = HOME_VIEW
        self._default = EMPTY_TF
        self._transfer_function = EMPTY_TF
        self._before_drag: TransferFunction | None = None
        self._view_moving = False
        self._light: LightDirection | None = None
        self._light_moving = False

    @property
    def view(self) -> View:
        """The current view."""
        return self._view

    @property
    def transfer_function(self) -> TransferFunction:
        """The current TF; its scalar range is the volume's."""
        return self._transfer_function

    @property
    def light(self) -> LightDirection | None:
        """The light's direction where it can be moved; None leaves it to the scene."""
        return self._light

    @property
    def inputs(self) -> SceneInputs:
        """What the images depend on, as it is now."""
        return SceneInputs.of(self._view, self._transfer_function, light=self._light)

    @property
    def scalar_range(self) -> Range:
        """The volume's scalar range, in its own units."""
        return self._transfer_function.scalar_range

    @property
    def live(self) -> bool:
        """Whether a drag of the view, of the light or of the TF is under way."""
        return self._view_moving or self._light_moving or self._before_drag is not None

    def move_view(self, view: View) -> None:
        """Show a view while the user is still moving it."""
        if view != self._view:
            self._view = view
            self._view_moving = True
            self.viewChanged.emit(view)

    def finish_view(self) -> None:
        """Say that the view has come to rest; nothing happens when it was at rest."""
        if self._view_moving:
            self._view_moving = False
            self.viewChangeFinished.emit(self._view)

    def set_view(self, view: View) -> None:
        """Move to a view at once."""
        self.move_view(view)
        self.finish_view()

    def move_light(self, light: LightDirection | None) -> None:
        """Show a light while the user is still moving it."""
        if light != self._light:
            self._light = light
            self._light_moving = True
            self.lightChanged.emit(light)

    def finish_light(self) -> None:
        """Say that the light has come to rest; nothing happens when it was at rest."""
        if self._light_moving:
            self._light_moving = False
            self.lightChangeFinished.emit(self._light)

    def set_light(self, light: LightDirection | None) -> None:
        """Move the light at once; None leaves it to the scene."""
        self.move_light(light)
        self.finish_light()

    def start_volume(self, default: TransferFunction, current: TransferFunction | None) -> None:
        """Begin with another volume; the undo steps of the last one are forgotten.

        Parameters
        ----------
        default : TransferFunction
            What :meth:`reset_transfer_function` returns to.
        current : TransferFunction or None
            What is shown first, the default when None.
        """
        self.volumeStarting.emit()
        self._before_drag = None
        self.undo_stack.clear()
        self._default = default
        first = fit_to_range(current or default, default.scalar_range)
        # Also a TF that was there before is new over this volume.
        self._transfer_function = first
        self.transferFunctionChanged.emit(first)
        self.transferFunctionChangeFinished.emit(first)

    def preview(self, transfer_function: TransferFunction) -> None:
        """Show a TF while the user is still dragging."""
        if self._before_drag is None:
            self._before_drag = self._transfer_function
        if transfer_function != self._transfer_function:
            self._transfer_function = transfer_function
            self.transferFunctionChanged.emit(transfer_function)

    def finish_preview(self, text: str) -> None:
        """Turn the drag so far into one undo step, called `text` in the menu."""
        before, self._before_drag = self._before_drag, None
        if before is not None and before != self._transfer_function:
            self._push(_Edit(self, before, self._transfer_function, text))

    def cancel_preview(self) -> None:
        """Return to the TF as it was before the drag."""
        before, self._before_drag = self._before_drag, None
        if before is not None and before != self._transfer_function:
            self._show(before)

    def commit(
        self, transfer_function: TransferFunction, text: str, merge_key: str | None = None
    ) -> None:
        """Make an edit that can be undone.

        Parameters
        ----------
        transfer_function : TransferFunction
        text : str
            What the menu calls the edit.
        merge_key : str, optional
            Edits in a row with the same key make one undo step.
        """
        self.finish_preview(text)
        if transfer_function != self._transfer_function:
            self._push(_Edit(self, self._transfer_function, transfer_function, text, merge_key))

    def undo(self) -> None:
        """Take back the last edit; a drag under way counts as one."""
        self.finish_preview("drag")
        self.undo_stack.undo()
        self.edited.emit()

    def redo(self) -> None:
        """Make the edit again that was taken back last."""
        self.finish_preview("drag")
        self.undo_stack.redo()
        self.edited.emit()

    def reset_transfer_function(self) -> None:
        """Return to the default of the volume; it can be undone."""
        self.commit(self._default, "reset")

    def open_transfer_function(self, path: Path) -> bool:
        """Take a TF from a file; it can be undone.

        Returns
        -------
        bool
            Whether the file was made for this scalar range; if not, it was
            fitted to it.

        Raises
        ------
        TransferFunctionError
            When the file does not hold a TF; the current one stays.
        """
        opened = TransferFunction.load(path)
        self.commit(fit_to_range(opened, self.scalar_range), f"open {path.name}")
        return opened.scalar_range == self.scalar_range

    def save_transfer_function(self, path: Path) -> None:
        """Write the current TF to a file."""
        self._transfer_function.save(path)

    def _push(self, edit: QUndoCommand) -> None:
        self.undo_stack.push(edit)
        self.edited.emit()

    def _show(self, transfer_function: TransferFunction) -> None:
        # The end of a drag shows nothing new: what was drawn for it stays as it is.
        if transfer_function != self._transfer_function:
            self._transfer_function = transfer_function
            self.transferFunctionChanged.emit(transfer_function)
        self.transferFunctionChangeFinished.emit(transfer_function)


class _Edit(QUndoCommand):
    """One edit of the TF, from one value to another."""

    def __init__(
        self,
        state: ViewerState,
        before: TransferFunction,
        after: TransferFunction,
        text: str,
        merge_key: str | None = None,
    ) -> None:
        super().__init__(text)
        self._state = state
        self._before = before
        self._after = after
        self._merge_key = merge_key

    def id(self) -> int:
        """Qt offers only commands with the same id, other than -1, to each other for merging."""
        return -1 if self._merge_key is None else 1

    def mergeWith(self, other: QUndoCommand) -> bool:
        """Take over the result of a later edit with the same key."""
        if not isinstance(other, _Edit) or other._merge_key != self._merge_key:
            return False
        self._after = other._after
        return True

    def redo(self) -> None:
        """Show the result of the edit."""
        self._state._show(self._after)

    def undo(self) -> None:
        """Show what was before the edit."""
        self._state._show(self._before)
