"""The line in the corner of the reference's image that says how far it is from the exact one."""

from __future__ import annotations

import html
from collections.abc import Callable

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QLabel

from app.engines.client import EngineState
from app.engines.messages import Result
from app.image_view.engine_pane import PLACE, EnginePane
from app.image_view.orientation_cube import OrientationCube
from app.state.image_errors import Fidelity, ImageErrors, figures_text
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster

HEIGHT = 22

BELOW_CUBE, BELOW_CAPTION = 76, 36
"""Distance to the canvas's upper edge, in pixels."""

WHAT = (
    "Error (RMSE): how far the image's colours, from 0 to 1, are from those of the exact image, "
    "in the mean over all pixels."
)


class FidelityLine(QLabel):
    """Says nothing of an exact image, else how wrong it is, why, and how it gets better.

    `whole` returns the pixels of an image that nothing limits, `passes` whether another
    renderer's image follows the one that is drawn. What it says is its accessible name, too.

    Attributes
    ----------
    fidelity : Fidelity
        What is said now.
    """

    judged = Signal()
    """Emitted when an image has been judged."""

    def __init__(
        self,
        pane: EnginePane,
        state: ViewerState,
        whole: Callable[[], Raster],
        passes: Callable[[], bool],
    ) -> None:
        super().__init__(pane.canvas)
        self._pane, self._state = pane, state
        self._whole, self._passes = whole, passes
        self._errors = ImageErrors()
        self.fidelity = Fidelity()
        self.setProperty("role", "on image")
        self.hide()
        pane.resultShown.connect(self._take)
        pane.statusShown.connect(self._show)
        pane.client.stateChanged.connect(self._follow)
        state.inputsChangeFinished.connect(self._show)

    @property
    def said(self) -> str:
        """What is said now, in words; empty of an exact image."""
        return self.fidelity.text

    @property
    def moving(self) -> str:
        """Rate and error of the last images while something moved, as measured; may be empty."""
        return "" if self._errors.moving is None else figures_text(*self._errors.moving)

    def _take(self, result: Result) -> None:
        self._errors.note(result, self._whole(), self._state.live)

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.LOADING:
            self._errors.forget()
        self._show()

    def _show(self) -> None:
        self.fidelity = Fidelity()
        if self._pane.shows_present:
            settled = self._pane.client.state is EngineState.SETTLED and not self._passes()
            state = self._state
            self.fidelity = self._errors.fidelity(state.inputs, state.live, settled, self._whole())
        text = self.fidelity.text
        if text == self.text() and self._state.live:
            # The rest follows once nothing moves.
            return
        if text != self.text():
            self.setText(text)
            self.setAccessibleName(text)
        lines = (*self.fidelity.reasons, WHAT) if self.fidelity.error else self.fidelity.reasons
        # As rich text it is wrapped.
        tip = "<br>".join(html.escape(line) for line in lines)
        self.setToolTip(f"<qt>{tip}</qt>" if tip else "")
        self._place()
        self.setVisible(bool(text))
        self.judged.emit()

    def _place(self) -> None:
        canvas = self._pane.canvas
        cubes = canvas.findChildren(OrientationCube)
        top = BELOW_CUBE if any(not cube.isHidden() for cube in cubes) else BELOW_CAPTION
        width = min(self.sizeHint().width(), max(canvas.width() - 2 * PLACE, 0))
        self.setGeometry(canvas.width() - PLACE - width, top, width, HEIGHT)
