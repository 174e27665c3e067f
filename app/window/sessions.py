"""Saving and opening of sessions."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QCoreApplication, QObject

from app.controls import Action
from app.engines.background import LatestCall
from app.image_view.pane_focus import WipeLine
from app.state.opened_volume import OpenedVolume
from app.state.session import (
    FIGURE_SUFFIX,
    FIGURE_TEXT,
    SUFFIX,
    Session,
    SessionContent,
    SessionError,
    kept_mask,
)
from app.state.settings import ImageSettings, SessionSettings, part_of
from app.state.volume_opening import Wanted
from app.window.context import VOLUME_FILTER, Context, ask_for_file, ask_for_place
from app.window.overlays import ImageError, Overlays
from app.window.window_memory import WindowMemory
from model.errors import TfscopeError
from model.scene.mask import Mask
from model.scene.slices import MIDDLE
from model.scene.volume import Volume
from model.volume_files.choice import Choice
from model.volume_files.masks import write_mask
from model.volume_files.raw import RawLayout

SESSION_FILTER = f"Sessions (*{SUFFIX});;All files (*)"

LEFT_OUT = "mask"  # in a figure, the name of a mask; figures have no file for it
NOT_HELD: dict[str, Any] = {"path": "", "models": (), "light_seconds": {}}  # of a memory

KEY, MISSED = "sessions", "volume of the session"
"""Keys of notices: errors, and a session's volume that was not found."""


class Sessions(QObject):
    """Saves and opens sessions; the memory that one overwrites is first saved as another."""

    def __init__(
        self,
        context: Context,
        overlays: Overlays,
        memory: WindowMemory,
        wipe: WipeLine,
        error: ImageError,
    ) -> None:
        super().__init__(context.window)
        self._context, self._workspace = context, context.workspace
        self._preferences = context.preferences
        self._overlays, self._memory, self._wipe, self._error = overlays, memory, wipe, error
        folder = self._preferences.folder
        # The volume's memory before the last session was opened.
        self._before_path = None if folder is None else folder / "before_session.tfscope"
        self._awaited: tuple[Path, Session] | None = None
        self._is_before_kept = self._has_failed = False
        self._masks = LatestCall("session", self, context.status.say, self._fail, at_once=True)
        self.join = self._masks.join

    def ask_and_save(self) -> None:
        """Ask for a file and save the session to it."""
        path = ask_for_place(self._context, "Save session", SESSION_FILTER, (SUFFIX,), "session")
        if path is not None:
            self._memory.note()
            self.save(path)

    def save(self, path: Path) -> None:
        """Save the session to a file."""
        session, opened = self.session(), self._workspace.opened
        if session is None or opened is None:
            self._fail("There is nothing to save yet. Open a volume first.")
            return
        mask = self._context.state.mask_input.value
        saved = f"Saved {path.absolute()}."
        save = partial(self._save, path, session, mask, opened.volume, saved)
        if self._context.done(KEY, save, saved if mask is None else "Writing the mask …"):
            self._preferences.note_recent("sessions", path)
            self._name_window(path.name)

    def _save(
        self, path: Path, session: Session, mask: Mask | None, volume: Volume, said: str
    ) -> None:
        """Write a session and, next to it, its mask, which may take a while; then say something."""
        # This differs from the name proposed for a mask that is saved alone.
        name = "" if mask is None else f"{path.name}.mask.nrrd"
        memory = replace(session.content.memory, mask=name)
        replace(session, content=replace(session.content, memory=memory)).save(path)
        if mask is not None:
            # An earlier one may use the same file, and must be written first.
            self.join()

            def write() -> str:
                write_mask(path.with_name(name), mask, volume)
                return said

            self._masks.ask(write)

    def session(self) -> Session | None:
        """Return the present session; None without a volume."""
        context, opened = self._context, self._workspace.opened
        if opened is None:
            return None
        state, work, tf_input = context.state, self._workspace.reference, context.state.tf_input
        # Not "auto", as another machine might choose another light; nor a substitute during
        # compilation.
        look_b = tf_input.look
        if tf_input.compares and look_b.lighting is not None:
            look_b = replace(look_b, lighting=work.wanted_b.lighting)
        known = self._preferences.volume(opened.fingerprint)
        memory = replace(
            known,
            **NOT_HELD,
            cross_hair=known.cross_hair or MIDDLE,
            tf=tf_input.of("A"),
            tf_b=tf_input.of("B"),
            compares=tf_input.compares,
            pane=tf_input.pane,
            look_b=look_b,
            view=state.view,
            **{name: each.value for name, each in state.edited.items()}
            | {"mask": "" if state.mask_input.value is None else LEFT_OUT},
            lighting=work.wanted.lighting,
        )
        band = context.sensitivity.band
        kept = band.values if band is not None and band.kept else None
        settings = part_of(self._preferences.settings, SessionSettings)
        choices, latent = context.sensitivity.choices, context.latent.choices
        wipe = self._wipe.share if self._wipe.is_shown else None
        line = self._overlays.subject.line
        ends = (line[0], line[1]) if len(line) == 2 else None
        difference = self._error.is_wanted
        content = SessionContent(memory, settings, choices, kept, latent, wipe, ends, difference)
        return Session(opened.path, opened.fingerprint, content, self._workspace.model.folder)

    def texts_for(self, figure: Path | None) -> dict[str, str]:
        """Return texts for a figure's file, by name, so that it opens like a session."""
        is_kept = figure is not None and figure.suffix.lower() == FIGURE_SUFFIX
        session = self.session() if is_kept else None
        if session is None:
            return {}
        return {"Volume": session.volume.name, FIGURE_TEXT: session.text()}

    def open(self, path: Path, volume: Path | None = None) -> None:
        """Open a session, with its volume at the stored or another path."""
        self.join()
        try:
            session = Session.load(path)
        except SessionError as error:
            self._fail(str(error))
            return
        known = self._preferences.volume(session.fingerprint).path
        if volume is None and known and not session.volume.exists():
            # It has moved, or a figure says only its name.
            volume = Path(known)
        session = session if volume is None else replace(session, volume=volume)
        if not session.volume.exists():
            self._context.notices.add(
                f"{path.name} shows {session.volume}. That file is neither there nor in the "
                f"folder of {path.name}.",
                Action("Locate it…", partial(self._locate, path, session.volume.name)),
                key=MISSED,
                tone="error",
            )
            return
        self._awaited = path, session
        memory = session.content.memory
        memory = replace(memory, mask=str(kept_mask(path, memory) or ""))
        wanted = Wanted(
            raw=RawLayout.parse(memory.raw_layout) if memory.raw_layout else None,
            choice=Choice.parse(memory.choice) if memory.choice else None,
            is_remembered=True,
            model=session.model if session.model is not None and session.model.exists() else None,
            memory=memory,
        )
        self._workspace.opening.open(session.volume, wanted)

    def finish(self) -> bool:
        """Wait until masks are written; return False where one failed, which is shown."""
        self._has_failed = False
        self.join()
        QCoreApplication.sendPostedEvents(self._masks)
        return not self._has_failed

    def _fail(self, text: str) -> None:
        self._has_failed = True
        self._context.fail(text, KEY)

    def take_read(self, opened: OpenedVolume) -> None:
        """Save the memory of a session's volume before it is shown."""
        if self._awaited is None or self._awaited[1].volume != opened.path:
            self._awaited = None
            return
        self._is_before_kept = self._keep_before(*self._awaited, opened)

    def _keep_before(self, path: Path, session: Session, opened: OpenedVolume) -> bool:
        """Write a volume's memory to a session; return False if that failed."""
        known = self._preferences.volume(opened.fingerprint)
        memory = replace(known, **NOT_HELD, tf=known.tf or opened.default)
        is_new = known.tf is None and not known.path
        is_same, before = memory == session.content.memory, self._before_path
        if before is None or before == path or is_new or is_same:
            return False
        content = SessionContent(memory, part_of(self._preferences.settings, SessionSettings))
        try:
            mask = self._preferences.read_mask(known.mask, opened.volume)
            kept = Session(opened.path, opened.fingerprint, content)
            self._save(before, kept, mask, opened.volume, f"{path.name} is open.")
        except TfscopeError as error:
            self._fail(str(error))
            return False
        return True

    def start_volume(self) -> None:
        """Restore the rest of a session, now that its volume is open."""
        if self._awaited is None:
            self._name_window("")
            return
        (path, session), self._awaited = self._awaited, None
        context, content, reference = self._context, session.content, self._workspace.reference
        memory, settings = content.memory, content.settings
        self._preferences.set(**vars(settings))
        self._error.is_wanted = content.difference
        # At once, as showing or hiding an image is remembered.
        self._memory.restore_panes()
        # The volume's memory has the light already, and it cannot be undone.
        drawn = vars(part_of(settings, ImageSettings))
        reference.choose(keep=False, lighting=memory.lighting, **drawn)
        if memory.light is not None and context.state.light is not None:
            context.state.start_light(memory.light)
        if not memory.regions:
            # The previous ones stay for another time step, and for the same volume.
            context.sensitivity.start_volume(False, count=memory.region_count)
        context.sensitivity.choose(**vars(content.sensitivity))
        if content.band is not None:
            context.sensitivity.keep(*sorted(content.band))
        context.latent.choose(**vars(content.latent))
        if memory.compares:
            self._wipe.put(self._wipe.share if content.wipe is None else content.wipe)
            self._memory.panes.show_b(True, content.wipe is not None)
        self._overlays.subject = replace(self._overlays.subject, line=content.line or ())
        if path != self._before_path:
            self._preferences.note_recent("sessions", path)
        self._name_window(path.name)
        self._overlays.refresh()
        # Its view stays, whatever the size of the pane.
        reference.fits_view = False
        self._say_what_differs(path, session)

    def _say_what_differs(self, path: Path, session: Session) -> None:
        """Report what differs from the saved session, and offer the previous state."""
        opened = self._workspace.opened
        said = [f"{path.name} is open."]
        if opened is not None and opened.fingerprint != session.fingerprint:
            name = session.volume.name
            said.append(f"The voxels of {name} differ from those of the saved session.")
        if session.content.memory.mask and path.suffix.lower() == FIGURE_SUFFIX:
            said.append("Its mask is not in the figure, so all voxels are shown.")
        if session.wrong:
            names = ", ".join(f"'{name}'" for name in session.wrong)
            said.append(f"{names} could not be read from the session.")
        back = []
        if self._is_before_kept and self._before_path is not None:
            said.append(f"Go back returns to {session.volume.name} as you had left it.")
            back.append(Action("Go back", partial(self.open, self._before_path)))
        if said[1:]:
            self._context.notices.add(" ".join(said), *back)

    def _name_window(self, session: str) -> None:
        window = self._context.window
        title = window.windowTitle().rpartition(" | ")[2]
        window.setWindowTitle(f"{session} | {title}" if session else title)

    def _locate(self, path: Path, name: str) -> None:
        found = ask_for_file(self._context, f"Locate '{name}'", VOLUME_FILTER)
        if found is not None:
            self.open(path, found)
