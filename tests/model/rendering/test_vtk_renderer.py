"""VTK's pictures: against closed forms, against the ray caster's, and where it cannot draw."""

import itertools
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from drawing import RAINBOW, VIEW, WHITE, constant, drawn, image_of, slab

from model.errors import CannotDrawError
from model.rendering import opengl, vtk_renderer
from model.rendering.raster import Raster, middle_square
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import FallbackRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection, Scene
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

STEP = 1 / 255


@pytest.mark.parametrize("opacity", [2e-5, 9e-5, 1.1e-4])
@pytest.mark.parametrize("step", [0.25, 1.0])
def test_thin_haze_adds_up(opacity, step):
    volume, view = slab((9, 1201, 9)), View(distance=0.27)
    image = image_of(VtkRenderer, volume, view, constant(opacity), WHITE, 33, sample_distance=step)
    expected = 1 - np.exp(1200 * np.log1p(-opacity))
    assert image[16, 16, 3] == pytest.approx(expected, abs=1.5 * STEP)


def test_volumes_far_from_the_origin_look_as_near_it(volume):
    far = 1e12
    moved = replace(volume, origin=(far, -far, 3 * far))
    near, there = (image_of(VtkRenderer, each, lighting="direct") for each in (volume, moved))
    assert near.max() > 0.1
    np.testing.assert_array_equal(there, near)


def test_a_long_picture_shows_in_its_middle_what_a_square_one_does(volume):
    renderer, inputs = VtkRenderer(volume), SceneInputs(VIEW, constant(0.3), RAINBOW)
    for raster in (Raster(1, 16383), Raster(2, 3000), Raster(3000, 2)):
        middle = middle_square(renderer.render(inputs, raster))
        square = renderer.render(inputs, raster.shorter)
        assert square[..., 3].max() > 0.9
        np.testing.assert_allclose(middle, square, atol=2.5 * STEP)


FULL = (0.0, 255.0)
FAINT = SceneInputs(
    View(),
    OpacityTF(FULL, points=((0.0, 0.1), (255.0, 0.5))),
    ColorTF(FULL, ((0.0, 1.0, 0.2, 0.2), (255.0, 0.9, 0.8, 0.6))),
)


def noise(length=12):
    values = np.random.default_rng(0).integers(0, 256, (8, 8, length))
    values[0, 0, :2] = 0, 255
    spacing = (12 / length, 1.0, 1.0)
    return Volume(values.astype(np.uint8), spacing, name="noise")


def by_raycaster(volume):
    image = drawn(RaycastRenderer, volume, FAINT, 24)
    assert image[..., 3].max() > 0.1
    return image


# VTK prints what it reports, too.
def test_a_volume_longer_than_the_drivers_textures(capfd):
    volume = noise(70_000)
    vtk = VtkRenderer(volume)
    for _ in range(2):
        with pytest.raises(CannotDrawError, match="cannot draw noise on this machine"):
            vtk.render(FAINT, 24)
    both = FallbackRenderer(volume)
    assert both.reason == ""
    np.testing.assert_array_equal(both.render(FAINT, 24), by_raycaster(volume))
    assert "exture" in both.reason and both.reason.endswith("the ray caster draws instead.")
    both.close()


def test_a_shader_that_does_not_compile(capfd):
    vtk = VtkRenderer(noise())
    shader = vtk._renderer.GetVolumes().GetItemAsObject(0).GetShaderProperty()
    shader.AddFragmentShaderReplacement("g_skip = false;", False, "no(;", True)
    with pytest.raises(CannotDrawError, match="compile"):
        vtk.render(FAINT, 24)


def test_it_may_fail_later_as_when_the_context_is_lost(capfd, monkeypatch):
    volume = noise()
    both = FallbackRenderer(volume)
    by_vtk = both.render(FAINT, 24)
    assert both.reason == "" and by_vtk[..., 3].max() > 0.1
    vtk = both._renderer
    monkeypatch.setattr(vtk, "_failure", "the context was lost")
    np.testing.assert_array_equal(both.render(FAINT, 24), by_raycaster(volume))
    assert "the context was lost" in both.reason
    both.close()


LLVMPIPE, CARD = "llvmpipe (LLVM 15.0.6, 256 bits)", "NVIDIA RTX A2000/PCIe/SSE2"


@pytest.mark.parametrize(
    ("name", "spares_processor"), [(LLVMPIPE, True), (LLVMPIPE, False), (CARD, True)]
)
def test_where_vtk_would_draw_by_the_processor_the_ray_caster_does_unless_vtk_is_chosen(
    monkeypatch, name, spares_processor
):
    monkeypatch.setattr(opengl, "opengl_name", lambda: name)
    by_raycast = name == LLVMPIPE and spares_processor
    if by_raycast:
        monkeypatch.setattr(vtk_renderer, "offscreen_window", pytest.fail)
    volume = noise()
    both = FallbackRenderer(volume, spares_processor=spares_processor)
    image = both.render(FAINT, 24)
    assert both.by_raycast == by_raycast and not both.reason
    assert isinstance(both._renderer, VtkRenderer) != by_raycast
    if by_raycast:
        np.testing.assert_array_equal(image, by_raycaster(volume))
        assert "llvmpipe" in both.remark and "Choose VTK" in both.remark
    else:
        assert image[..., 3].max() > 0.1 and not both.remark
    both.close()


@pytest.fixture(autouse=True)
def ask_anew():
    opengl.opengl_name.cache_clear()
    yield
    opengl.opengl_name.cache_clear()


class Window:
    """A window of an OpenGL with a made-up name."""

    opened = 0

    def __init__(self, reported, known):
        self.ReportCapabilities, self.GetState = (lambda: reported), (lambda: known)

    def open(self):
        self.opened += 1
        return self

    def SetSize(self, *_):  # noqa: N802
        pass

    Render = Finalize = SetSize


SOFTWARE = [
    "llvmpipe (LLVM 15.0.6, 256 bits)", "softpipe", "Mesa OffScreen", "Software Rasterizer",
    "Microsoft Basic Render Driver", "Apple Software Renderer", "Google SwiftShader",
]  # fmt: skip
CARDS = [
    "NVIDIA H100 PCIe/PCIe/SSE2", "Apple M2", "D3D12 (NVIDIA GeForce RTX 3060)",
    "AMD Radeon RX 6600 (radeonsi, navi23, LLVM 15.0.6, DRM 3.54)",
    "Mesa Intel(R) UHD Graphics 620 (KBL GT2)", "",
]  # fmt: skip


def test_programs_that_draw_by_the_processor_are_told_from_cards(monkeypatch):
    reports = "server glx vendor string:  SGI\nOpenGL renderer string:  {}\n", "Display ID not set"
    states = "", "  Vendor: Mesa\n  Renderer: {}\n  Version: 4.5\n"
    for name, report, state in itertools.product(SOFTWARE + CARDS, reports, states):
        if "{}" not in report + state:
            continue
        window = Window(report.format(name), state.format(name))
        monkeypatch.setattr(opengl, "offscreen_window", window.open)
        opengl.opengl_name.cache_clear()
        for _ in range(2):
            assert opengl.software_name() == (name if name in SOFTWARE else "")
        assert opengl.opengl_name() == name and window.opened == 1


def test_this_machines_opengl_has_a_name_and_where_there_is_none_it_has_none(monkeypatch):
    assert opengl.opengl_name()
    no_opengl = Mock(side_effect=CannotDrawError("VTK finds no OpenGL to draw with; install it."))
    monkeypatch.setattr(opengl, "offscreen_window", no_opengl)
    opengl.opengl_name.cache_clear()
    assert opengl.opengl_name() == ""


LARGE = 128


def errors(volume, samples, **options):
    """Root mean square difference of each image between the two renderers."""
    ours, vtk = RaycastRenderer(volume, **options), VtkRenderer(volume, **options)
    found = []
    for sample in samples:
        expected = vtk.render(sample, LARGE)
        assert expected[..., 3].max() > 0.1
        found.append(np.sqrt(np.mean((ours.render(sample, LARGE) - expected) ** 2)))
    return np.array(found)


@pytest.mark.parametrize("path", shipped_volumes(), ids=lambda path: path.name[:12])
def test_images_agree(path):
    shipped = read_volume(path)
    scene = Scene.of(shipped, LARGE)
    samples = [draw_sample(scene, 11, "train", index) for index in range(3)]
    assert errors(shipped, samples).max() <= 0.005
    if shipped.name.startswith(("lidc", "reacting")):
        light = LightDirection(-45.0, 45.0)
        assert errors(shipped, samples[:1], lighting="direct", light=light).max() <= 0.01


@pytest.mark.parametrize("shape", [(2, 2, 2), (2, 5, 3), (40, 30, 2), (30, 30, 30)])
def test_an_opaque_volume_covers_what_vtk_covers(shape):
    scalars = np.full(shape, 200, np.uint8)
    scalars[0, 0, 0] = 0
    opaque = OpacityTF((0.0, 200.0), points=((0.0, 1.0), (200.0, 1.0)))
    # From outside, from a pole with roll, and from near by.
    views = (35.0, 25.0, 7.0, 0.9), (0.0, 80.0), (20.0, 90.0, 15.0), (130.0, -5.0, 0.0, 0.7)
    for view in views:
        inputs = SceneInputs(View(*view), opaque, RAINBOW)
        ours, theirs = (
            drawn(kind, Volume(scalars), inputs, LARGE)[..., 3]
            for kind in (RaycastRenderer, VtkRenderer)
        )
        assert np.isin(ours, (0.0, 1.0)).all()
        assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
        assert ((ours > 0.5) != (theirs > 0.5)).sum() <= 8
