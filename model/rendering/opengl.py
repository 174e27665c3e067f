"""Off-screen OpenGL: VTK's window, its OpenGL implementation, and VTK's errors."""

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from vtkmodules import vtkRenderingOpenGL2
from vtkmodules.vtkCommonCore import vtkOutputWindow
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from model.errors import CannotDrawError

SOFTWARE = re.compile(
    "llvmpipe|softpipe|swr|swiftshader|software|mesa offscreen|basic render|gdi generic"
)
"""Parts of the names of OpenGL renderers that use the processor, in lower case."""

_NAME = re.compile(r"^\s*(?:OpenGL renderer string|Renderer):[ \t]*(\S.*?)\s*$", re.MULTILINE)
_SAID = re.compile(r"\(0x[0-9a-f]+\): *(.*?)\s*$", re.DOTALL)


def offscreen_window() -> vtkRenderWindow:
    """Open an off-screen window by the first method that works."""
    for name in ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow", "vtkRenderWindow"):
        kind = getattr(vtkRenderingOpenGL2, name, vtkRenderWindow)
        window = kind()
        window.SetOffScreenRendering(True)
        window.SetMultiSamples(0)
        window.SetAlphaBitPlanes(True)
        if window.SupportsOpenGL():
            return window
    raise CannotDrawError(
        "VTK finds no OpenGL to draw with; on Debian or Ubuntu install it with "
        "'apt-get install libegl1 libgl1 libgl1-mesa-dri'."
    )


@cache
def opengl_name() -> str:
    """Name of the OpenGL renderer, such as a graphics card; "" if unknown."""
    try:
        window = offscreen_window()
    except CannotDrawError:
        return ""
    window.SetSize(8, 8)
    window.Render()
    # Without a display, only VTK's OpenGL state reports it, not the window.
    state = getattr(window, "GetState", lambda: "")()
    found = _NAME.search(f"{window.ReportCapabilities()}\n{state}")
    window.Finalize()
    return found.group(1) if found else ""


def software_name() -> str:
    """Name of a software OpenGL renderer; "" with a graphics card."""
    name = opengl_name()
    return name if SOFTWARE.search(name.lower()) else ""


@contextmanager
def drawing_errors() -> Iterator[list[str]]:
    """Collect the errors that VTK reports in this thread without raising exceptions."""
    found: list[str] = []
    thread = threading.get_ident()

    def note(_window: Any, _event: str, text: str = "") -> None:
        if threading.get_ident() == thread:
            said = _SAID.search(text or "")
            found.append(((said.group(1) if said else text) or "an error").split("\n")[0].strip())

    note.CallDataType = "string0"  # type: ignore[attr-defined]
    window = vtkOutputWindow.GetInstance()
    # VTK's annotations have events by number only.
    events: Any = "ErrorEvent"
    tag = window.AddObserver(events, note)
    try:
        yield found
    finally:
        window.RemoveObserver(tag)
