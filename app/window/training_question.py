"""Asks whether a model shall be trained, and says how long that takes on this machine."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox, QPushButton, QWidget

from app.state.training_clock import MEASURING_S, MINUTES, usual_minutes
from app.state.training_pace import TrainingPace

WAYS = "You can go on working, and cancel it."


class TrainingQuestion(QMessageBox):
    """Says at first how long a training usually takes, and at what pace once that is measured.

    Attributes
    ----------
    train : QPushButton
        Agrees.
    """

    def __init__(self, name: str, pace: TrainingPace, parent: QWidget) -> None:
        super().__init__(parent)
        self._pace = pace
        self.setWindowTitle("Train a model")
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setText(f"Train a model of '{name}'?")
        self._say(usual_minutes(), "The pace of this machine is being measured …")
        train = self.addButton("Train", QMessageBox.ButtonRole.AcceptRole)
        assert isinstance(train, QPushButton)
        self.train = train
        self.addButton(QMessageBox.StandardButton.Cancel)
        pace.found.connect(self._take)
        # Else it would go on beside the training.
        self.finished.connect(pace.cancel)
        self.finished.connect(self.deleteLater)

    def _take(self, samples_per_second: float, preparing_s: float) -> None:
        minutes = round(MINUTES + (preparing_s + MEASURING_S) / 60)
        count = round_to_two(60 * MINUTES * samples_per_second)
        self._say(
            minutes,
            f"This machine learns from {samples_per_second:.3g} samples a second, as measured: "
            f"from {count:,} in {MINUTES:.0f} minutes.",
        )

    def _say(self, minutes: int, pace: str) -> None:
        self.setInformativeText(
            f"It takes about {minutes} minutes in the background, in which the window is slower. "
            f"{pace} {WAYS}"
        )


def round_to_two(number: float) -> int:
    """Round a positive number to two digits."""
    return int(float(f"{number:.2g}"))
