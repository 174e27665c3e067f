"""The default command, which opens the window."""

from __future__ import annotations

from pathlib import Path

from app.cli import values
from app.state.window_start import WindowStart
from model.errors import TfscopeError
from model.generator.catalog import volume_for
from model.volume_files.shipped import SCAN


def window_volume(volume: Path | None, model: Path | None, session: Path | None = None) -> Path:
    """Return the volume to open.

    Without one, it is the session's, or the model's if that is shipped, or the default.

    Raises
    ------
    TfscopeError
        For a session that cannot be read, or whose volume is nowhere.
    """
    if volume is not None:
        values.source(volume)
        return volume
    if session is not None:
        # Imported here: who opens no session starts without it.
        from app.state.session import Session

        found = Session.load(session).volume
        if not found.exists():
            raise TfscopeError(
                f"{session} shows {found}, which is not there any more; "
                "give its new place by --volume."
            )
        return found
    return (None if model is None else volume_for(model)) or SCAN


def open_window(start: WindowStart, device: str, screenshot: Path | None) -> int:
    """Open the window and return its exit code."""
    import gc

    from app.cli.outputs import make_room_for
    from app.quick_imports import leave_sources_unread

    leave_sources_unread()
    # The modules that are imported now stay: looking through them again and again takes time.
    gc.disable()
    try:
        from app.launch import run_window

        if screenshot is not None:
            make_room_for(screenshot)
        return run_window(start, device, screenshot)
    finally:
        gc.enable()
