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


SOFTWARE = [
    "llvmpipe (LLVM 15.0.6, 256 bits)", "softpipe", "Mesa OffScreen", "Software Rasterizer",
    "Microsoft Basic Render Driver", "Apple Software Renderer", "Google SwiftShader",
]  # fmt: skip
CARDS = [
    "NVIDIA H100 PCIe/PCIe/SSE2", "Apple M2", "D3D12 (NVIDIA GeForce RTX 3060)",
    "AMD Radeon RX 6600 (radeonsi, navi23, LLVM 15.0.6, DRM 3.54)",
    "Mesa Intel(R) UHD Graphics 620 (KBL GT2)", "",
]  # fmt: skip


@pytest.mark.parametrize("name", SOFTWARE + CARDS)
@pytest.mark.parametrize("is_reported", [True, False])
def test_programs_that_draw_by_the_processor_are_told_from_cards(name, is_reported, monkeypatch):
    reported = f"server glx vendor string:  SGI\nOpenGL renderer string:  {name}\n"
    window = Window(
        reported if is_reported else "Display ID not set",
        "" if is_reported else f"  Vendor: Mesa\n  Renderer: {name}\n  Version: 4.5\n",
    )
    monkeypatch.setattr(opengl, "offscreen_window", window.open)
    for _ in range(2):
        assert opengl.software_name() == (name if name in SOFTWARE else "")
    assert opengl.opengl_name() == name and window.opened == 1


def test_where_there_is_no_opengl_it_has_no_name(monkeypatch):
    def no_opengl():
        raise CannotDrawError("VTK finds no OpenGL to draw with; install it.")

    monkeypatch.setattr(opengl, "offscreen_window", no_opengl)
    assert opengl.opengl_name() == ""


def test_this_machines_opengl_has_a_name():
    assert opengl.opengl_name()
