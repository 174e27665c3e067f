"""The order in which the engines of a volume that was opened begin: each needs the processor."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.client import Channel, EngineClient
from app.engines.states import EngineState
from app.state.generator_work import GeneratorWork

FIRST_MS = 3000
"""Time after which VTK begins even if the ray caster has not shown anything."""

MODEL_MS = 5000
"""Time that a model is given to be loaded before VTK begins."""


class StartOrder(QObject):
    """Has the ray caster draw first, then the model loaded, then VTK begin.

    The ray caster's first picture is there before VTK could have begun one, and differs little.
    The engines are held back by whoever starts them; where VTK is not, the model follows its first
    image.

    Parameters
    ----------
    stand_in : Channel
        Of the ray caster's images until VTK's are there.
    """

    done = Signal()
    """Emitted when VTK begins: questions about the images may take the processor, too."""

    def __init__(
        self,
        generator: EngineClient,
        reference: EngineClient,
        stand_in: Channel,
        model: GeneratorWork,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._generator, self._reference, self._model = generator, reference, model
        self._patience = QTimer(self, singleShot=True)
        self._patience.timeout.connect(self._finish)
        reference.heldBack.connect(lambda: self._patience.start(FIRST_MS))
        stand_in.answered.connect(lambda _result: self._take())
        stand_in.client.stateChanged.connect(self._follow_analyst)
        generator.stateChanged.connect(self._follow_model)
        reference.images.answered.connect(lambda _result: self._model.begin())
        reference.settled.connect(model.begin)

    @property
    def is_under_way(self) -> bool:
        """Whether VTK, and questions, have to wait."""
        return self._reference.is_held

    def stop(self) -> None:
        """Begin nothing any more."""
        self._patience.stop()

    def _take(self) -> None:
        self._model.begin()
        if not self._reference.is_held:
            return
        if self._generator.state is EngineState.LOADING:
            self._patience.start(MODEL_MS)
        else:
            self._finish()

    def _follow_analyst(self, state: EngineState) -> None:
        if state is EngineState.FAILED:
            self._finish()

    def _follow_model(self, state: EngineState) -> None:
        if state in (EngineState.SETTLED, EngineState.FAILED):
            self._finish()

    def _finish(self) -> None:
        if self._reference.is_held:
            self._patience.stop()
            self._reference.begin()
            self.done.emit()
