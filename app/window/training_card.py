"""A card that shows how a training goes, and what came of it; menus begin one."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QProgressBar, QPushButton, QWidget

from app import theme
from app.engines.engines import ReferenceSettings
from app.icons import IconButton
from app.state.training_clock import usual_minutes
from app.state.training_run import TRAINED_LIGHT, TrainingRun

WIDTH = 480
"""Of the card, in pixels."""

BAR_SIZE = 100, 8
"""Width and height of the progress bar in pixels."""

STEPS = 1000
"""Steps of the progress bar."""

Phase = Literal["rest", "training", "trained", "failed"]

TRAIN_TIP = (
    "Trains the paper's networks on this volume beside the window: 4 MB that draw it from view and "
    "TF alone, in light that can be moved"
)


class TrainingCard(QFrame):
    """Follows a training; hidden while there is nothing to tell of one.

    A training and what came of it stay in sight, whatever is open.

    Attributes
    ----------
    train : QAction
        Begins a training once that is confirmed; enabled for a volume without a model.
    """

    trainRequested = Signal()
    """Emitted when a model of the open volume shall be trained."""
    trained = Signal(object)
    """Emitted with the folder of the trained model when it shall be shown."""

    def __init__(self, run: TrainingRun, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._run = run
        self._phase: Phase = "rest"
        self._is_offered = False
        self._folder: Path | None = None
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self._label = QLabel()
        self._label.setTextFormat(Qt.TextFormat.PlainText)
        self._label.setWordWrap(True)
        self._progress = QProgressBar()
        self._progress.setRange(0, STEPS)
        self._progress.setTextVisible(False)
        self._progress.setFixedSize(*BAR_SIZE)
        self._progress.setAccessibleName("Progress of the training")
        self.train = QAction("Train a model…", self)
        self.train.setToolTip(TRAIN_TIP)
        self._name_light(learned_otherwise=False)
        self.cancel = _button("Cancel", "Stop the training; it goes on from there if started again")
        self.show_model = _button("Use", "Open the model beside the ground truth")
        self.again = _button("Train…", "Try again")
        self.dismiss = IconButton("close", "Dismiss", "Escape", colors=theme.ON_IMAGE)
        self._lay_out()
        run.progressed.connect(self._show_progress)
        run.finished.connect(self._show_model)
        run.failed.connect(self._show_failure)
        run.cancelled.connect(self._rest)
        self._rest()

    @property
    def text(self) -> str:
        """The displayed sentence, as a whole."""
        return self._label.text()

    def set_offered(self, offered: bool) -> None:
        """Say whether the open volume is without a model."""
        self._is_offered = offered
        self._refresh()

    def set_settings(self, settings: ReferenceSettings) -> None:
        """Say in the menus which light a model learns, where the reference has another."""
        lighting = settings.lighting
        self._name_light(learned_otherwise=TRAINED_LIGHT[lighting] != lighting)

    def sizeHint(self) -> QSize:
        """Return the size of a card of the usual width."""
        layout = self.layout()
        assert layout is not None
        return QSize(WIDTH, layout.heightForWidth(WIDTH))

    def _name_light(self, learned_otherwise: bool) -> None:
        light = " under direct light" if learned_otherwise else ""
        self.train.setText(f"&Train a model{light}… (about {usual_minutes()} min)")

    def _lay_out(self) -> None:
        row = QHBoxLayout(self)
        row.setContentsMargins(12, 4, 4, 4)
        row.setSpacing(8)
        row.addWidget(self._label, 1)
        for part in (self._progress, self.cancel, self.show_model, self.again, self.dismiss):
            row.addWidget(part)
        for begun in (self.train.triggered, self.again.clicked):
            begun.connect(lambda _checked=False: self.trainRequested.emit())
        self.cancel.clicked.connect(lambda: self._run.cancel())
        self.show_model.clicked.connect(lambda: self._take_model())
        self.dismiss.clicked.connect(lambda: self._rest())

    def _rest(self) -> None:
        self._folder = None
        self._enter("rest", "")

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
        self._rest()
        self.trained.emit(folder)

    def _enter(self, phase: Phase, text: str) -> None:
        if phase != self._phase:
            self.setProperty("tone", "error" if phase == "failed" else "plain")
            # Qt looks at properties only when a style is set.
            self.style().unpolish(self)
            self.style().polish(self)
        self._phase = phase
        self._label.setText(text)
        self._refresh()

    def _refresh(self) -> None:
        phase = self._phase
        self.train.setEnabled(self._is_offered and phase != "training")
        self._progress.setVisible(phase == "training")
        self.cancel.setVisible(phase == "training")
        self.show_model.setVisible(phase == "trained")
        self.again.setVisible(phase == "failed" and self._is_offered)
        self.dismiss.setVisible(phase in ("trained", "failed"))
        self.setVisible(phase != "rest")
        self.updateGeometry()


def _button(text: str, tip: str) -> QPushButton:
    button = QPushButton(text)
    button.setToolTip(tip)
    # After a click, keys such as W are the window's again.
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button
