"""A button that is on while it is held, or from one click to the next."""

from __future__ import annotations

from PySide6.QtCore import QElapsedTimer, Signal
from PySide6.QtWidgets import QPushButton, QWidget

CLICK_MS = 350
"""Time up to which a press is a click; the button is held if it takes longer."""


class HeldButton(QPushButton):
    """Asks for something to be shown as long as it is held; a click lasts until the next one.

    Whether it is on is said by whoever shows it, see :meth:`set_on`.
    """

    turnedOn = Signal()
    turnedOff = Signal()

    def __init__(self, text: str, parent: QWidget | None = None) -> None:
        super().__init__(text, parent)
        self.setCheckable(True)
        self._is_on = False
        self._held = QElapsedTimer()
        self.pressed.connect(self._press)
        self.released.connect(self._release)

    def set_on(self, on: bool) -> None:
        """Show that the button is on, or not."""
        self._is_on = on
        self.setChecked(on)

    def _press(self) -> None:
        if self._is_on:
            self._held.invalidate()
            self.turnedOff.emit()
        else:
            self._held.start()
            self.turnedOn.emit()

    def _release(self) -> None:
        if self._held.isValid() and self._held.elapsed() > CLICK_MS:
            self.turnedOff.emit()
        # Qt has switched it over meanwhile.
        self.setChecked(self._is_on)
