"""One line that offers a model to a volume without one, and shows how its training goes."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QProgressBar,
    QPushButton,
    QToolButton,
    QWidget,
)

from app import theme
from app.controls import ElidedLabel, text_button
from app.engines.engines import ReferenceSettings
from app.state.training_clock import usual_minutes
from app.state.training_run import TRAINED_LIGHT, TrainingRun

HEIGHT = 30
"""Of the line, in pixels."""

BAR_SIZE = 160, 10
"""Width and height of the progress bar in pixels."""

STEPS = 1000
"""Steps of the progress bar."""

Phase = Literal["offer", "training", "trained", "failed"]


class TrainingBar(QFrame):
    """Offers to train or to open a model, and follows a training; hidden where neither applies.

    A training and what came of it stay in sight, whatever is open.

    Parameters
    ----------
    run : TrainingRun
    """

    trainRequested = Signal()
    """Emitted when a model of the open volume shall be trained."""
    openRequested = Signal()
    """Emitted when a model's folder shall be chosen."""
    trained = Signal(object)
    """Emitted with the folder of the trained model when it shall be shown."""
    roomChanged = Signal()
    """Emitted when :attr:`needs_room` may have changed."""

    def __init__(self, run: TrainingRun, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._run = run
        self._phase: Phase = "offer"
        self._is_offered = False
        self._folder: Path | None = None
        self.setProperty("role", "panel")
        self.setFixedHeight(HEIGHT)
        self._label = ElidedLabel()
        self._progress = QProgressBar()
        self._progress.setRange(0, STEPS)
        self._progress.setTextVisible(False)
        self._progress.setFixedSize(*BAR_SIZE)
        self.train = _button(
            "",
            "Trains a model of this volume beside the window: a file of 3 MB that draws the\n"
            "volume where its own file is not, and is kept for the next time. It follows the\n"
            "light's direction. Global light would take hours to learn; it learns direct light.",
        )
        self._name_light(learned_otherwise=False)
        self.open = _button("Open a model…", "Choose the folder of a model of this volume")
        self.cancel = _button("Cancel", "Stop the training; it goes on from there if started again")
        self.show_model = _button("Show", "Open the model beside the reference")
        self.dismiss: QToolButton = text_button("✕", "Hide this line")
        self._lay_out()
        run.progressed.connect(self._show_progress)
        run.finished.connect(self._show_model)
        run.failed.connect(self._show_failure)
        run.cancelled.connect(self._offer)
        self._offer()

    @property
    def text(self) -> str:
        """The displayed sentence, as a whole."""
        return self._label.full_text

    @property
    def needs_room(self) -> bool:
        """Whether there is a sentence to read: what came of a training."""
        return self._phase in ("trained", "failed")

    def set_offered(self, offered: bool) -> None:
        """Say whether the open volume is without a model."""
        self._is_offered = offered
        self._refresh()

    def set_settings(self, settings: ReferenceSettings) -> None:
        """Say on the button which light a model learns, where the reference has another."""
        lighting = settings.lighting
        self._name_light(learned_otherwise=TRAINED_LIGHT[lighting] != lighting)

    def _name_light(self, learned_otherwise: bool) -> None:
        light = " under direct light" if learned_otherwise else ""
        self.train.setText(f"Train a model{light} (about {usual_minutes()} min)")

    def _lay_out(self) -> None:
        row = QHBoxLayout(self)
        row.setContentsMargins(12, 0, 6, 0)
        row.setSpacing(8)
        # What ends something is never where something is begun a moment later.
        for part in (self.cancel, self.dismiss, self._progress):
            row.addWidget(part)
        row.addWidget(self._label, 1)
        for button in (self.show_model, self.train, self.open):
            row.addWidget(button)
        self.train.clicked.connect(lambda: self.trainRequested.emit())
        self.open.clicked.connect(lambda: self.openRequested.emit())
        self.cancel.clicked.connect(lambda: self._run.cancel())
        self.show_model.clicked.connect(lambda: self._take_model())
        self.dismiss.clicked.connect(lambda: self._offer())

    def _offer(self) -> None:
        self._folder = None
        self._enter("offer", "No model yet")

    def _show_progress(self, fraction: float, words: str) -> None:
        self._progress.setValue(round(STEPS * fraction))
        self._enter("training", f"Model of {self._run.volume_name}: {words}")
        self.cancel.setEnabled(words != "stopping")

    def _show_model(self, folder: Path) -> None:
        self._folder = folder
        self._enter("trained", f"Trained on {self._run.volume_name}. {self._run.verdict}".rstrip())

    def _show_failure(self, sentence: str) -> None:
        self._enter("failed", sentence)

    def _take_model(self) -> None:
        folder = self._folder
        self._offer()
        self.trained.emit(folder)

    def _enter(self, phase: Phase, text: str) -> None:
        self._phase = phase
        self._label.set_full_text(text)
        palette = self.palette()
        if phase == "failed":
            palette.setColor(QPalette.ColorRole.WindowText, QColor(theme.ERROR))
        self._label.setPalette(palette)
        self._refresh()
        self.roomChanged.emit()

    def _refresh(self) -> None:
        phase, asks = self._phase, self._phase in ("offer", "failed")
        self._progress.setVisible(phase == "training")
        self.cancel.setVisible(phase == "training")
        self.show_model.setVisible(phase == "trained")
        self.dismiss.setVisible(phase in ("trained", "failed"))
        for button in (self.train, self.open):
            button.setVisible(asks and self._is_offered)
        self.setVisible(self._is_offered or phase != "offer")


def _button(text: str, tip: str) -> QPushButton:
    button = QPushButton(text)
    button.setToolTip(tip)
    # After a click, keys such as W are the window's again.
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button
