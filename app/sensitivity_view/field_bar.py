"""Controls of the field over the images: the value that it is kept for, and its looks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QWidget

from app.controls import combo, quiet_button
from app.sensitivity_view.add_button import AddButton
from app.state.sensitivity_state import Choices, SensitivityState

STYLES: dict[str, tuple[dict[str, Any], str]] = {
    "Area": ({"style": "map"}, "the change of each pixel, in colours"),
    "Lines": ({"style": "contours"}, "its contours"),
    "8×8": (
        {"style": "blocks", "blocks": 8},
        "the change of the norm of 8 × 8 blocks, as in the paper: of all values at once",
    ),
    "16×16": ({"style": "blocks", "blocks": 16}, "of 16 × 16 blocks"),
    "Pixels": ({"style": "blocks", "blocks": 0}, "of each pixel; takes longest"),
}
"""Ways to draw a field, with their choices and explanations."""

SCALES: dict[str, tuple[dict[str, Any], str]] = {
    "Own": ({"locked": False, "scale": "own"}, "at what this value changes most"),
    "Global": (
        {"locked": False, "scale": "all"},
        "at what any value of interest changes most, as in the paper: colours say how strong this "
        "value is among all, and fade where it changes little",
    ),
    "Locked": ({"locked": True}, "where they do now, and so does the curve's scale: to compare"),
}
"""Ends of the colours' scale, with their choices and explanations."""

LEAST_WIDTH = 72


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
        self.style_box = combo(
            {name: tip for name, (_, tip) in STYLES.items()},
            "How the effect of the value under the mouse is drawn over the images",
        )
        self.fade = QCheckBox("Doubts")
        self.fade.setToolTip("Fade the effect to grey where the model's and the exact one differ")
        self.scale_box = combo(
            {name: tip for name, (_, tip) in SCALES.items()}, "Scale: where the colours end"
        )
        for box in (self.style_box, self.scale_box):
            box.setMinimumWidth(LEAST_WIDTH)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(4)
        for part in (self.pin, self.style_box, self.scale_box, self.fade, self.add):
            row.addWidget(part)
        self.pin.clicked.connect(self.toggle_pin)
        self.add.addRequested.connect(self.addRequested)
        self.style_box.activated.connect(
            lambda i: sensitivity.choose(**list(STYLES.values())[i][0])
        )
        self.scale_box.activated.connect(
            lambda i: sensitivity.choose(**list(SCALES.values())[i][0])
        )
        self.fade.toggled.connect(lambda on: sensitivity.choose(fade=on))
        sensitivity.choicesChanged.connect(self._show_choices)
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

    def _show_choices(self, choices: Choices) -> None:
        for box, entries in ((self.style_box, STYLES), (self.scale_box, SCALES)):
            for index, (changes, _) in enumerate(entries.values()):
                if replace(choices, **changes) == choices:
                    box.setCurrentIndex(index)

    def _show_band(self) -> None:
        band = self._sensitivity.band
        pinned = band is not None and band.pinned
        self.pin.setChecked(pinned)
        self.add.setVisible(pinned)
