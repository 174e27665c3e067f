"""Questions about sensitivities, sent to the engines that answer them best.

The ray caster answers exactly on any volume, a generator for its own. While something is dragged,
the one that is fast enough is asked; at rest both, so that they can be compared.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.channels import Channels
from app.engines.client import EngineClient
from app.engines.messages import Result
from app.engines.requests import (
    RegionSensitivityRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
)
from app.state.brightness import Brightness
from app.state.edit_trials import EditTrials
from app.state.engine_chooser import EngineChooser, EngineName
from app.state.newest_answers import NewestAnswers
from app.state.pace import Pace
from app.state.sensitivity_answers import (
    Agreement,
    Answer,
    Source,
    agreement,
)
from app.state.sensitivity_state import Choices, SensitivityState
from app.state.start_order import StartOrder
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.region import Outline
from model.scene.tf_perturbation import edit_over
from model.scene.transfer_function import Range

BAND_REST_MS = 150
"""Time without a change after which a field is asked for at full quality."""

SHARE = 0.2
"""Part of the time that answers may take while something moves: the images have the rest."""

FOLLOW_S = 0.4
"""Longest time between two questions while something moves."""

PICK_RADIUS = 0.012
"""Half the edge of the square that a click stands for, as a fraction of the image."""

Taker = Callable[[Source, Answer[Any] | None], None]
"""Takes an engine's answer, or its absence."""


class SensitivityDispatcher(QObject):
    """Asks engines about sensitivities whenever the state or the questions change.

    Parameters
    ----------
    exact : EngineClient
        Client of a ray caster.
    learned : EngineClient
        Client of the generator.
    order : StartOrder
        Knows whether a volume's first pictures are drawn: all is asked after them.
    brightness : Brightness
        In which edits are measured.

    Attributes
    ----------
    window : tuple of float
        The scalar values of interest.
    """

    problem = Signal(str)
    """Emitted with a sentence about a question that could not be answered, or nothing."""

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        exact: EngineClient,
        learned: EngineClient,
        order: StartOrder,
        brightness: Brightness,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.window: Range = (0.0, 1.0)
        self._state = state
        self._asked = sensitivity
        self._order = order
        self.chooser = EngineChooser(sensitivity)
        self.answers = answers = NewestAnswers(state, sensitivity, self.chooser, self)
        both: dict[EngineName, EngineClient] = {"exact": exact, "learned": learned}
        # Of the data, whoever draws.
        alone: dict[EngineName, EngineClient] = {"exact": exact}
        self._region = self._opened("region", both, answers.take_region)
        self._field = self._opened("field", both, answers.take_field)
        self._seen = self._opened("seen", alone, answers.take_seen)
        self._visibility = self._opened("visibility", alone, answers.take_visibility)
        self._pick = self._opened("pick", alone, answers.take_pick)
        self._channels = self._region, self._field, self._seen, self._visibility, self._pick
        self.trials = EditTrials(
            state, sensitivity, self.chooser, both, answers.fields.get, brightness, self
        )
        self._follows_image, self._followed, self._took = False, -math.inf, math.inf
        self._problems: dict[Source, str] = {}
        state.inputsChanged.connect(self._ask_live)
        state.inputsChangeFinished.connect(self.ask)
        sensitivity.regionsChanged.connect(self._region_moved)
        sensitivity.regionChangeFinished.connect(self._ask_region)
        sensitivity.bandChanged.connect(self._band_moved)
        sensitivity.bandChangeFinished.connect(self._ask_field)
        sensitivity.placeChanged.connect(self._ask_pick)
        sensitivity.choicesChanged.connect(self._choices_changed)
        self._before = sensitivity.choices
        self._band_rest = QTimer(self, singleShot=True, interval=BAND_REST_MS)
        self._band_rest.timeout.connect(self._ask_field)

    @property
    def learned_fits(self) -> bool:
        """Whether there is a generator for this volume."""
        return self.chooser.learned_size is not None

    def start_volume(self, window: Range, source: Source) -> None:
        """Forget all answers, for another volume or light.

        Parameters
        ----------
        window : tuple of float
            The scalar values of interest.
        source : {"exact", "stand-in"}
            How the ray caster answers under this light.
        """
        self.window, self.chooser.exact_source = window, source
        self.chooser.pace = Pace()
        self._forget()

    def show(self, picture: Raster) -> None:
        """Answer for a reference image of these pixels, from the next answer on."""
        self.chooser.picture = picture

    def allow(self, patience: float) -> None:
        """Have live answers take so many times the usual time, from the next on."""
        self.chooser.patience = patience

    def stop(self) -> None:
        """Ask nothing any more."""
        self._band_rest.stop()

    def set_learned(self, size: int | None) -> None:
        """Set the image size of a generator that fits the volume; None without one."""
        if size != self.chooser.learned_size:
            self.chooser.learned_size = size
            self._forget()
            self.ask()

    def ask(self) -> None:
        """Ask everything anew, at full quality."""
        if not self._order.is_under_way:
            self._ask_region()
            self._ask_field()
            self._ask_pick()

    @property
    def exact_source(self) -> Source:
        """How the ray caster answers under the present light."""
        return self.chooser.exact_source or "exact"

    @property
    def is_waiting(self) -> bool:
        """Whether an answer about the region is still to come."""
        can_come = self.chooser.available and not any(self._problems.values())
        return bool(can_come) and not self.answers.is_fresh(self.answers.region)

    @property
    def region_agreement(self) -> Agreement | None:
        """Agreement of learned and exact responses of the region, over the values of interest."""
        exact, learned = self.answers.both_regions
        if exact is None or learned is None or not self.answers.is_fresh(exact):
            return None
        return agreement(learned, exact, self._state.scalar_range, self.window)

    def edit(self) -> NDArray[np.float32] | None:
        """Return the edit of the present band; None without one."""
        band = self._asked.band
        width = self._asked.choices.width
        return None if band is None else edit_over(band.values, self._state.scalar_range, width)

    def _ask_live(self) -> None:
        # A change outside a drag is immediately followed by its final question.
        self._follows_image = self._state.live

    def follow_image(self, result: Result) -> None:
        """Ask what waits for a live image, as often as the answers take their share of the time."""
        if not (result.request.quality.live and self._follows_image and self._state.live):
            return
        if time.monotonic() - self._followed >= min(self._took / SHARE, FOLLOW_S):
            self._follows_image, self._followed = False, time.monotonic()
            self._took = math.inf
            self._ask_region(live=True)
            self._ask_field(live=True)

    def _region_moved(self) -> None:
        if self._asked.dragging:
            self._ask_region(live=True)

    def _band_moved(self, band: object) -> None:
        if band is None:
            self._band_rest.stop()
            self.answers.clear_fields()
        else:
            self._ask_field(live=True)
            self._band_rest.start()

    def _choices_changed(self, choices: Choices) -> None:
        before, self._before = self._before, choices
        asked = ("shown", "measure", "engine", "width")
        if any(getattr(before, name) != getattr(choices, name) for name in asked):
            if before.width == choices.width:
                # Answers by another measure or engine would be read as the new one's.
                self._forget()
            self.ask()

    def _ask_region(self, live: bool = False) -> None:
        choices, inputs = self._asked.choices, self._state.inputs
        outline, measure = self._asked.outline, choices.measure
        names = self.chooser.order(measure, live)
        if len(names) == 2 and not outline.is_in_square:
            # The generator's image is the square only.
            names = ["exact"]
        if "exact" not in names:
            self._region["exact"].cancel()
        if not live:
            asked = {self.exact_source if name == "exact" else "learned" for name in names}
            self.answers.keep_regions(asked)
        for name in names:
            quality = self.chooser.in_common(self.chooser.quality(name, measure, live), names)
            request = RegionSensitivityRequest(inputs, quality, outline, choices.width, measure)
            self._region[name].ask(request)
        if choices.shown and self.chooser.exact_source is not None:
            # Visibility does not depend on the light, and is cheap.
            quality = self.chooser.quality("exact", "visibility", live)
            seen = VisibilityRequest(inputs, quality, (outline, Outline()))
            self._visibility["exact"].ask(seen)

    def _ask_field(self, live: bool = False) -> None:
        band, width = self._asked.band, self._asked.choices.width
        if band is None:
            return
        if not band.effect:
            # It is of the data, whoever draws, and hardly takes longer than an image.
            if self._asked.choices.shown and self.chooser.exact_source is not None:
                quality = self.chooser.quality("exact", "seen", live)
                seen = ValueVisibilityRequest(self._state.inputs, quality, band.values, width)
                self._seen["exact"].ask(seen)
            return
        names = self.chooser.order("field", live)
        if "exact" not in names:
            self._field["exact"].cancel()
        for name in names:
            quality = self.chooser.quality(name, "field", live)
            request = ValueSensitivityRequest(self._state.inputs, quality, band.values, width)
            self._field[name].ask(request)

    def _ask_pick(self, _place: object = None) -> None:
        place = self._asked.place
        self._pick["exact"].cancel()
        if _place is not None:
            # Another place: what shows at the one before says nothing about it.
            self.answers.take_pick(self.exact_source, None)
        if place is None or self.chooser.exact_source is None or not self._asked.choices.shown:
            self.answers.take_pick(self.exact_source, None)
            return
        x, y = place
        r = PICK_RADIUS
        square = Outline.rectangle(x - r, y - r, x + r, y + r)
        quality = self.chooser.quality("exact", "pick")
        request = VisibilityRequest(self._state.inputs, quality, (square,))
        self._pick["exact"].ask(request)

    def _opened(
        self, question: str, clients: dict[EngineName, EngineClient], take: Taker
    ) -> Channels[EngineName]:
        name = f"sensitivity: {question}"
        return Channels(clients, name, partial(self._take, question, take), self)

    def _take(self, question: str, take: Taker, name: EngineName, result: Result) -> None:
        source = self.exact_source if name == "exact" else "learned"
        request, answer = result.request, None
        if result.value is not None:
            timed = request.measure if isinstance(request, RegionSensitivityRequest) else question
            self.chooser.pace.note((name, timed), request.quality.size, result.seconds)
            self._took = result.seconds + (0.0 if self._took == math.inf else self._took)
            answer = Answer(request, result.value, source, result.seconds)
        take(source, answer)
        # That one can answer about regions says that it is well.
        if answer is None or isinstance(request, RegionSensitivityRequest):
            self._tell(source, result.error or "")

    def _tell(self, source: Source, problem: str) -> None:
        """Emit the problem of whichever engine has one."""
        self._problems[source] = problem
        self.problem.emit(next(filter(None, self._problems.values()), ""))

    def _forget(self) -> None:
        self.trials.forget()
        for channels in self._channels:
            channels.cancel()
        self._problems.clear()
        self.problem.emit("")
        self.answers.clear()
