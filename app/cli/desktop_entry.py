"""tfscope in the menu of the desktop: the command ``desktop-entry``."""

from __future__ import annotations

import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

from app.cli.outputs import write_text
from model.errors import TfscopeError

ICON = Path(__file__).resolve().parents[2] / "resources" / "icons" / "tfscope.png"


@dataclass(frozen=True)
class DesktopEntry:
    """Put tfscope into the desktop's menu, and among the programs for its sessions and volumes."""

    def run(self) -> None:
        """Write the entry where the freedesktop.org looks for it."""
        if not sys.platform.startswith("linux"):
            raise TfscopeError("Desktop entries are Linux's; elsewhere make a shortcut to tfscope.")
        home = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
        entry = home / "applications" / "tfscope.desktop"
        write_text(entry, _content())
        print(f"{entry} is written.")


def _content() -> str:
    """Return the entry, by the freedesktop.org's specification."""
    program = Path(sys.argv[0]).resolve()
    words = [sys.executable, str(program)] if program.suffix == ".py" else [str(program)]
    return "\n".join(
        (
            "[Desktop Entry]",
            "Type=Application",
            "Name=tfscope",
            "GenericName=Volume viewer",
            "Comment=Look into volumes through transfer functions",
            f"Exec={' '.join(map(_quoted, words))} %f",
            f"Icon={ICON}",
            "Terminal=false",
            "Categories=Science;MedicalSoftware;DataVisualization;",
            "MimeType=application/dicom;image/tiff;application/x-hdf5;application/x-netcdf;",
            "",
        )
    )


def _quoted(word: str) -> str:
    """Quote a word as the specification asks for, which is not as a shell does."""
    escaped = re.sub(r'(["`$\\])', r"\\\1", word).replace("%", "%%")
    return f'"{escaped}"'
