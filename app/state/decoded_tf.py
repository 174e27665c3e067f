"""The TF that a model's codec makes of the present opacity TF, through its latent code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.client import Channel, EngineClient
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import DecodedTFRequest
from app.state.viewer_state import ViewerState
from model.scene.transfer_function import OpacityTF, Range


class DecodedTF(QObject):
    """Asks the generator for the decoded TF whenever the opacity TF changes, while it is shown.

    Parameters
    ----------
    state : ViewerState
    learned : EngineClient
        Client of the generator.

    Attributes
    ----------
    opacities : ndarray of float32, shape (256,), or None
        Decoded, in [0, 1], over `scalar_range`; None as long as there is none.
    difference : float
        Root mean square of what it differs from the opacity TF by.
    shown : bool
    fits : bool
        Whether there is a generator for this volume that draws through the code.
    """

    changed = Signal()

    def __init__(self, state: ViewerState, learned: EngineClient, parent: QObject) -> None:
        super().__init__(parent)
        self.opacities: NDArray[np.float32] | None = None
        self.scalar_range: Range = (0.0, 1.0)
        self.difference = 0.0
        self.shown = False
        self.fits = False
        self._state = state
        self._channel = Channel(learned, "decoded TF", self)
        self._channel.answered.connect(self._take)
        self._asked: OpacityTF | None = None
        state.tf_input.changed.connect(lambda _tf: self._ask())

    def set_shown(self, shown: bool) -> None:
        """Show it from now on, or hide it."""
        self.shown = shown
        self._start()

    def set_model(self, fits: bool) -> None:
        """Say whether there is a generator that draws through the code."""
        if fits != self.fits:
            self.fits = fits
            self._start()

    def _start(self) -> None:
        self._asked = None
        self._set(None)
        self._ask()

    def _ask(self) -> None:
        tf = self._state.transfer_function.opacity
        if not (self.shown and self.fits) or tf == self._asked:
            return
        self._asked = tf
        # Live: while a mode is dragged, each answer is wanted.
        quality = Quality(1, live=True)
        self._channel.ask(DecodedTFRequest(self._state.inputs, quality))

    def _take(self, result: Result) -> None:
        if not (self.shown and self.fits):
            return
        tf = result.request.inputs.opacity_tf
        self.scalar_range = tf.scalar_range
        if result.value is not None:
            self.difference = float(np.sqrt(np.square(result.value - tf.sample()).mean()))
        self._set(result.value)

    def _set(self, opacities: NDArray[np.float32] | None) -> None:
        self.opacities = opacities
        self.changed.emit()
