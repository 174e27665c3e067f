"""The line at the window's lower edge: what has just happened, and the view's numbers."""

from __future__ import annotations

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QLabel, QStatusBar

from app.controls import ElidedLabel
from app.state.viewer_state import ViewerState

NEWS_MS = 20_000
"""Time for which a sentence stays, unless another one comes."""

RESET = "The first view again; Alt+Left returns to yours."

PENDING = "…"
"""End of sentences about what is still under way: they stay until the next one."""


class StatusLine(QStatusBar):
    """Shows the newest sentence, cut where there is no room for it, beside the view's numbers.

    Parameters
    ----------
    state : ViewerState
    """

    def __init__(self, state: ViewerState) -> None:
        super().__init__()
        self._state = state
        self._news = ElidedLabel()
        self._news.setContentsMargins(14, 0, 14, 0)
        self._view = QLabel()
        self._view.setProperty("role", "dim")
        self._view.setToolTip(
            "The view: where it is looked from, how far away (at 1 the whole volume is seen), and "
            "by how many halves of the image's shorter side it is moved to the right and up"
        )
        self._view.setContentsMargins(0, 0, 14, 0)
        self.addWidget(self._news, 1)
        self.addPermanentWidget(self._view)
        self.setSizeGripEnabled(False)
        self._rest = QTimer(self, singleShot=True, interval=NEWS_MS)
        self._rest.timeout.connect(lambda: self.tell(""))
        state.viewChanged.connect(lambda _view: self._show_view())
        state.navigationChanged.connect(self._show_view)
        # It may be about what is undone.
        state.undone.connect(self._forget)
        state.viewReset.connect(lambda: self.tell(RESET))
        self._show_view()

    @property
    def news(self) -> str:
        """The sentence, as a whole; empty if there is none."""
        return self._news.full_text

    @property
    def view_text(self) -> str:
        """The view's numbers as they are displayed."""
        return self._view.text()

    def tell(self, text: str) -> None:
        """Show a sentence instead of the one before."""
        self._news.set_full_text(text)
        self._rest.stop()
        if text and not text.endswith(PENDING):
            self._rest.start()

    def _forget(self) -> None:
        if not self.news.endswith(PENDING):
            self.tell("")

    def _show_view(self) -> None:
        view = self._state.view
        azimuth, elevation, roll = self._state.angles
        text = (
            f"azimuth {azimuth:.0f}°   elevation {elevation:.0f}°   roll {roll:.0f}°   "
            f"distance {view.distance:.2f}"
        )
        # The sum makes 0 of -0.
        pan_x, pan_y = (round(pan, 2) + 0.0 for pan in (view.pan_x, view.pan_y))
        if pan_x or pan_y:
            text += f"   pan {pan_x:+.2f}, {pan_y:+.2f}"
        self._view.setText(text)
