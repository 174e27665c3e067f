"""The error of the generator's image: how far it is from the reference's of the same inputs."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from app.image_view.engine_pane import EnginePane
from app.state.sensitivity_export import at_size_of
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from model.scene.inputs import SceneInputs

Image = NDArray[np.float32]

TIP = (
    "Root mean squared difference of the colours from the reference's, in the square that both\n"
    "images show: 0 where they are equal, 1 from black to white"
)


class ImageError(QObject):
    """Compares both images at rest, and says the error above the generator's.

    Where the generator was trained under another light, or the volume is cropped, which models
    are not trained for, there is nothing to compare.

    Parameters
    ----------
    generator, reference : EnginePane
    state : ViewerState
    workspace : Workspace
    """

    def __init__(
        self,
        generator: EnginePane,
        reference: EnginePane,
        state: ViewerState,
        workspace: Workspace,
    ) -> None:
        super().__init__(generator)
        self._generator = generator
        self._state = state
        self._workspace = workspace
        self._shown: dict[str, tuple[SceneInputs, Image]] = {}
        for name, pane in (("generator", generator), ("reference", reference)):
            pane.imageShown.connect(partial(self._take, name))
        state.inputsChanged.connect(lambda: generator.set_note(""))
        workspace.modelChanged.connect(self._forget)

    def _take(self, name: str, inputs: SceneInputs, image: Image) -> None:
        self._shown[name] = inputs, image[..., :3]
        if not self._state.live and len(self._shown) == 2:
            self._compare()

    def _compare(self) -> None:
        (inputs, drawn), (others, truth) = self._shown["generator"], self._shown["reference"]
        alike = self._workspace.model_lighting == self._workspace.reference.settings.lighting
        if inputs != others or inputs != self._state.inputs or not alike or inputs.crop:
            self._generator.set_note("")
            return
        # Not by model.metrics: it imports torch and more, without which the window starts.
        one, other = np.clip(drawn, 0, 1), np.clip(at_size_of(drawn, truth), 0, 1)
        error = float(np.sqrt(np.mean((one - other) ** 2)))
        self._generator.set_note(f"RMSE {error:.3f}", TIP)

    def _forget(self) -> None:
        self._shown.pop("generator", None)
        self._generator.set_note("")
