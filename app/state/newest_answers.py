"""The newest answers about sensitivities, of each who answers."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject, Signal

from app.state.engine_chooser import EngineChooser
from app.state.sensitivity_answers import (
    Answer,
    FieldAnswer,
    RegionAnswer,
    Source,
    ValueVisibilityAnswer,
    VisibilityAnswer,
    same_question,
)
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState

Both = tuple[Answer[Any] | None, Answer[Any] | None]
"""An exact and a learned answer to the same question, or twice None."""


class NewestAnswers(QObject):
    """Keeps the newest answers, and knows which of them are about what is shown now.

    Parameters
    ----------
    asked : SensitivityState
        What is asked about.

    Attributes
    ----------
    regions : dict
        Newest answer of each source about a region; it may be about another image or place
        than the present one: see :meth:`is_fresh`.
    fields : dict
        Newest answer of each source about edits of the band of values.
    seen : Answer or None
        Newest answer about where the band of values is visible.
    visibility, pick : Answer or None
        Visibility of the scalar values in the active region and the whole image, and at the
        clicked place.
    """

    regionAnswered = Signal()
    fieldAnswered = Signal()
    visibilityAnswered = Signal()
    pickAnswered = Signal()

    def __init__(
        self,
        state: ViewerState,
        asked: SensitivityState,
        chooser: EngineChooser,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state, self._asked = state, asked
        self._chooser = chooser
        self.regions: dict[Source, RegionAnswer] = {}
        self.fields: dict[Source, FieldAnswer] = {}
        self.seen: ValueVisibilityAnswer | None = None
        self.visibility: VisibilityAnswer | None = None
        self.pick: VisibilityAnswer | None = None

    @property
    def region(self) -> RegionAnswer | None:
        """The answer about the region that is shown first."""
        return max(
            self.regions.values(),
            key=lambda answer: (self.is_fresh(answer), answer.source != "learned"),
            default=None,
        )

    @property
    def field(self) -> FieldAnswer | None:
        """The answer about the band that is shown first."""
        return max(
            self.fields.values(),
            key=lambda answer: (answer.is_of(self._state.inputs), answer.source != "learned"),
            default=None,
        )

    @property
    def both_regions(self) -> Both:
        """Exact and learned answer about the region."""
        return self._both(self.regions)

    @property
    def both_fields(self) -> Both:
        """Exact and learned field of the band."""
        return self._both(self.fields)

    def is_fresh(self, answer: RegionAnswer | None) -> bool:
        """Whether an answer is about the present image, region and edits."""
        if answer is None or not answer.is_of(self._state.inputs):
            return False
        request, choices = answer.request, self._asked.choices
        asked = self._asked.outline, choices.width, choices.measure
        return (request.region, request.width, request.measure) == asked

    def take_region(self, source: Source, answer: RegionAnswer | None) -> None:
        """Take an answer about the region; None in the place of one that failed."""
        if answer is None:
            self.regions.pop(source, None)
        elif answer.request.measure != self._asked.choices.measure:
            return
        else:
            self.regions[source] = answer
        self.regionAnswered.emit()

    def take_field(self, source: Source, answer: FieldAnswer | None) -> None:
        """Take an answer about edits of the band, or None."""
        band = self._asked.band
        if answer is None:
            self.fields.pop(source, None)
        elif band is None or not band.effect:
            return
        else:
            self.fields[source] = answer
        self.fieldAnswered.emit()

    def take_seen(self, _source: Source, answer: ValueVisibilityAnswer | None) -> None:
        """Take an answer about where the band is visible, or None."""
        band = self._asked.band
        if answer is None or (band is not None and not band.effect):
            self.seen = answer
            self.fieldAnswered.emit()

    def take_visibility(self, _source: Source, answer: VisibilityAnswer | None) -> None:
        """Take an answer about the visibility of the scalar values, or None."""
        self.visibility = answer
        self.visibilityAnswered.emit()

    def take_pick(self, _source: Source, answer: VisibilityAnswer | None) -> None:
        """Take an answer about the clicked place, or None."""
        self.pick = answer
        self.pickAnswered.emit()

    def keep_regions(self, asked: set[Source]) -> None:
        """Forget who is not asked about the region any more: it would answer an older question."""
        if not asked.issuperset(self.regions):
            for source in self.regions.keys() - asked:
                del self.regions[source]
            self.regionAnswered.emit()

    def clear_fields(self) -> None:
        """Forget what was asked about the band."""
        self.fields.clear()
        self.seen = None
        self.fieldAnswered.emit()

    def clear(self) -> None:
        """Forget everything."""
        self.regions.clear()
        self.fields.clear()
        self.seen = self.visibility = self.pick = None
        for signal in (
            self.regionAnswered, self.fieldAnswered, self.visibilityAnswered, self.pickAnswered,
        ):  # fmt: skip
            signal.emit()

    def _both(self, answers: dict[Source, Answer[Any]]) -> Both:
        exact = answers.get(self._chooser.exact_source or "exact")
        learned = answers.get("learned")
        return (exact, learned) if same_question(exact, learned) else (None, None)
