"""The workings of the latent browser: space and map, and pictures."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject

from app.engines.client import EngineClient
from app.engines.states import EngineState
from app.state.brightness import Brightness
from app.state.latent_pictures import LatentPictures
from app.state.latent_session import LatentSession, OpenSpace
from app.state.latent_state import LatentState
from app.state.viewer_state import ViewerState


class LatentWork(QObject):
    """Session and pictures of the latent browser.

    Parameters
    ----------
    exact, learned : EngineClient
        Clients of a ray caster and of the generator.

    Attributes
    ----------
    model : Path or None
        Folder of a model that fits the volume.
    """

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        exact: EngineClient,
        learned: EngineClient,
        brightness: Brightness,
        open_space: OpenSpace,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.state = latent
        self.model: Path | None = None
        self.session = LatentSession(state, latent, open_space, self)
        self.pictures = LatentPictures(
            state, latent, self.session, exact, learned, brightness, self
        )
        exact.stateChanged.connect(partial(self._check_failure, exact))

    def _check_failure(self, client: EngineClient, state: EngineState) -> None:
        """Say that an engine has failed."""
        if state is EngineState.FAILED and self.state.choices.shown:
            self.pictures.problem.emit(client.text)

    def restart(self) -> None:
        """Ask for all pictures anew, of an engine that was started anew."""
        self.pictures.start_volume()
        self.pictures.ask()

    def set_model(self, folder: Path | None, size: int | None, draws_codes: bool = False) -> None:
        """Set a model that fits the volume.

        Parameters
        ----------
        folder : Path or None
            None without one.
        size : int or None
            Size of its images.
        draws_codes : bool
            Whether it draws images from the codes of its own codec.
        """
        if folder != self.model:
            self.model = folder
            self.state.choose(codec="shipped")
        self.session.set_model(folder)
        self.pictures.set_model(size if draws_codes else None)

    def stop(self) -> None:
        """Ask all threads and processes to end; returns at once."""
        self.pictures.stop()
        self.session.stop()

    def join(self) -> None:
        """Wait until all threads have ended."""
        self.session.join()
