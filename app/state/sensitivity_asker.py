"""Questions about sensitivities: to which engine, when and how finely, and the newest answers.

The ray caster answers exactly on any volume, a generator for its own. While something moves, only
an engine that keeps up is asked, as often as :mod:`app.state.answer_pace` allows; at rest both are.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Generic, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines import requests
from app.engines.background import Pause
from app.engines.client import Channels, EngineClient, EngineName
from app.engines.messages import Result
from app.state.answer_pace import OLDEST_S, SHARE, AnswerPace
from app.state.edited_tf import other_pane
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.display import agreement, shown_responses
from model.sensitivity.peaks import Contribution, contributions

Source = Literal["exact", "other light", "learned"]
"""Origin of an answer: the ray caster's derivative, that of another light instead of path-traced
light, or the generator's."""

_R = TypeVar("_R", bound=requests.Request)


@dataclass(frozen=True, eq=False)
class Answer(Generic[_R]):
    """An engine's answer."""

    request: _R
    value: NDArray[np.float32]
    source: Source

    def is_of(self, inputs: SceneInputs) -> bool:
        """Whether it is about the image of these inputs."""
        return self.request.inputs == inputs


RegionAnswer = Answer[requests.RegionSensitivityRequest]
FieldAnswer = Answer[requests.ValueSensitivityRequest]
ValueVisibilityAnswer = Answer[requests.ValueVisibilityRequest]
VisibilityAnswer = Answer[requests.VisibilityRequest]


def displayed(answer: RegionAnswer) -> NDArray[np.float64]:
    """Return a region's responses (256,) in the displayed unit."""
    request = answer.request
    pixels = int(request.region.mask(request.quality.pixels.shape).sum())
    return shown_responses(answer.value, pixels, request.width)


Question = Literal["region", "visibility", "field", "seen", "seen_too", "pick"]
"""Kinds of questions, in this order: changes of a region; values visible in it; change of pixels by
an edit; where values are visible; the same in the other of A and B; values at a clicked place."""

REST_SIZE = 256  # largest shorter edge for regions at rest
REST_SECONDS = 1.5  # longest time for a region at rest
SLOW_SECONDS = 0.5  # expected time at rest from which the generator, if any, answers first
DRAG_SECONDS = 0.07  # time for answers while a region or band is dragged: no image waits for them
BAND_REST_MS = 150  # time without a change after which a field is asked for at full quality
PICK_RADIUS = 0.012  # half the edge of a click's square, as a fraction of the image


class SensitivityAsker(QObject):
    """Asks the engines about sensitivities whenever the state or the questions change."""

    answered = Signal(str)  # emitted with the :data:`Question` whose answers have changed

    regions: dict[Source, RegionAnswer]
    """Newest answer of each source; it may be stale, see :meth:`is_fresh`."""
    fields: dict[Source, FieldAnswer]
    seen: ValueVisibilityAnswer | None  # newest answer about where the band is visible
    seen_too: ValueVisibilityAnswer | None  # and where in the pane without the focus
    visibility: VisibilityAnswer | None  # of all values, in the active region and the whole image
    pick: VisibilityAnswer | None  # about those at the clicked place
    _problems: dict[Source, str]

    def __init__(
        self,
        state: ViewerState,
        asked: SensitivityState,
        clients: Mapping[EngineName, EngineClient],
        parent: QObject,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(parent)
        # Whether a volume's first pictures are still to be drawn: questions come after them.
        self.is_starting: Callable[[], bool] = lambda: False
        # The scalar values of interest, how the ray caster answers under the present light, and the
        # image size of a generator that fits the volume.
        self.window: Range = (0.0, 1.0)
        self.exact_source: Source = "exact"
        self.learned_size: int | None = None
        self._sees_model = True
        self.hint = ""  # inputs outside that generator's training, in words
        self.pace = AnswerPace(clock)
        self.state, self.asked, self.clients = state, asked, clients
        self._is_open = self._moves = self._has_moved = False
        self._picture = Raster(REST_SIZE, REST_SIZE)
        exact: dict[EngineName, EngineClient] = {"exact": clients["exact"]}
        self._channels = {
            question: Channels(
                clients if question in ("region", "field") else exact,
                f"sensitivity: {question}", partial(self._take, question), self,
            )
            for question in get_args(Question)
        }  # fmt: skip
        self._before = asked.choices
        self._clear()
        self._band_rest = Pause(self, BAND_REST_MS, partial(self._ask, "field", "seen"))
        self._due = Pause(self, 0, self._ask_if_due)
        state.inputsChanged.connect(self._follow_inputs)
        state.inputsChangeFinished.connect(self.ask)
        asked.changed.connect(self._follow)
        asked.finished.connect(self._finish)

    @property
    def engines(self) -> list[EngineName]:
        """Engines that may answer, the exact one first; none if sensitivities are hidden."""
        names: list[EngineName] = []
        if self._is_open and self.asked.choices.engine != "learned":
            names.append("exact")
        if self.learned_size is not None and self.asks_model:
            names.append("learned")
        return names if self.asked.choices.shown else []

    @property
    def asks_model(self) -> bool:
        """Whether a model is to be asked: where it is chosen, or its image is visible."""
        choice = self.asked.choices.engine
        return choice == "learned" or (choice == "automatic" and self._sees_model)

    @property
    def rest_size(self) -> int:
        """Shorter edge of answers at rest that hardly depend on it."""
        return min(REST_SIZE, self._picture.shorter)

    @property
    def problem(self) -> str:
        """Sentence about a question that could not be answered; empty if there is none."""
        return next(filter(None, self._problems.values()), "")

    @property
    def waiting(self) -> str:
        """Text to show until the answers come."""
        client = self.clients["exact"]
        return "computing …" if client.is_ready else client.text

    @property
    def listed(self) -> tuple[Contribution, ...]:
        """The values at the clicked place, the largest share first; none until they are known."""
        if self.pick is None:
            return ()
        scalar_range = self.pick.request.inputs.opacity_tf.scalar_range
        return contributions(self.pick.value[0], scalar_range)

    @property
    def region(self) -> RegionAnswer | None:
        """The preferred answer about the region."""
        return max(
            self.regions.values(), key=lambda a: (self.is_fresh(a), a.source != "learned"),
            default=None,
        )  # fmt: skip

    @property
    def field(self) -> FieldAnswer | None:
        """The preferred answer about the band."""
        inputs = self.state.inputs
        return max(
            self.fields.values(), key=lambda a: (a.is_of(inputs), a.source != "learned"),
            default=None,
        )  # fmt: skip

    @property
    def region_agreement(self) -> float | None:
        """Cosine of learned and exact responses of the region, over the values of interest."""
        both = self.both(self.regions)
        if not (both and self.is_fresh(both[0])):
            return None
        values = np.linspace(*self.state.scalar_range, TF_SAMPLES)
        inside = (values >= self.window[0]) & (values <= self.window[1])
        exact, learned = (displayed(each)[inside] for each in both)
        return agreement(learned, exact)

    def is_fresh(self, answer: RegionAnswer | None) -> bool:
        """Whether an answer is about the present image, region and edits."""
        if answer is None or not answer.is_of(self.state.inputs):
            return False
        request, choices = answer.request, self.asked.choices
        asked = self.asked.outline, choices.width, choices.measure
        return (request.region, request.width, request.measure) == asked

    def start_volume(self, window: Range, source: Source) -> None:
        """Forget all answers, for another volume or light."""
        self.window, self.exact_source, self._is_open = window, source, True
        self.pace.forget()
        self._forget()

    def show(self, picture: Raster) -> None:
        """Set the reference image's pixels; ask again for fields of another shape."""
        is_other, self._picture = picture.shape != self._picture.shape, picture
        if is_other and self.asked.band is not None:
            self._drop_fields()
            self._band_rest.start()

    def set_learned(self, size: int | None) -> None:
        """Set the image size of a generator that fits the volume; None without one."""
        if size != self.learned_size:
            self.learned_size = size
            self._forget()
            self.ask()

    def see_model(self, is_seen: bool) -> None:
        """Set whether the model's image is visible."""
        if is_seen != self._sees_model:
            self._sees_model = is_seen
            if self.learned_size is not None and self.asked.choices.engine == "automatic":
                # The exact answers stay.
                self.fields.pop("learned", None)
                self._problems.pop("learned", None)
                self.ask()

    def stop(self) -> None:
        """Stop asking."""
        self._band_rest.stop()
        self._due.stop()

    def ask(self) -> None:
        """Ask everything again, at full quality; while something moves, after that."""
        self._moves = self.state.live
        self._ask("region", "visibility", "field", "seen", "pick")

    def follow_image(self, result: Result) -> None:
        """Ask the questions that wait for a live image, if they are due."""
        if result.request.quality.live and self._moves:
            self.pace.note_picture()
            self._ask_if_due()

    def _follow_inputs(self) -> None:
        # A change outside a drag is immediately followed by its final question.
        if self.state.live and not self._moves:
            self._band_rest.stop()
            for channels in self._channels.values():
                channels.cancel()
            self.pace.begin()
        self._moves = self._has_moved = self.state.live

    def _ask_if_due(self) -> None:
        """Ask about what has moved, now or in time."""
        is_pending = any(channels.is_pending for channels in self._channels.values())
        if is_pending or not (self._moves and self._has_moved):
            return
        wait = self.pace.wait
        if wait > 0:
            # No image may come by then, if the mouse rests during a drag.
            self._due.start(int(1000 * wait) + 1)
        else:
            self._has_moved = False
            self._ask("region", "visibility", "field", "seen", seconds=self.pace.start())

    def _follow(self, what: str) -> None:
        if what == "regions" and self.asked.dragging:
            self._ask("region", "visibility", seconds=DRAG_SECONDS)
        elif what == "band":
            self._follow_band()
        elif what == "place":
            # The previous place's values say nothing about this one.
            self.pick = None
            self.answered.emit("pick")
            self._ask("pick")
        elif what == "choices":
            self._follow_choices()

    def _finish(self, what: str) -> None:
        self._ask(*(("region", "visibility") if what == "regions" else ("field", "seen")))

    def _follow_band(self) -> None:
        self._has_moved = True
        if self.asked.band is None:
            self._band_rest.stop()
            self._ask("field", "seen", seconds=DRAG_SECONDS)
            self._drop_fields()
        elif not self._moves:
            self._ask("field", "seen", seconds=DRAG_SECONDS)
            self._band_rest.start()

    def _drop_fields(self) -> None:
        self.fields, self.seen, self.seen_too = {}, None, None
        self.answered.emit("field")

    def _follow_choices(self) -> None:
        before, self._before = self._before, self.asked.choices
        if any(
            getattr(before, name) != getattr(self._before, name)
            for name in ("shown", "measure", "engine")
        ):
            # Old answers would be taken for those of the new measure or engine.
            self._forget()
            self.ask()
        elif before.width != self._before.width:
            self.ask()

    def order(self, question: Question, live: bool = False) -> list[EngineName]:
        """Engines to ask, the preferred one first; during a drag, only one that keeps up."""
        names, band = self.engines, self.asked.band
        of_band = question in ("field", "seen", "seen_too")
        if of_band and (band is None or band.effect != (question == "field")):
            return []
        if question == "seen_too" and not self.state.tf_input.compares:
            return []
        if question not in ("region", "field"):
            # Visibility is the same by any engine and in any light, and cheap.
            is_asked = self.asked.place is not None or question != "pick"
            return ["exact"] if self._is_open and self.asked.choices.shown and is_asked else []
        if question == "region" and self._moves and not self.asked.shows_curve:
            # The panel's numbers stay during a drag.
            return []
        takes_passes = question == "region" and self.asked.choices.measure == "change"
        if len(names) == 2:
            if takes_passes or (question == "region" and not self.asked.outline.is_in_square):
                # The generator's takes a pass for each of many edits; its image is the square only.
                names = ["exact"]
            elif self._takes("exact", question, SLOW_SECONDS):
                names = ["learned", "exact"]
        if not live:
            return names
        # If the ray caster could answer with fewer pixels, the generator must be as fast.
        most = SLOW_SECONDS if len(names) == 1 else SHARE * OLDEST_S
        is_slow = takes_passes or self._takes("learned", question, most)
        return [name for name in names if name == "exact" or not is_slow][:1]

    def quality(self, name: EngineName, question: Question) -> requests.Quality:
        """Quality of an engine's answer at rest."""
        kind = self._kind(name, question)
        of_band = question in ("field", "seen", "seen_too")
        size = self._picture.shorter if of_band else self.rest_size
        if question == "region" and self.pace.expected(kind, size) is not None:
            size = self.pace.size([kind], size, REST_SECONDS)
        return self.sized(name, size)

    def sized(self, name: EngineName, size: int, live: bool = False) -> requests.Quality:
        """Quality of the generator's square, or of the reference's proportions."""
        if name == "learned":
            return requests.Quality(self.learned_size or size, live=live)
        if self._picture.width == self._picture.height:
            return requests.Quality(size, live=live)
        raster = self._picture.scaled(size / self._picture.shorter)
        return requests.Quality(size, live=live, raster=raster)

    def _kind(self, name: EngineName, question: Question) -> object:
        """Key of an answer's times."""
        return name, self.asked.choices.measure if question == "region" else question

    def _takes(self, name: EngineName, question: Question, seconds: float) -> bool:
        """Whether an answer at rest is known to take more than some seconds."""
        size = self.quality(name, question).size
        expected = self.pace.expected(self._kind(name, question), size)
        return expected is not None and expected > seconds

    def _ask(self, *questions: Question, seconds: float | None = None) -> None:
        """Ask some questions, and cancel those that are no longer wanted."""
        live = seconds is not None
        if "seen" in questions:
            questions = *questions, "seen_too"
        if self.is_starting() or (self.state.live and not live):
            return
        orders = {question: self.order(question, live) for question in questions}
        kinds = [self._kind("exact", each) for each in questions if "exact" in orders[each]]
        size = 0 if seconds is None else self.pace.size(kinds, self.rest_size, seconds)
        for question, order in orders.items():
            for name, channel in self._channels[question].items():
                if name not in order:
                    channel.cancel()
            for name in order:
                quality = self.sized(name, size, True) if live else self.quality(name, question)
                if question == "region" and len(order) == 2 and not self.asked.outline.points:
                    # If both engines answer about the whole image, both answer about the square.
                    quality = requests.Quality(quality.size)
                self._channels[question][name].ask(self._request(question, quality))
        if "region" in orders and (not live or (self._moves and orders["region"])):
            # An engine that is no longer asked would answer an older question.
            asked = {self.source(name) for name in orders["region"]}
            for source in self.regions.keys() - asked:
                del self.regions[source]
                self.answered.emit("region")

    def _request(self, question: Question, quality: requests.Quality) -> requests.Request:
        inputs, outline, choices = self.state.inputs, self.asked.outline, self.asked.choices
        width, band, place = choices.width, self.asked.band, self.asked.place
        if question == "seen_too":
            inputs = self.state.inputs_of(other_pane(self.state.tf_input.pane))
        if question == "region":
            return requests.RegionSensitivityRequest(
                inputs, quality, outline, width, choices.measure
            )
        if question == "visibility":
            return requests.VisibilityRequest(inputs, quality, (outline, Outline()))
        if question == "pick" and place is not None:
            (x, y), r = place, PICK_RADIUS
            square = Outline.rectangle(x - r, y - r, x + r, y + r)
            return requests.VisibilityRequest(inputs, quality, (square,))
        assert band is not None
        if question == "field":
            return requests.ValueSensitivityRequest(inputs, quality, band.values, width)
        return requests.ValueVisibilityRequest(inputs, quality, band.values, width)

    def _take(self, question: Question, name: EngineName, result: Result) -> None:
        """Keep an answer; after an error, forget the previous one."""
        request, source, answer = result.request, self.source(name), None
        if request.quality.live and self._moves:
            self.pace.note_live(result.seconds)
        if result.value is not None:
            self.pace.note(self._kind(name, question), request.quality.size, result.seconds)
            answer = Answer(request, result.value, source)
        if question in ("region", "field"):
            answers: dict[Source, Any] = self.regions if question == "region" else self.fields
            answers.pop(source, None)
            if answer is not None:
                answers[source] = answer
        else:
            setattr(self, question, answer)
        # An engine that answers about regions works.
        if answer is None or question == "region":
            self._problems[source] = result.error or ""
            self.answered.emit("region")
        if question != "region":
            self.answered.emit(question)
        self._ask_if_due()

    def source(self, name: EngineName) -> Source:
        """Return the source of an engine's answers."""
        return self.exact_source if name == "exact" else "learned"

    def both(self, answers: dict[Source, Any]) -> list[Any]:
        """Return exact and learned answer to the same question; none unless both are there."""
        exact, learned = answers.get(self.exact_source), answers.get("learned")
        if exact is None or learned is None:
            return []
        is_same = replace(exact.request, quality=learned.request.quality) == learned.request
        return [exact, learned] if is_same else []

    def _forget(self) -> None:
        for channels in self._channels.values():
            channels.cancel()
        self._clear()
        for question in get_args(Question):
            self.answered.emit(question)

    def _clear(self) -> None:
        self._problems, self.regions, self.fields = {}, {}, {}
        self.seen = self.seen_too = self.visibility = self.pick = None
