"""Saving of what a window shows as a session, and opening of one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.state.latent_state import LatentState
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.session import Session, SessionContent, SessionError, session_settings
from app.state.viewer_state import ViewerState
from app.state.volume_memory import VolumeMemory
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
        self._preferences.note_recent("sessions", path)
        self.shown.emit(session, path.name)
        self.news.emit(f"Saved {path.name}.")

    def session(self) -> Session | None:
        """Return what is shown; None without a volume."""
        opened = self._workspace.opened
        if opened is None:
            return None
        inputs = self._state.inputs
        memory = replace(
            self._preferences.volume(opened.fingerprint),
            path="",
            models=(),
            tf=self._state.transfer_function,
            view=inputs.view,
            light=inputs.light,
            crop=inputs.crop,
            # Not "auto": another machine might choose another light.
            lighting=self._workspace.reference.settings.lighting,
        )
        band = self._sensitivity.band
        content = SessionContent(
            memory,
            session_settings(self._preferences.settings),
            self._sensitivity.choices,
            band.values if band is not None and band.pinned else None,
            self._latent.choices.shown,
        )
        return Session(opened.path, opened.fingerprint, content, self._workspace.model.folder)

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
        memory = session.content.memory
        wanted = Wanted(
            model=session.model if session.model is not None and session.model.exists() else None,
            transfer_function=memory.tf,
        )
        self._workspace.reading.open(
            session.volume,
            raw=RawLayout.parse(memory.raw_layout) if memory.raw_layout else None,
            choice=Choice.parse(memory.choice) if memory.choice else None,
            is_remembered=True,
            wanted=wanted,
        )

    def _volume_read(self, opened: OpenedVolume) -> None:
        if self._awaited is None or self._awaited[1].volume != opened.path:
            self._awaited = None
            return
        path, session = self._awaited
        known = self._preferences.volume(opened.fingerprint)
        self._before = self._keep_before(path, opened, known)
        self._is_other = opened.fingerprint != session.fingerprint
        memory = session.content.memory
        tf = known.tf if memory.tf is None else memory.tf
        kept = replace(memory, path=known.path, models=known.models, tf=tf)
        self._preferences.note_volume(opened.fingerprint, **vars(kept))

    def _keep_before(self, path: Path, opened: OpenedVolume, known: VolumeMemory) -> Path | None:
        """Write what is remembered of a volume to a session; return its path."""
        assert self._awaited is not None
        memory = replace(known, path="", models=(), tf=known.tf or opened.default)
        is_new = known.tf is None and not known.path
        is_same = memory == self._awaited[1].content.memory
        if self._folder is None or path == self._folder / BEFORE or is_new or is_same:
            return None
        content = SessionContent(memory, session_settings(self._preferences.settings))
        try:
            Session(opened.path, opened.fingerprint, content).save(self._folder / BEFORE)
        except SessionError as error:
            self.problem.emit(str(error))
            return None
        return self._folder / BEFORE

    def _volume_started(self) -> None:
        if self._awaited is None:
            self.shown.emit(None, "")
            return
        (path, session), self._awaited = self._awaited, None
        content, reference = session.content, self._workspace.reference
        memory, settings = content.memory, content.settings
        self._preferences.set(**vars(settings))
        size = settings.reference_size
        # It is noted of the volume already, and no edit that could be undone.
        reference.choose(
            keep=False,
            lighting=memory.lighting,
            drawing=settings.drawing,
            stop=settings.stop,
            denoises=settings.denoises,
            size="pane" if size is None else size,
        )
        if memory.light is not None and self._state.light is not None:
            reference.light.place(memory.light)
        if not memory.regions:
            # Those of the volume before stay for another time step, and for the same volume.
            self._sensitivity.start_volume(None, count=memory.region_count)
        self._sensitivity.choose(**vars(content.sensitivity))
        if content.band is not None:
            self._sensitivity.pin(*sorted(content.band))
        self._latent.choose(shown=content.browsing)
        if path != (self._folder or Path()) / BEFORE:
            self._preferences.note_recent("sessions", path)
        self.shown.emit(session, path.name)
        told = [f"{path.name} is open."]
        if self._is_other:
            name = session.volume.name
            told.append(f"{name} is not the file that it was saved with: its voxels differ.")
        if session.wrong:
            names = ", ".join(f"'{name}'" for name in session.wrong)
            told.append(f"What is wrong in it was left out: {names}.")
        if self._before is not None:
            told.append("What its volume looked like before is kept.")
        if told[1:]:
            self.told.emit(" ".join(told), self._before)
        self._before = None
