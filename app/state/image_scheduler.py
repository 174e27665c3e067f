"""Requests for images of the viewer's newest state, to both engines."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject

from app.engines.background import Pause
from app.engines.client import Clients, EngineClient
from app.engines.exactness import STOPS, USUAL
from app.engines.messages import Result
from app.engines.requests import ImageRequest, Quality
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.value_scale import ValueScale

NO_MODEL_SIZE = 512  # size of the reference image until its pane's is known, in pixels
HOLD_MS = 600  # longest time that the analyst waits for the reference's image at rest


class ImageScheduler(QObject):
    """Asks both engines for images at every change of the viewer's state.

    While something moves, each of them is asked for one image at a time; once that is there, the
    next is of the newest state. At rest each is asked once, and its images become better. The
    analyst's answers, which need the same processors, wait for the first sharp one.
    """

    def __init__(self, state: ViewerState, clients: Clients, parent: QObject) -> None:
        super().__init__(parent)
        self._state, self._analyst = state, clients.analyst
        self._generator, self._reference = clients.generator, clients.reference
        # All pixels of the reference, and whether the user chose them, however long they take.
        self.raster, self.is_fixed = Raster(NO_MODEL_SIZE, NO_MODEL_SIZE), False
        self.stop = STOPS[USUAL]
        # Whether the generator draws what the reference does, with one sample of each pixel. While
        # something moves it draws alone, where it is in sight.
        self.generator_follows = False
        # Clients whose images are out of sight: they are asked for none.
        self.hidden: frozenset[EngineClient] = frozenset()
        # Of the volume that is drawn: nothing is asked for under a TF of another scale, which is
        # there for a moment until the volume follows it.
        self.scale: ValueScale = "linear"
        self._patience = Pause(self, HOLD_MS, self.end)
        state.inputsChanged.connect(self._ask_moving)
        state.inputsChangeFinished.connect(self.send)
        for client in (self._generator, self._reference):
            # Before the answer is shown: the engine draws the next image meanwhile.
            client.images.pendingChanged.connect(self._ask_next)
        self._reference.images.answered.connect(self._let_go_if_sharp)
        self._reference.settled.connect(self.end)

    def send(self) -> None:
        """Ask for images of the present state at rest, where they are not on their way."""
        self._ask(self._generator)
        self._ask(self._reference)

    def show_trade(self) -> None:
        """Have the present state drawn as while something moves, and then at rest."""
        self._ask(self._reference, live=True)

    def end(self) -> None:
        """Hold nothing back any more."""
        self._patience.stop()
        self._analyst.hold(False)

    def _ask_moving(self) -> None:
        # A change outside a drag is immediately followed by its request at rest.
        if not self._state.live:
            return
        self.end()
        self._ask(self._generator, live=True)
        if self.generator_follows and self._generator not in self.hidden:
            self._reference.images.cancel()
        else:
            self._ask(self._reference, live=True)

    def _ask_next(self, is_pending: bool) -> None:
        channels = self._generator.images, self._reference.images
        moving = [each for each in channels if each.newest and each.newest.quality.live]
        if is_pending or all(channel.is_pending for channel in moving):
            return
        if self._state.live:
            self._ask_moving()
        else:
            # What has been traded was shown, or it came late.
            self.send()

    def _ask(self, client: EngineClient, live: bool = False) -> None:
        if client in self.hidden or self._state.scale != self.scale:
            return
        channel, stop = client.images, self.stop
        newest = channel.newest
        is_moving = newest is not None and newest.quality.live
        if live and is_moving and channel.is_pending and client.is_ready:
            return
        if self.generator_follows and client is self._generator:
            stop = replace(stop, samples=1)
        quality = Quality(self.raster.shorter, live=live, raster=self.raster)
        request = ImageRequest(self._state.inputs, quality, stop, self.is_fixed)
        if request != newest:
            if client is self._reference and client.is_ready and not live:
                self._analyst.hold(True)
                self._patience.start()
            channel.ask(request)

    def _let_go_if_sharp(self, result: Result) -> None:
        image = result.image
        if image is not None and image.width >= self.raster.width:
            self.end()
