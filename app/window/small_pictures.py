"""Small pictures of the open volume, for presets and the question which way is up."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from PySide6.QtCore import QObject
from PySide6.QtGui import QImage

from app.engines.background import Pause
from app.engines.client import Channel
from app.engines.messages import Result
from app.engines.requests import BatchRequest, Quality
from app.picture import Background, compose
from app.window.context import Context
from model.scene.inputs import SceneInputs

PATIENCE_MS = 250  # time after which the reference draws them if the analyst is not ready


class SmallPictures(QObject):
    """Shows small pictures by the ray caster, then path-traced ones if these are quick."""

    def __init__(
        self, name: str, quality: Quality, context: Context, show: Callable[[list[QImage]], object]
    ) -> None:
        super().__init__(context.window)
        self._context, self._show = context, show
        self._quality = quality
        clients = context.analyst, context.panes[1].client
        self._analyst, self._reference = (Channel(client, name, self) for client in clients)
        self._wanted: BatchRequest | None = None
        self._images: list[QImage] = []  # those last drawn, over a background
        self._ground: Background | None = None
        self._traced = self._is_tracing = False
        self._patience = Pause(self, PATIENCE_MS, self._ask_reference)
        for channel in (self._analyst, self._reference):
            channel.answered.connect(partial(self._take, channel))
        # Another analyst has another volume or light.
        context.workspace.reference.analystReplaced.connect(lambda: self._images.clear())

    def ask(self, wanted: Sequence[SceneInputs]) -> None:
        """Request the pictures of some inputs."""
        first, *more = wanted
        self._traced = self._context.workspace.reference.settings.lighting == "path"
        self._is_tracing = False
        before, self._wanted = self._wanted, BatchRequest(first, self._quality, tuple(more))
        is_alike = self._ground == self._context.panes[1].background
        if self._images and before == self._wanted and is_alike:
            self._show(self._images)
        self._reference.cancel()
        self._analyst.ask(self._wanted)
        self._patience.start()

    def stop_tracing(self) -> None:
        """Cancel the path-traced pictures: the others are no longer visible."""
        self._traced = False
        if self._is_tracing:
            self._analyst.cancel()

    def _ask_reference(self) -> None:
        if self._wanted is not None and not self._analyst.client.is_ready:
            self._reference.ask(self._wanted)

    def _take(self, channel: Channel, result: Result) -> None:
        if channel.is_pending or result.value is None:
            # Outdated, or the reference may still draw them.
            return
        # The reference need not draw them as well.
        self._reference.cancel()
        state = self._context.state
        # The analyst draws in the light of the edited image.
        lit = state.lit("exact") if channel is self._analyst else "exact"
        brightness, self._ground = state.brightness.of(lit), self._context.panes[1].background
        self._images[:] = (
            compose(np.asarray(image), self._ground, brightness) for image in result.value
        )
        self._show(self._images)
        if self._traced and channel is self._analyst:
            self._traced, self._is_tracing = False, True
            request = result.request
            assert isinstance(request, BatchRequest)
            channel.ask(replace(request, quality=Quality(request.quality.size), traced=True))
