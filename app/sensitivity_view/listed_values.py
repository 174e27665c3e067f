"""Values that are listed to be raised and lowered: those of a clicked place or of the region."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from app.state.sensitivity_answers import VisibilityAnswer
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.scene.region import ImageRegion
from model.sensitivity.contributions import Contribution, contributions, follow


class ListedValues(QObject):
    """Finds the values, and keeps their order as long as they are listed.

    Parameters
    ----------
    count : int
        Largest number of values.
    """

    changed = Signal()

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        dispatcher: SensitivityDispatcher,
        count: int,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._dispatcher = dispatcher
        self._count = count
        self._place: ImageRegion | None = None
        self._holds = False
        self.found: tuple[Contribution, ...] = ()
        dispatcher.answers.pickAnswered.connect(self._find)
        dispatcher.answers.visibilityAnswered.connect(self._find)
        sensitivity.placeChanged.connect(lambda _place: self._find())
        sensitivity.regionsChanged.connect(self._find)

    @property
    def is_fresh(self) -> bool:
        """Whether they are of the present image."""
        answer = self._answer
        return answer is not None and answer.is_of(self._state.inputs)

    def hold(self, holds: bool) -> None:
        """Keep values in their order, and those that no longer show, or list what shows now.

        Whoever clicks the same button twice means the same value.
        """
        if holds != self._holds:
            self._holds = holds
            self._find()

    def leave(self) -> bool:
        """List the region's values again; return False if they are."""
        if self._sensitivity.place is None:
            return False
        self._sensitivity.pick(None)
        return True

    @property
    def _answer(self) -> VisibilityAnswer | None:
        """Visibility of the values that are listed; None while it is not known."""
        if self._sensitivity.place is not None:
            return self._dispatcher.answers.pick
        answer, outline = self._dispatcher.answers.visibility, self._sensitivity.outline
        return answer if answer is not None and answer.request.regions[0] == outline else None

    def _find(self) -> None:
        answer = self._answer
        if answer is None:
            self.found = ()
        else:
            scalar_range, place = self._state.scalar_range, answer.request.regions[0]
            before = self.found if self._holds and place == self._place else ()
            found = contributions(answer.value[0], scalar_range)
            self._place, self.found = place, follow(before, found, scalar_range)[: self._count]
        self.changed.emit()
