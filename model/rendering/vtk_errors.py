"""Errors that VTK reports while it draws, which it would only print."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from vtkmodules.vtkCommonCore import vtkOutputWindow

_SAID = re.compile(r"\(0x[0-9a-f]+\): *(.*?)\s*$", re.DOTALL)


@contextmanager
def drawing_errors() -> Iterator[list[str]]:
    """Collect what VTK reports as errors in this thread; it goes on without an exception."""
    found: list[str] = []
    thread = threading.get_ident()

    def note(_window: Any, _event: str, text: str = "") -> None:
        if threading.get_ident() == thread:
            said = _SAID.search(text or "")
            found.append(((said.group(1) if said else text) or "an error").split("\n")[0].strip())

    note.CallDataType = "string0"  # type: ignore[attr-defined]
    window = vtkOutputWindow.GetInstance()
    # VTK's annotations know events by number only.
    events: Any = "ErrorEvent"
    tag = window.AddObserver(events, note)
    try:
        yield found
    finally:
        window.RemoveObserver(tag)
