"""Searches for a picture: goals that the user remembers or opens, and the TF on its way there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog, QWidget

from app.image_view.engine_pane import EnginePane
from app.state.latent_search import SearchStep
from app.state.latent_work import LatentWork
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.errors import TfscopeError
from model.rendering.raster import middle_square
from model.scene.inputs import SceneInputs
from model.scene.tf_fitting import fitted_curve
from model.scene.transfer_function import TransferFunction

Images = NDArray[np.float32]


class SearchControl(QObject):
    """Starts searches, previews what they find, and makes the result one undo step.

    Parameters
    ----------
    regions : SensitivityState
        Its active region is the one that a search is about.
    reference : EngineClient
        Its newest image can be remembered as a goal.
    parent : QWidget
        Parent of dialogs.

    Attributes
    ----------
    image : ndarray of float32, shape (S, S, 4), or None
        The newest image of the reference.
    """

    changed = Signal()
    """Emitted when a search has started or ended."""
    told = Signal(str)
    """Emitted with how far a search has got."""
    problem = Signal(str)
    news = Signal(str)

    def __init__(
        self,
        state: ViewerState,
        work: LatentWork,
        regions: SensitivityState,
        reference: EnginePane,
        parent: QWidget,
    ) -> None:
        super().__init__(parent)
        self.image: Images | None = None
        self._state = state
        self._work = work
        self._regions = regions
        self._parent = parent
        self._goal: Images | None = None
        self._found: TransferFunction | None = None
        work.search.stepped.connect(self._show_step)
        work.search.ended.connect(self._end)
        reference.imageShown.connect(self._keep_image)
        state.tf_input.changed.connect(self._tf_changed)
        state.volumeStarting.connect(self._forget_images)

    @property
    def has_goal(self) -> bool:
        """Whether a picture is remembered."""
        return self._goal is not None

    def seek(self, kind: str) -> None:
        """Start a search, or stop one; see :class:`BrowserBar`'s `seekRequested`."""
        search, outline = self._work.search, self._regions.outline
        if kind == "stop":
            search.cancel()
        elif self._work.session.map is None:
            self.problem.emit("There is no map to search yet; wait until it is open.")
        elif kind == "remember" and self.image is None:
            self.problem.emit("There is no picture to remember yet; wait until it is drawn.")
        elif kind == "remember":
            self._goal = self.image
            self.news.emit("The picture is remembered; change the TF, then search for it.")
        elif kind == "file":
            self._seek_file()
        elif kind in ("more", "less"):
            search.seek("more" if kind == "more" else "less", outline)
        elif self._goal is not None:
            search.seek_picture(self._goal, outline if kind == "region" else None)
        self.changed.emit()

    def _seek_file(self) -> None:
        name, _ = QFileDialog.getOpenFileName(
            self._parent, "Picture to search for", "", "PNG (*.png)"
        )
        if not name:
            return
        from model.latent.picture_file import read_picture

        try:
            picture = read_picture(Path(name))
        except TfscopeError as error:
            self.problem.emit(str(error))
            return
        self._work.search.seek_picture(picture)

    def _show_step(self, step: SearchStep) -> None:
        tf = replace(self._state.transfer_function, opacity=fitted_curve(step.tf))
        self._found = tf
        self._state.tf_input.move(tf)
        self.told.emit(f"Searching: difference {step.error:.3f} after {step.batches} batches")

    def _end(self, problem: str) -> None:
        found, self._found = self._found, None
        # A drag of the user's own that ended the search goes on.
        if found is not None and found == self._state.transfer_function:
            self._state.tf_input.finish("TF found by search")
        if problem:
            self.problem.emit(problem)
        self.changed.emit()

    def _tf_changed(self, tf: TransferFunction) -> None:
        # The user's own edit ends a search.
        if tf != self._found and self._work.search.is_running:
            self._work.search.cancel()

    def _keep_image(self, _inputs: SceneInputs, image: Images) -> None:
        self.image = middle_square(image)

    def _forget_images(self) -> None:
        self.image = self._goal = None
