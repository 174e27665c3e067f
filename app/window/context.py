"""Objects that the window's parts share, and dialogs for files to open and to write."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QMainWindow, QMessageBox

from app.engines.client import EngineClient
from app.image_view.engine_pane import EnginePane
from app.state.session import FIGURE_SUFFIX, SUFFIX
from app.state.workspace import Viewing, Workspace
from app.window.notices import Notices
from app.window.status_line import StatusLine
from model.errors import TfscopeError
from model.volume_files import SUFFIXES


@dataclass(frozen=True)
class Context(Viewing):
    """The window with its state, its images, and its notices and status line."""

    window: QMainWindow
    workspace: Workspace
    analyst: EngineClient
    panes: tuple[EnginePane, EnginePane, EnginePane]  # of the generator, the reference and B
    notices: Notices
    status: StatusLine

    def update_images(self) -> None:
        """Paint all images again, as something over them has changed."""
        for pane in self.panes:
            pane.canvas.update()

    def fail(self, text: str, key: str = "") -> None:
        """Show an error; it replaces the one with the same key."""
        self.notices.add(text, key=key, tone="error")

    def saved(self, key: str, save: Callable[..., object], path: Path, *content: object) -> bool:
        """Write a file and report it; if that fails, show why and return False."""
        return self.done(key, partial(save, path, *content), f"Saved {path.absolute()}.")

    def done(self, key: str, change: Callable[[], object], said: str) -> bool:
        """Run an action and report it; if that fails, show why and return False."""
        try:
            change()
        except TfscopeError as error:
            self.status.say("")
            self.fail(str(error), key)
            return False
        self.status.say(said)
        return True


VOLUME_FILTER = f"Volumes ({' '.join(f'*{s}' for s in SUFFIXES)});;All files (*)"
OTHERS = f"Volumes, sessions, figures (*{SUFFIX} *{FIGURE_SUFFIX} "
OPEN_FILTER = VOLUME_FILTER.replace("Volumes (", OTHERS)


def ask_for_file(context: Context, title: str, filters: str = "") -> Path | None:
    """Ask for a file to open, or without filters for a folder; None if the user cancels."""
    folder = context.preferences.settings.last_folder
    if filters:
        name, _ = QFileDialog.getOpenFileName(context.window, title, folder, filters)
    else:
        name = QFileDialog.getExistingDirectory(context.window, title, folder)
    return _chosen(context, name)


def ask_for_place(
    context: Context,
    title: str,
    filters: str,
    suffixes: tuple[str, ...],
    otherwise: str = "",
    ending: str = "",
) -> Path | None:
    """Ask for a file to write; None if the user cancels.

    The open volume's name is proposed or, without a volume, another one; none if that is empty.
    """
    opened = context.workspace.opened
    known = "" if opened is None else file_name(opened.volume.name)
    name = f"{known or otherwise}{ending or suffixes[0]}" if otherwise else ""
    start = str(Path(context.preferences.settings.last_folder) / name)
    chosen, kind = QFileDialog.getSaveFileName(context.window, title, start, filters)
    if not chosen:
        return None
    path = Path(chosen)
    if not path.name.lower().endswith(suffixes):
        # Qt's dialog has asked only about the file without the suffix.
        path = path.with_name(path.name + next((s for s in suffixes if s in kind), suffixes[0]))
        text = f"{path.name} exists. Replace it?"
        buttons = QMessageBox.StandardButton
        if path.exists() and QMessageBox.question(context.window, "Replace", text) != buttons.Yes:
            return None
    return _chosen(context, str(path))


def file_name(name: str) -> str:
    """Return a name without characters that are invalid or awkward in file names."""
    return re.sub(r"[^\w.+=-]+", "_", name).strip("._")[:100]


def menu_names(paths: Sequence[Path]) -> list[str]:
    """Return names of files for a menu, with as many folders as are needed to distinguish them."""
    names = []
    for path in paths:
        parts, last = path.parts, 1
        while last < len(parts) and sum(p.parts[-last:] == parts[-last:] for p in paths) > 1:
            last += 1
        folder = "/".join(parts[-last:-1])
        names.append(f"{path.name}  ({folder})" if folder else path.name)
    # An ampersand would mark a key.
    return [name.replace("&", "&&") for name in names]


def _chosen(context: Context, name: str) -> Path | None:
    """Return a chosen file; the next dialog starts in its folder."""
    if not name:
        return None
    context.preferences.set(last_folder=str(Path(name).absolute().parent))
    return Path(name)
