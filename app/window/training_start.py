"""Training of a model from the window: estimated, asked for and begun."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.training_clock import MINUTES
from app.state.training_order import TrainingChoices, training_order
from app.state.training_pace import TrainingPace
from app.state.training_run import TRAINED_LIGHT, TrainingRun
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.training_card import TrainingCard
from app.window.training_question import TrainingQuestion
from model.volume_files.choice import Choice


class TrainingStart(QObject):
    """Asks whether a model of the open volume shall be trained, and trains it as it is shown.

    Parameters
    ----------
    run : TrainingRun
    card : TrainingCard
        It offers the training.
    workspace : Workspace
    state : ViewerState
    preferences : Preferences
    parent : QWidget
        Parent of the question.

    Attributes
    ----------
    pace : TrainingPace
    """

    def __init__(
        self,
        run: TrainingRun,
        card: TrainingCard,
        workspace: Workspace,
        state: ViewerState,
        preferences: Preferences,
        parent: QWidget,
    ) -> None:
        super().__init__(parent)
        self._run, self._workspace = run, workspace
        self._state, self._preferences, self._parent = state, preferences, parent
        self.pace = TrainingPace(self)
        card.trainRequested.connect(self._ask)
        for change in (run.progressed, run.finished, run.failed, run.cancelled):
            change.connect(self._follow)

    def cancel(self) -> None:
        """Measure no pace any more."""
        self.pace.cancel()

    def _ask(self) -> None:
        """Train a model of the open volume once that is confirmed."""
        opened = self._workspace.opened
        if opened is None:
            return
        order = training_order(opened.path, MINUTES, **self._choices(opened))
        question = TrainingQuestion(opened.volume.name, self.pace, self._parent)
        question.train.clicked.connect(partial(self._train, opened))
        question.open()
        self.pace.measure(order)

    def _train(self, opened: OpenedVolume, _checked: bool = False) -> None:
        if opened is self._workspace.opened:
            self._run.start(opened.path, **self._choices(opened))

    def _choices(self, opened: OpenedVolume) -> TrainingChoices:
        """Say what a model of the open volume is of, as it is shown."""
        known = self._preferences.volume(opened.fingerprint)
        return TrainingChoices(
            lighting=TRAINED_LIGHT[self._workspace.reference.settings.lighting],
            scalar_range=opened.volume.scalar_range,
            scale=opened.volume.scale,
            raw_layout=known.raw_layout,
            up=self._state.up_axis,
            choice=Choice.parse(known.choice),
        )

    def _follow(self) -> None:
        """Leave the processors to a training: nothing is measured beside it."""
        self._workspace.reference.trade.pause(self._run.is_running)
