"""Saving of what a window shows as a session, and opening of one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.state.kept_inputs import KEPT_INPUTS, input_of, numbers_of
from app.state.known_volume import FORMER_LIGHT
from app.state.latent_state import LatentState
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.session import Session, SessionError, of_session
from app.state.viewer_state import ViewerState
from app.state.volume_reading import Wanted
from app.state.workspace import Workspace
from model.volume_files.choice import Choice
from model.volume_files.raw import RawLayout

BEFORE = "before_session.tfscope"
"""File, in the user's folder, of what the volume of the session opened last looked like before."""


class SessionWork(QObject):
    """Takes sessions of the workspace, and brings them back.

    What is remembered of a volume is overwritten by its session; it is written to a session of
    its own before.

    Parameters
    ----------
    folder : Path or None
        Where that is written; None to keep nothing.
    """

    shown = Signal(object, str)
    """Emitted with the :class:`Session` that is shown from now on, and its name; None for none."""
    volumeMissed = Signal(object, object)
    """Emitted with a session's path and the :class:`Session`, whose volume is nowhere."""
    told = Signal(str, object)
    """Emitted with a sentence, and the file of the look before or None."""
    problem = Signal(str)
    news = Signal(str)

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        latent: LatentState,
        workspace: Workspace,
        preferences: Preferences,
        folder: Path | None,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state, self._sensitivity, self._latent = state, sensitivity, latent
        self._workspace, self._preferences = workspace, preferences
        self._folder = folder
        self._awaited: tuple[Path, Session] | None = None
        self._before: Path | None = None
        self._is_other = False
        workspace.reading.volumeRead.connect(self._volume_read)
        workspace.volumeStarted.connect(self._volume_started)

    def save(self, path: Path) -> None:
        """Write what is shown to a file."""
        session = self.session()
        if session is None:
            self.problem.emit("No volume is open yet: there is nothing to save.")
            return
        try:
            session.save(path)
        except SessionError as error:
            self.problem.emit(str(error))
            return
        self._preferences.note_session(path)
        self.shown.emit(session, path.name)
        self.news.emit(f"Saved {path.name}.")

    def session(self) -> Session | None:
        """Return what is shown; None without a volume."""
        opened = self._workspace.opened
        if opened is None:
            return None
        look = of_session(self._preferences.volume(opened.fingerprint))
        inputs = self._state.inputs
        look |= {name: numbers_of(name, getattr(inputs, name)) for name in KEPT_INPUTS}
        look |= {
            # Not "auto": another machine might choose another light.
            "lighting": self._workspace.reference.settings.lighting,
        }
        band = self._sensitivity.band
        return Session(
            volume=opened.path,
            fingerprint=opened.fingerprint,
            transfer_function=self._state.transfer_function,
            look=look,
            window=of_session(self._preferences.values),
            sensitivity=self._sensitivity.choices,
            band=band.values if band is not None and band.pinned else (),
            browsing=self._latent.choices.shown,
            model=self._workspace.model.folder,
        )

    def open(self, path: Path, volume: Path | None = None) -> None:
        """Open a session.

        Parameters
        ----------
        volume : Path, optional
            Where its volume is now.
        """
        try:
            session = Session.load(path)
        except SessionError as error:
            self.problem.emit(str(error))
            return
        session = session if volume is None else replace(session, volume=volume)
        if not session.volume.exists():
            self.volumeMissed.emit(path, session)
            return
        self._awaited = path, session
        layout = str(session.look.get("raw_layout", ""))
        choice = str(session.look.get("choice", ""))
        wanted = Wanted(
            model=session.model if session.model is not None and session.model.exists() else None,
            transfer_function=session.transfer_function,
        )
        self._workspace.reading.open(
            session.volume,
            raw=RawLayout.parse(layout) if layout else None,
            choice=Choice.parse(choice) if choice else None,
            is_remembered=True,
            wanted=wanted,
        )

    def _volume_read(self, opened: OpenedVolume) -> None:
        if self._awaited is None or self._awaited[1].volume != opened.path:
            self._awaited = None
            return
        path, session = self._awaited
        self._before = self._keep_before(path, opened)
        self._is_other = opened.fingerprint != session.fingerprint
        self._preferences.note_volume(opened.fingerprint, **session.look)

    def _keep_before(self, path: Path, opened: OpenedVolume) -> Path | None:
        """Write what is remembered of a volume to a session; return its path."""
        if self._folder is None or path == self._folder / BEFORE:
            return None
        known = self._preferences.volume(opened.fingerprint)
        tf = self._workspace.reading.kept_tf(opened.fingerprint)
        if tf is None and not known.path:
            return None
        before = Session(
            opened.path,
            opened.fingerprint,
            tf or opened.default,
            of_session(known),
            of_session(self._preferences.values),
        )
        assert self._awaited is not None
        session = self._awaited[1]
        if (before.transfer_function, before.look) == (session.transfer_function, session.look):
            return None
        try:
            before.save(self._folder / BEFORE)
        except SessionError as error:
            self.problem.emit(str(error))
            return None
        return self._folder / BEFORE

    def _volume_started(self) -> None:
        if self._awaited is None:
            self.shown.emit(None, "")
            return
        (path, session), self._awaited = self._awaited, None
        self._preferences.set(**session.window)
        size = self._preferences.value("reference_size")
        reference = self._workspace.reference
        lighting = session.look.get("lighting", "auto")
        # It is noted of the volume already, and no edit that could be undone.
        reference.choose(
            keep=False,
            lighting="soft" if lighting == FORMER_LIGHT else lighting,
            drawing=self._preferences.value("drawing"),
            stop=self._preferences.value("stop"),
            denoises=self._preferences.value("denoises"),
            size="pane" if size is None else size,
        )
        light = input_of("light", session.look.get("light", ()))
        if light is not None and self._state.light is not None:
            reference.light.place(light)
        if not session.look.get("regions"):
            # Those of the volume before stay for another time step, and for the same volume.
            self._sensitivity.start_volume(None, count=session.look.get("region_count", 0))
        self._sensitivity.choose(**vars(session.sensitivity))
        if session.band:
            self._sensitivity.pin(*session.band)
        self._latent.choose(shown=session.browsing)
        if path != (self._folder or Path()) / BEFORE:
            self._preferences.note_session(path)
        self.shown.emit(session, path.name)
        other = (
            f" {session.volume.name} is not the file that it was saved with: its voxels differ."
            if self._is_other
            else ""
        )
        if self._before is not None:
            kept = " What its volume looked like before is kept."
            self.told.emit(f"{path.name} is open.{other}{kept}", self._before)
        elif other:
            self.told.emit(f"{path.name} is open.{other}", None)
        self._before = None
