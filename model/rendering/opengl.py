"""OpenGL off screen: the window that VTK draws in, and whether a graphics card draws there."""

from __future__ import annotations

import re
from functools import cache

from vtkmodules import vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from model.errors import CannotDrawError

SOFTWARE = (
    "llvmpipe",
    "softpipe",
    "swr",
    "swiftshader",
    "software",
    "mesa offscreen",
    "basic render",
    "gdi generic",
)
"""What names of OpenGL renderers have in them that use the processor, in small letters."""

_NAME = re.compile(r"^\s*(?:OpenGL renderer string|Renderer):[ \t]*(\S.*?)\s*$", re.MULTILINE)


def offscreen_window() -> vtkRenderWindow:
    """Open an off-screen window by the first method that works on this machine."""
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
    """Name of what draws OpenGL here, such as that of a graphics card; "" if unknown.

    It is asked once: opening a window takes some tenths of a second.
    """
    try:
        window = offscreen_window()
    except CannotDrawError:
        return ""
    window.SetSize(8, 8)
    window.Render()
    found = _NAME.search(f"{window.ReportCapabilities()}\n{_state(window)}")
    window.Finalize()
    return found.group(1) if found else ""


def software_name() -> str:
    """Name of the program that draws OpenGL in place of a graphics card; "" where a card does."""
    name = opengl_name()
    return name if any(word in name.lower() for word in SOFTWARE) else ""


def _state(window: vtkRenderWindow) -> str:
    """What VTK knows of OpenGL: without a display, a window does not report it."""
    state = getattr(window, "GetState", None)
    return "" if state is None else str(state())
