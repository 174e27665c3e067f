"""Small pictures of the open volume for buttons and menus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.client import Channel, EngineClient
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest
from app.image_view.image_canvas import to_qimage
from app.state.brightness import Brightness
from model.scene.inputs import SceneInputs

COARSENESS = 2.0
"""Factor of the sample distance in the pictures."""

PATIENCE_MS = 1000
"""Time after which the reference draws what the ray caster cannot draw yet.

On the first start the ray caster is compiled, for some 10 s; otherwise it is ready before.
"""


class SmallPictures(QObject):
    """Has pictures drawn, and emits those asked for last.

    Parameters
    ----------
    name : str
        What they are for: the name of the channels on which they are asked for.
    size : int
        Sides of the pictures, in pixels.
    analyst : EngineClient
        The ray caster, which draws them.
    reference : EngineClient
        Draws them while the ray caster is compiled.
    brightness : Brightness
        Of the pictures, too.
    """

    drawn = Signal(object)
    """Emitted with a list of QImage, in the order asked for."""

    def __init__(
        self,
        name: str,
        size: int,
        analyst: EngineClient,
        reference: EngineClient,
        brightness: Brightness,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._quality = Quality(size, COARSENESS)
        self._analyst, self._reference = (
            Channel(client, name, self) for client in (analyst, reference)
        )
        self._brightness = brightness
        self._wanted: BatchRequest | None = None
        self._traced = self._is_tracing = False
        self._patience = QTimer(self, singleShot=True, interval=PATIENCE_MS)
        self._patience.timeout.connect(self._ask_reference)
        for channel in (self._analyst, self._reference):
            channel.answered.connect(partial(self._take, channel))

    def ask(self, wanted: Sequence[SceneInputs], traced: bool = False) -> None:
        """Ask for the pictures of some inputs.

        Parameters
        ----------
        traced : bool
            Whether those of the ray caster, in the light of the preview, are
            followed by path-traced ones, where these do not take long.
        """
        first, *more = wanted
        self._traced, self._is_tracing = traced, False
        self._wanted = BatchRequest(first, self._quality, tuple(more))
        self._reference.cancel()
        self._analyst.ask(self._wanted)
        self._patience.start()

    def trace_no_more(self) -> None:
        """Leave out the traced ones: nobody looks any more."""
        self._traced = False
        if self._is_tracing:
            self._analyst.cancel()

    def _ask_reference(self) -> None:
        if self._wanted is not None and not self._analyst.client.is_ready:
            self._reference.ask(self._wanted)

    def _take(self, channel: Channel, result: Result) -> None:
        if channel.is_pending or result.value is None:
            # Others are wanted by now, or the reference may still draw them.
            return
        # Nobody needs to draw them a second time.
        self._reference.cancel()
        brightness = self._brightness.of("exact")
        self.drawn.emit([to_qimage(np.asarray(image), brightness) for image in result.value])
        if self._traced and channel is self._analyst:
            self._traced, self._is_tracing = False, True
            request = result.request
            assert isinstance(request, BatchRequest)
            channel.ask(replace(request, quality=Quality(request.quality.size), traced=True))
