"""Controls of the field over the images: the value that it is kept for, and its looks."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QWidget

from app.controls import list_box, quiet_button
from app.sensitivity_view.add_button import AddButton
from app.state.sensitivity_state import SensitivityState


class FieldBar(QWidget):
    """Pins the band of values whose effect is shown, and says how it is drawn.

    Parameters
    ----------
    sensitivity : SensitivityState
    best_value : callable
        Returns the value to pin while the mouse is over none; None for none.
    """

    addRequested = Signal(bool)
    """Emitted when a mode shall be added over the pinned band; True for one in another colour."""

    def __init__(
        self, sensitivity: SensitivityState, best_value: Callable[[], float | None]
    ) -> None:
        super().__init__()
        self._sensitivity = sensitivity
        self._best_value = best_value
        self.pin = quiet_button(
            "Keep",
            "Keep the value under the mouse when it leaves the plot (P); Escape ends it",
        )
        self.pin.setCheckable(True)
        self.add = AddButton("the value that is kept")
        self.style_box = list_box()
        self.style_box.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.style_box.addItems(["Area", "Lines"])
        self.style_box.setToolTip(
            "How the effect of the value under the mouse is drawn over the images"
        )
        self.fade = QCheckBox("Doubts")
        self.fade.setToolTip("Fade the effect to grey where the model's and the exact one differ")
        self.locked = QCheckBox("Lock scale")
        self.locked.setToolTip("Keep the scales of colours and curve as they are, to compare")
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(4)
        for part in (self.pin, self.style_box, self.locked, self.fade, self.add):
            row.addWidget(part)
        self.pin.clicked.connect(self.toggle_pin)
        self.add.addRequested.connect(self.addRequested)
        self.style_box.activated.connect(
            lambda i: sensitivity.choose(style="contours" if i else "map")
        )
        self.fade.toggled.connect(lambda on: sensitivity.choose(fade=on))
        self.locked.toggled.connect(lambda on: sensitivity.choose(locked=on))
        sensitivity.bandChanged.connect(lambda _band: self._show_band())
        self._show_band()

    def toggle_pin(self) -> None:
        """Pin the band, or release it."""
        band, best = self._sensitivity.band, self._best_value()
        if band is not None and band.pinned:
            self._sensitivity.unpin()
        elif band is not None:
            self._sensitivity.pin()
        elif best is not None:
            self._sensitivity.pin(best)
        self._show_band()

    def _show_band(self) -> None:
        band = self._sensitivity.band
        pinned = band is not None and band.pinned
        self.pin.setChecked(pinned)
        self.add.setVisible(pinned)
