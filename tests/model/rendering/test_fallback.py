import numpy as np
import pytest
from drawing import drawn

from model.errors import CannotDrawError
from model.rendering import opengl, vtk_renderer
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import FallbackRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

RANGE = (0.0, 255.0)
INPUTS = SceneInputs(
    View(),
    OpacityTF(RANGE, points=((0.0, 0.1), (255.0, 0.5))),
    ColorTF(RANGE, ((0.0, 1.0, 0.2, 0.2), (255.0, 0.9, 0.8, 0.6))),
)


def make_volume(length=12):
    values = np.random.default_rng(0).integers(0, 256, (8, 8, length))
    values[0, 0, :2] = 0, 255
    spacing = (12 / length, 1.0, 1.0)
    return Volume(values.astype(np.uint8), spacing, name="noise")


def expected(volume):
    image = drawn(RaycastRenderer, volume, INPUTS, 24)
    assert image[..., 3].max() > 0.1
    return image


def break_shader(renderer):
    actor = renderer._renderer.GetVolumes().GetItemAsObject(0)
    actor.GetShaderProperty().AddFragmentShaderReplacement("g_skip = false;", False, "no(;", True)


# VTK prints what it reports, too.
def test_a_volume_longer_than_the_drivers_textures(capfd):
    volume = make_volume(70_000)
    vtk = VtkRenderer(volume)
    for _ in range(2):
        with pytest.raises(CannotDrawError, match="cannot draw noise on this machine"):
            vtk.render(INPUTS, 24)
    vtk.close()
    both = FallbackRenderer(volume)
    assert both.reason == ""
    np.testing.assert_array_equal(both.render(INPUTS, 24), expected(volume))
    assert "exture" in both.reason and both.reason.endswith("the ray caster draws instead.")
    both.close()


def test_a_shader_that_does_not_compile(capfd):
    vtk = VtkRenderer(make_volume())
    break_shader(vtk)
    with pytest.raises(CannotDrawError, match="compile"):
        vtk.render(INPUTS, 24)
    vtk.close()


def test_it_may_fail_later_as_when_the_context_is_lost(capfd, monkeypatch):
    volume = make_volume()
    both = FallbackRenderer(volume)
    by_vtk = both.render(INPUTS, 24)
    assert both.reason == "" and by_vtk[..., 3].max() > 0.1
    vtk = both._renderer
    monkeypatch.setattr(vtk, "_failure", "the context was lost")
    np.testing.assert_array_equal(both.render(INPUTS, 24), expected(volume))
    assert "the context was lost" in both.reason
    both.close()


SOFTWARE, CARD = "llvmpipe (LLVM 15.0.6, 256 bits)", "NVIDIA RTX A2000/PCIe/SSE2"


@pytest.mark.parametrize(
    ("name", "spares_processor"), [(SOFTWARE, True), (SOFTWARE, False), (CARD, True)]
)
def test_where_vtk_would_draw_by_the_processor_the_ray_caster_does_unless_vtk_is_chosen(
    monkeypatch, name, spares_processor
):
    monkeypatch.setattr(opengl, "opengl_name", lambda: name)
    by_raycast = name == SOFTWARE and spares_processor
    if by_raycast:
        monkeypatch.setattr(vtk_renderer, "offscreen_window", pytest.fail)
    volume = make_volume()
    both = FallbackRenderer(volume, spares_processor=spares_processor)
    image = both.render(INPUTS, 24)
    assert both.by_raycast == by_raycast and not both.reason
    assert isinstance(both._renderer, VtkRenderer) != by_raycast
    if by_raycast:
        np.testing.assert_array_equal(image, expected(volume))
        assert "llvmpipe" in both.remark and "Choose VTK" in both.remark
    else:
        assert image[..., 3].max() > 0.1 and not both.remark
    both.close()
