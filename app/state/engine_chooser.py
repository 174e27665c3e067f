"""Choice of the engine that answers about sensitivities, and of the size: by measured time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from app.engines.quality import Quality
from app.state.pace import LIVE_SECONDS, Pace
from app.state.sensitivity_answers import Source
from app.state.sensitivity_state import SensitivityState
from model.rendering.raster import Raster

EngineName = Literal["exact", "learned"]
Question = Literal["change", "signed", "field", "seen", "visibility", "pick", "images"]
"""A kind of question: a region by either measure, a field of effects, where values are seen,
visibility, a place, or images."""

REST_SIZE = 256
"""Largest size for regions at rest: their numbers hardly depend on it."""

REST_SECONDS = 1.5
"""Time that a region at rest may take, where fewer pixels would do."""

SLOW_SECONDS = 0.5
"""Expected time from which the other engine answers, if there is one."""

REGION_QUESTIONS: tuple[Question, ...] = ("change", "signed")


class EngineChooser:
    """Chooses engines and sizes by what is there, what the user wants and what it takes.

    Attributes
    ----------
    exact_source : {"exact", "stand-in"} or None
        How the ray caster answers under the present light; None without a volume.
    learned_size : int or None
        Image size of the generator; None without one that fits the volume.
    picture : Raster
        Pixels of the reference image.
    patience : float
        Time that live answers may take, as a multiple of the usual one.
    """

    def __init__(self, asked: SensitivityState) -> None:
        self._asked = asked
        self.exact_source: Source | None = None
        self.learned_size: int | None = None
        self.picture = Raster(REST_SIZE, REST_SIZE)
        self.patience = 1.0
        self.pace = Pace()

    @property
    def available(self) -> list[EngineName]:
        """Engines that may answer, the exact one first; none while nothing is shown."""
        choice = self._asked.choices.engine
        names: list[EngineName] = []
        if self.exact_source is not None and choice != "learned":
            names.append("exact")
        if self.learned_size is not None and choice != "exact":
            names.append("learned")
        return names if self._asked.choices.shown else []

    def order(self, question: Question, live: bool) -> list[EngineName]:
        """Engines to ask, the one that is shown first; while dragging, only one that keeps up."""
        names = self.available
        if len(names) == 2:
            if question == "change":
                # The generator's takes a pass for each of many edits: seconds.
                names = ["exact"]
            elif self._is_slow("exact", question):
                names = ["learned", "exact"]
        if not live:
            return names
        return [name for name in names if self._keeps_up(name, question)][:1]

    def quality(self, name: EngineName, question: Question, live: bool = False) -> Quality:
        """Size of an engine's answer: the generator's square, or as wide as the reference."""
        if name == "learned":
            return Quality(self.learned_size or REST_SIZE, live=live)
        if live:
            largest = min(REST_SIZE, self.picture.shorter)
            if question == "visibility":
                # It comes with every region, and is only the background of its plot.
                largest = min(128, largest)
            seconds = LIVE_SECONDS * self.patience
            return self._sized(self.pace.live_size((name, question), largest, seconds), live=True)
        if question in ("field", "seen"):
            return self._sized(self.picture.shorter)
        largest = min(REST_SIZE, self.picture.shorter)
        is_known = self.pace.expected((name, question), largest) is not None
        if question in REGION_QUESTIONS and is_known:
            largest = self.pace.live_size((name, question), largest, REST_SECONDS)
        return self._sized(largest)

    def in_common(self, quality: Quality, names: Sequence[EngineName]) -> Quality:
        """Return the quality of an answer about a region, by engines that shall agree about it.

        Where two of them are asked about the whole image, that is the square which both have.
        """
        if len(names) == 2 and not self._asked.outline.points:
            return replace(quality, raster=None)
        return quality

    def _sized(self, size: int, live: bool = False) -> Quality:
        """Quality of an answer of the reference's proportions, with a square of this size."""
        if self.picture.width == self.picture.height:
            return Quality(size, live=live)
        raster = self.picture.scaled(size / self.picture.shorter)
        return Quality(size, live=live, raster=raster)

    def _is_slow(self, name: EngineName, question: Question) -> bool:
        size = self.quality(name, question).size
        expected = self.pace.expected((name, question), size)
        return expected is not None and expected > SLOW_SECONDS

    def _keeps_up(self, name: EngineName, question: Question) -> bool:
        return name == "exact" or (question != "change" and not self._is_slow(name, question))
