"""Says that the TF has parts too narrow for the shown range, and offers a range for them."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject

from app.controls import Action
from app.state.viewer_state import ViewerState
from app.window.notices import Notices
from model.scene.narrow_part import NarrowPart, narrow_part
from model.scene.transfer_function import Range, TransferFunction

NARROW = "narrow part of the TF"
"""Key of the notice."""


class NarrowNotice(QObject):
    """Watches the TF; what was dismissed is said again only of another part or range.

    Parameters
    ----------
    show_range : callable
        Shows the volume over a range, as an undo step.
    """

    def __init__(
        self,
        state: ViewerState,
        notice: Notices,
        show_range: Callable[[Range], object],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._notice = notice
        self._show_range = show_range
        self._told: NarrowPart | None = None
        state.volumeStarting.connect(self._forget)
        state.tf_input.changeFinished.connect(self._judge)

    def _forget(self) -> None:
        self._told = None

    def _judge(self, transfer_function: TransferFunction) -> None:
        found = narrow_part(transfer_function.opacity, transfer_function.color)
        if found == self._told:
            return
        self._told = found
        if found is None:
            self._notice.clear(NARROW)
            return
        remedy = found.remedy
        action = Action(f"Show {found.remedy_text}", lambda: self._show_range(remedy))
        self._notice.tell(found.sentence, action, key=NARROW)
