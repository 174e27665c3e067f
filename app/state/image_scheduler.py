"""Requests for images of the viewer's newest state, to both engines."""

from dataclasses import replace

from PySide6.QtCore import QObject

from app.engines.background import Pause
from app.engines.client import Channel, Clients, EngineClient
from app.engines.exactness import STOPS, USUAL
from app.engines.messages import Result
from app.engines.requests import ImageRequest, Quality, ReferenceSettings
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.value_scale import ValueScale

NO_MODEL_SIZE = 512  # size of the reference image until its pane's is known, in pixels
HOLD_MS = 1500  # longest wait of the analyst for the reference's image at rest
LATER_MS = 4000  # longest time for which images at rest make way for other work
STILL_MS = 300  # pause in a drag after which its images become better


class ImageScheduler(QObject):
    """Requests images of both engines at every change of the viewer's state.

    While something moves, each engine draws one image at a time, always of the newest state. At
    rest each gets one request, whose images get better. The analyst's answers, which need the same
    processors, wait for the first sharp image. With B, the reference draws A and B in turn, each in
    half of the time.
    """

    def __init__(self, state: ViewerState, clients: Clients, parent: QObject) -> None:
        super().__init__(parent)
        self._state, self._analyst = state, clients.analyst
        self._generator, self._reference = clients.generator, clients.reference
        # Pixels of the reference image, and whether the user demands all of them.
        self.raster, self.is_fixed = Raster(NO_MODEL_SIZE, NO_MODEL_SIZE), False
        self.stop = STOPS[USUAL]
        # Whether the generator's pane shows one path-traced sample per pixel.
        self.generator_follows = False
        # Clients whose images are hidden: they get no requests.
        self.hidden: frozenset[EngineClient] = frozenset()
        self.compares = False  # whether B is in sight
        self.settings_b: ReferenceSettings | None = None  # None for those of A
        self._drawn: dict[Channel, SceneInputs] = {}  # the last requests
        # Of the drawn volume: for a moment, the TF may have another scale, and then nothing is
        # requested.
        self.scale: ValueScale = "linear"
        self._patience = Pause(self, HOLD_MS, self._let_go)
        self._still = Pause(self, STILL_MS, self._refine)
        self._later = Pause(self, LATER_MS, self._come_back)
        state.inputsChanged.connect(self._ask_moving)
        state.inputsChangeFinished.connect(self.send)
        self._of_reference = self._reference.images, self._reference.images_b
        self._channels = self._generator.images, *self._of_reference
        for channel in self._channels:
            # Requested before the answer is shown, so that the engine draws meanwhile.
            channel.pendingChanged.connect(self._ask_next)
        for channel in self._of_reference:
            channel.answered.connect(self._let_go_if_sharp)
        self._reference.settled.connect(self._let_go)

    def send(self) -> None:
        """Request images of the present state at rest, unless they are on their way."""
        for channel in self._channels:
            self._ask(channel)

    def show_trade_off(self) -> None:
        """Draw the present state once with the pixels of a moving image, and then at rest."""
        self._ask(self._reference.images, live=1)

    def make_way(self, is_needed: bool) -> None:
        """Draw no images at rest while the user waits for something else, or draw them again."""
        if is_needed:
            self._later.start()
            self._let_go()
            for channel in self._channels:
                channel.cancel()
        elif self._later.isActive():
            self._come_back()

    def _come_back(self) -> None:
        self._later.stop()
        if not self._state.live:
            self.send()

    def end(self) -> None:
        """Release held requests, and stop waiting."""
        self._still.stop()
        self._later.stop()
        self._let_go()

    def _let_go(self) -> None:
        self._patience.stop()
        self._analyst.hold(False)

    def _ask_moving(self) -> None:
        # A change outside a drag is immediately followed by its request at rest.
        if not self._state.live:
            return
        self._still.start()
        self._let_go()
        # Two path tracers share the time; a model takes little.
        share = 2 if self.generator_follows and self.shows_generator else 1
        self._ask(self._generator.images, live=share)
        if not self.compares:
            self._ask(self._reference.images, live=share)
        else:
            self._ask_both()

    @property
    def shows_generator(self) -> bool:
        """Whether the generator's image is visible."""
        return self._generator not in self.hidden

    def _refine(self) -> None:
        """Have images become better while what is dragged is held still."""
        drawn = [each for each in self._channels if each.client not in self.hidden]
        if any(each.is_pending and each.client.is_ready for each in drawn):
            self._still.start()
        elif self._state.live:
            self.send()

    def _ask_both(self) -> None:
        """Request moving images of A and B; one that does not change is not drawn."""
        both, drawn = self._of_reference, self._drawn
        changed = [each for each in both if drawn.get(each) != self._inputs(each)]
        for channel in both:
            if channel in changed:
                self._ask(channel, live=len(changed))
            elif channel.is_pending and channel.newest and not channel.newest.quality.live:
                # It gets better once nothing moves.
                channel.cancel()

    def _inputs(self, channel: Channel) -> SceneInputs:
        return self._state.inputs_of("B" if channel is self._reference.images_b else "A")

    def _ask_next(self, is_pending: bool) -> None:
        moving = [each for each in self._channels if each.newest and each.newest.quality.live]
        if is_pending or all(channel.is_pending for channel in moving):
            return
        if self._state.live:
            self._ask_moving()
        else:
            # An image of :meth:`show_trade_off`, or one that came late.
            self.send()

    def _ask(self, channel: Channel, live: int = 0) -> None:
        """Request an image at rest or, while something moves, one of `live` images."""
        client, stop, inputs = channel.client, self.stop, self._inputs(channel)
        is_b = channel is self._reference.images_b
        is_hidden = client in self.hidden or (is_b and not self.compares)
        makes_way = self._later.isActive() and not live
        if is_hidden or makes_way or inputs.opacity_tf.scale != self.scale:
            return
        newest = channel.newest
        is_moving = newest is not None and newest.quality.live
        if live and is_moving and channel.is_pending and client.is_ready:
            return
        if self.generator_follows and client is self._generator:
            stop = replace(stop, samples=1)
        if live > 1:
            stop = replace(stop, live_seconds=stop.live_seconds / live)
        quality = Quality(self.raster.shorter, live=live > 0, raster=self.raster)
        settings = self.settings_b if is_b else None
        request = ImageRequest(inputs, quality, stop, self.is_fixed, settings=settings)
        self._drawn[channel] = inputs
        if request != newest:
            if client is self._reference and client.is_ready and not live:
                self._analyst.hold(True)
                self._patience.start()
            channel.ask(request)

    def _let_go_if_sharp(self, result: Result) -> None:
        image = result.image
        if image is not None and image.width >= self.raster.width:
            self._let_go()
