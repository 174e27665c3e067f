"""A button that is on while it is held, or from one click to the next."""

from __future__ import annotations

from PySide6.QtCore import QElapsedTimer, Signal
from PySide6.QtWidgets import QPushButton, QWidget

CLICK_MS = 350
"""Time up to which a press is a click; the button is held if it takes longer."""


class HeldButton(QPushButton):
    """Asks for something to be shown as long as it is held; a click lasts until the next one.

    Whoever shows it checks the button, and unchecks it when it is no longer shown.
    """

    turnedOn = Signal()
    turnedOff = Signal()

    def __init__(self, text: str, parent: QWidget | None = None) -> None:
        super().__init__(text, parent)
        self.setCheckable(True)
        self._held = QElapsedTimer()
        self.pressed.connect(self._press)
        self.released.connect(self._release)

    def nextCheckState(self) -> None:
        """Stay as it is when clicked: on or off is not for the button to decide."""

    def _press(self) -> None:
        if self.isChecked():
            self._held.invalidate()
            self.turnedOff.emit()
        else:
            self._held.start()
            self.turnedOn.emit()

    def _release(self) -> None:
        if self._held.isValid() and self._held.elapsed() > CLICK_MS:
            self.turnedOff.emit()
