"""Dispatch of the viewer's state as image requests to the engines."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from PySide6.QtCore import QObject

from app.engines.client import Channel, EngineClient
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import ImageRequest
from app.state.exactness import STOPS, USUAL, Exactness
from app.state.pace import Pace
from app.state.viewer_state import ViewerState
from model.rendering.raster import TIME_GROWTH, Raster
from model.scene.value_scale import ValueScale

NO_MODEL_SIZE = 512
"""Size of the reference image until its pane's is known, in pixels."""

FIRST_RASTER = Raster(NO_MODEL_SIZE, NO_MODEL_SIZE)
"""Pixels of the reference image until its pane's are known."""


@dataclass(frozen=True)
class DrawingPlan:
    """Choices of user, light and machine that :class:`app.state.dispatcher.Dispatcher` follows.

    Attributes
    ----------
    raster : Raster
        Pixels of the reference at rest.
    is_fixed : bool
        Whether the number of pixels at rest is the user's choice, however long they take.
    may_stand_in : bool
        Whether the ray caster may draw in VTK's place.
    passes : bool
        Whether another renderer takes the reference's place soon, and needs the processors until
        then: no image takes long.
    begins_coarse : bool
        Whether the first image at rest follows one of few pixels, as it takes long. Coarse
        images keep the sample distance then.
    most_samples : int
        Of each pixel in path-traced light, which images at rest come to in several steps; 1 for
        other light.
    draws_live : bool
        Whether the reference itself draws while something moves, though the ray caster might
        stand in: path-traced light that is denoised.
    exactness : Exactness
        What images may take while something moves, and owe at rest.
    generator_follows : bool
        Whether the generator draws as many pixels as the reference does, after one sample of each:
        that of path-traced light. While something moves it draws alone, where it is in sight: the
        reference would draw the same twice.
    hidden : frozenset of EngineClient
        Clients whose images nobody sees: they are asked for none.
    scale : {"linear", "log"}
        Scale of the volume that the reference draws. Nothing is asked for under a TF of another
        one, which is there for a moment until the volume follows it.
    """

    raster: Raster = FIRST_RASTER
    is_fixed: bool = False
    may_stand_in: bool = False
    passes: bool = False
    begins_coarse: bool = False
    most_samples: int = 1
    draws_live: bool = False
    exactness: Exactness = STOPS[USUAL]
    generator_follows: bool = False
    hidden: frozenset[EngineClient] = frozenset()
    scale: ValueScale = "linear"


LIVE_COARSENESS = 4.0
"""Factor of the sample distance in VTK's live images.

The ray caster's have all samples: in the same time fewer pixels are nearer to the image at rest
than fewer samples, and all pixels are that image.
"""

REST_SECONDS = 3.0
"""Time that the first image at rest may take; where all pixels take longer, they follow it."""

STAND_IN_SECONDS = 1.5
"""Time that the ray caster's image at rest may take, which is shown until VTK's is there."""

FINER = 1.2
"""Factor of an image's width from which a finer one is worth its time."""

LONGEST_SECONDS = 120.0
"""Time that an image of all pixels may take, unless their number is the user's choice; otherwise
there are as many as half of it allows."""

FIRST_SCALE = 0.25
"""Scale of the first image where it takes long, before it is known how long pixels take."""

SOON_SECONDS = 0.3
"""Time of VTK's image at rest from which the ray caster's is shown until then."""

FIRST_SIZE = 384
"""Size of the first image, before it is known how long its pixels take."""

MORE_SAMPLES = 2
"""Factor of the samples of an image that follows one in path-traced light."""

AT_REST = "reference", False
"""Kind of images, by who draws and whether live; their times are kept by it."""

Drawer = Literal["reference", "stand-in"]
"""Drawers of what is seen in the reference's place."""


class Dispatcher(QObject):
    """Sends image requests to the engines at every change of the viewer's state.

    While something is dragged the reference's images are coarser, by as much as the times of
    those before demand, and come from the ray caster where it draws what VTK does. One of them is
    on its way at most: once it is there, the next is of the newest state.

    Parameters
    ----------
    stand_in : Channel
        To a ray caster of the same volume and light as the reference.

    Attributes
    ----------
    plan : DrawingPlan
        What is drawn, and how.
    """

    def __init__(
        self,
        state: ViewerState,
        generator: EngineClient,
        reference: EngineClient,
        stand_in: Channel,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.plan = DrawingPlan()
        self._state = state
        self._generator, self._reference, self._stand_in = generator, reference, stand_in
        self._pace = Pace()
        # Of small images a good part of the time has nothing to do with their pixels.
        self._live_pace = Pace(TIME_GROWTH)
        self._asked: set[int] = set()
        self._sent: Quality | None = None
        state.inputsChanged.connect(self._send_live)
        state.inputsChangeFinished.connect(self.send)
        generator.images.answered.connect(self._note_generator)
        reference.images.answered.connect(self._note)
        stand_in.answered.connect(self._note)

    def change(self, **changes: Any) -> None:
        """Change some of the :class:`DrawingPlan`, by name; nothing is drawn anew yet."""
        self.plan = replace(self.plan, **changes)

    @property
    def final_raster(self) -> Raster:
        """Pixels of the reference at rest; a larger one follows, once its time is known."""
        raster = self.plan.raster
        if self.plan.is_fixed:
            return raster
        first = FIRST_SCALE if self.plan.begins_coarse else min(1.0, FIRST_SIZE / raster.side)
        scale = self._pace.scale(AT_REST, raster.side, REST_SECONDS, first)
        return raster.scaled(scale)

    def forget_times(self) -> None:
        """Forget how long images took, as another volume, light or renderer is drawn."""
        self._pace.forget()
        self._live_pace.forget()

    def send(self, generator_only: bool = False) -> None:
        """Request the final images of the present state.

        Where the reference takes long, the ray caster's image comes first, or where it may not
        stand in, coarser ones; see :meth:`_note`.

        Parameters
        ----------
        generator_only : bool
            Whether the reference's images, of the same state, are there or on their way.
        """
        if not generator_only:
            self._asked.clear()
        raster = self.final_raster
        final = self._of(raster)
        is_alone = generator_only or self._reference in self.plan.hidden
        if is_alone or not self.plan.generator_follows:
            self._ask_generator(final)
        if is_alone:
            return
        expected = self._pace.expected(AT_REST, raster.side)
        is_slow = expected is None or expected > SOON_SECONDS
        # Where the ray caster draws in VTK's place, it would draw the same twice.
        stands_in = self._stands_in() and not self._reference.by_raycast
        if is_slow and (stands_in or (self.plan.may_stand_in and self._reference.is_held)):
            sharp = self._stand_in_raster
            self._ask_stand_in(Quality(sharp.shorter, raster=sharp))
            if sharp.width >= raster.width and self._takes_not_too_long(self.plan.raster):
                # A coarse image of VTK's would take the place of a sharper one.
                final = self._of(self.plan.raster)
        if self.plan.begins_coarse and is_slow and not (stands_in or self.plan.passes):
            self._ask_reference(self._live("reference"))
        else:
            self._ask_reference(final)

    def show_trade(self) -> None:
        """Draw the present state as while something moves, and then at rest.

        So one sees what has been traded, and both are measured.
        """
        if self._reference in self.plan.hidden:
            return
        self._asked.clear()
        channel, quality = self._moving_image()
        if channel is self._stand_in:
            self._ask_stand_in(quality)
        else:
            self._ask_reference(quality)

    def live_at(self, scale: float) -> tuple[EngineClient, Quality]:
        """Return who draws while something moves, and at which quality with a part of the width."""
        raster = self.plan.raster.scaled(scale)
        channel, quality = self._moving_image()
        return channel.client, replace(quality, size=raster.shorter, raster=raster)

    @property
    def _stand_in_raster(self) -> Raster:
        """Pixels of the ray caster's image at rest."""
        # At a start, something soon.
        raster = self.plan.raster
        first = min(1.0, FIRST_SIZE / raster.side) if self._reference.is_held else 1.0
        scale = self._pace.scale(("stand-in", False), raster.side, STAND_IN_SECONDS, first)
        return raster.scaled(scale)

    def _takes_not_too_long(self, raster: Raster) -> bool:
        expected = self._pace.expected(AT_REST, raster.side)
        return self.plan.is_fixed or expected is None or expected <= LONGEST_SECONDS

    def _ask_reference(self, quality: Quality) -> None:
        self._sent = quality
        self._submit(self._reference.images, quality)
        if self.plan.generator_follows and quality.samples == 1:
            self._ask_generator(quality)

    def _ask_generator(self, quality: Quality) -> None:
        self._submit(self._generator.images, quality)

    def _ask_stand_in(self, quality: Quality) -> None:
        self._submit(self._stand_in, quality, stands_in=True)

    def _send_live(self) -> None:
        # A change outside a drag is immediately followed by its final request.
        if not self._state.live:
            return
        self._asked.clear()
        self._sent = None
        size = min(self.final_raster.shorter, NO_MODEL_SIZE)
        quality = Quality(size, LIVE_COARSENESS, live=True)
        is_alone = self.plan.generator_follows and self._generator not in self.plan.hidden
        if is_alone:
            quality = self._live("reference")
            self._reference.images.cancel()
        self._ask_generator(quality)
        if is_alone or self._reference in self.plan.hidden:
            return
        channel, quality = self._moving_image()
        if channel is self._stand_in:
            self._reference.images.cancel()
            self._ask_stand_in(quality)
        else:
            self._submit(channel, quality)

    def _submit(self, channel: Channel, quality: Quality, stands_in: bool = False) -> None:
        if channel.client in self.plan.hidden or self._state.scale != self.plan.scale:
            return
        inputs, newest = self._state.inputs, channel.newest
        if self._state.live and newest is not None and newest.quality.live:
            is_on_its_way = channel.is_pending and channel.client.is_ready
            if is_on_its_way or newest.inputs == inputs:
                return
        request = ImageRequest(inputs, quality, stands_in=stands_in)
        self._asked.add(channel.ask(request).sequence)

    def _stands_in(self) -> bool:
        may = self.plan.may_stand_in and not self.plan.draws_live
        return may and self._stand_in.client.is_ready

    def _moving_image(self) -> tuple[Channel, Quality]:
        """Return who draws while something moves, and at which quality."""
        if self._stands_in():
            return self._stand_in, self._live("stand-in")
        return self._reference.images, self._live("reference")

    def _live(self, drawer: Drawer) -> Quality:
        seconds = self.plan.exactness.live_seconds
        first = FIRST_SCALE if self.plan.begins_coarse else 0.35
        scale = self._live_pace.scale((drawer, True), self.plan.raster.side, seconds, first)
        raster = self.plan.raster.scaled(scale)
        by_vtk = drawer == "reference" and not self._reference.by_raycast
        coarseness = LIVE_COARSENESS if by_vtk and not self.plan.begins_coarse else 1.0
        return Quality(raster.shorter, coarseness, live=True, raster=raster)

    def _note(self, result: Result) -> None:
        """Note how long an image took, and have the next finer one of the same state drawn."""
        request = result.request
        if result.value is None or not isinstance(request, ImageRequest):
            return
        stands_in, raster = request.stands_in, request.quality.pixels
        if request.quality.samples == 1:
            live = request.quality.live
            pace = self._live_pace if live else self._pace
            pace.note(("stand-in" if stands_in else "reference", live), raster.side, result.seconds)
        if self._state.live:
            self._send_live()
            return
        newest = request.sequence in self._asked
        if stands_in and newest and request.quality.live:
            # What has been traded was shown: the image at rest follows.
            self.send()
            return
        if stands_in and newest and not self._reference.is_ready:
            if self._stand_in_raster.width > FINER * raster.width:
                self.send()
            return
        if stands_in or not newest or request.quality != self._sent:
            return
        finer = self._finer(request.quality)
        if finer is not None:
            self._asked.clear()
            self._ask_reference(finer)

    def _note_generator(self, result: Result) -> None:
        """Note how long a live image took that the generator drew in the reference's place."""
        request = result.request
        if request.quality.live and self.plan.generator_follows:
            self._live_pace.note(("reference", True), request.quality.pixels.side, result.seconds)
        self._send_live()

    def _finer(self, drawn: Quality) -> Quality | None:
        """Quality of the image that follows one of the reference; None if it was the last."""
        raster = self.final_raster
        if not drawn.live and raster.width <= drawn.pixels.width:
            if self.plan.passes:
                return None
            raster = self.plan.raster
            if not self._takes_not_too_long(raster):
                seconds = LONGEST_SECONDS / 2
                scale = self._pace.scale(AT_REST, raster.side, seconds, FIRST_SCALE)
                raster = raster.scaled(scale)
            if raster.width <= drawn.pixels.width:
                if drawn.samples >= self.plan.most_samples:
                    return None
                return replace(drawn, samples=MORE_SAMPLES * drawn.samples)
        return self._of(raster)

    def _of(self, raster: Raster) -> Quality:
        """Quality of an image at rest, of its first sample."""
        return Quality(raster.shorter, raster=raster, error=self.plan.exactness.error)
