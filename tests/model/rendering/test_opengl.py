"""Whether a graphics card draws is known by the name that OpenGL gives itself."""

import pytest

from model.errors import CannotDrawError
from model.rendering import opengl


@pytest.fixture(autouse=True)
def ask_anew():
    opengl.opengl_name.cache_clear()
    yield
    opengl.opengl_name.cache_clear()


class Window:
    """A window of an OpenGL with a made-up name."""

    opened = 0

    def __init__(self, reported, known):
        self.reported, self.known = reported, known

    def open(self):
        self.opened += 1
        return self

    def SetSize(self, *_):  # noqa: N802
        pass

    Render = Finalize = SetSize

    def ReportCapabilities(self):  # noqa: N802
        return self.reported

    def GetState(self):  # noqa: N802
        return self.known


@pytest.mark.parametrize(
    "name",
    [
        "llvmpipe (LLVM 15.0.6, 256 bits)",
        "softpipe",
        "Mesa OffScreen",
        "Software Rasterizer",
        "Microsoft Basic Render Driver",
        "Apple Software Renderer",
        "Google SwiftShader",
    ],
)
@pytest.mark.parametrize("is_reported", [True, False])
def test_programs_that_draw_by_the_processor(name, is_reported, monkeypatch):
    reported = f"server glx vendor string:  SGI\nOpenGL renderer string:  {name}\n"
    window = Window(
        reported if is_reported else "Display ID not set",
        "" if is_reported else f"  Vendor: Mesa\n  Renderer: {name}\n  Version: 4.5\n",
    )
    monkeypatch.setattr(opengl, "offscreen_window", window.open)
    assert opengl.software_name() == name
    assert opengl.software_name() == name
    assert window.opened == 1


@pytest.mark.parametrize(
    "name",
    [
        "NVIDIA H100 PCIe/PCIe/SSE2",
        "AMD Radeon RX 6600 (radeonsi, navi23, LLVM 15.0.6, DRM 3.54)",
        "Mesa Intel(R) UHD Graphics 620 (KBL GT2)",
        "Apple M2",
        "D3D12 (NVIDIA GeForce RTX 3060)",
    ],
)
def test_graphics_cards(name, monkeypatch):
    window = Window("", f"  Renderer: {name}\n")
    monkeypatch.setattr(opengl, "offscreen_window", window.open)
    assert (opengl.opengl_name(), opengl.software_name()) == (name, "")


def test_what_does_not_say_its_name_or_is_not_there(monkeypatch):
    monkeypatch.setattr(opengl, "offscreen_window", Window("", "").open)
    assert opengl.software_name() == ""
    opengl.opengl_name.cache_clear()

    def no_opengl():
        raise CannotDrawError("VTK finds no OpenGL to draw with; install it.")

    monkeypatch.setattr(opengl, "offscreen_window", no_opengl)
    assert opengl.opengl_name() == ""


def test_this_machines_opengl_has_a_name():
    assert opengl.opengl_name()
