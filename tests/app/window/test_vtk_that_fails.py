import numpy as np
import pytest
from PIL import Image
from ramp import make_tf, make_volume
from window_fakes import PATIENCE_S

from app.engines.engines import REAL_BUILDERS
from app.image_view.picture import BLACK
from app.state import reference_choices
from app.window.figure import FigureChoice
from model.errors import CannotDrawError
from model.rendering import opengl, vtk_renderer
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.view import View

CHOICE = FigureChoice(48, 32, BLACK)


@pytest.fixture
def real_reference(builders, monkeypatch):
    """Have the reference drawn in truth, with a graphics card, where soft light is too slow."""
    # Compiled before a window waits for it.
    for lighting in ("none", "direct", "soft"):
        renderer = RaycastRenderer(make_volume(), lighting)
        renderer.render(SceneInputs.of(View(), make_tf()), 8)
        renderer.close()
    monkeypatch.setattr(opengl, "opengl_name", lambda: "NVIDIA RTX A2000/PCIe/SSE2")
    monkeypatch.setattr(builders, "reference", REAL_BUILDERS.reference)
    monkeypatch.setattr(reference_choices, "slow_lights", lambda _seconds: frozenset({"soft"}))


def fail(*_, **__):
    raise CannotDrawError("VTK cannot draw ramp on this machine ('out of memory'); crop it.")


def by_the_ray_caster(window, inputs):
    settings = window.workspace.reference.settings
    renderer = RaycastRenderer(
        make_volume(), settings.lighting, sample_distance=settings.smooth_distance
    )
    image = renderer.render(inputs, Raster(CHOICE.width, CHOICE.height))
    renderer.close()
    return image


@pytest.mark.parametrize("place", ["offscreen_window", "render"])
def test_the_ray_caster_draws_and_a_sentence_says_so(
    qtbot, make_window, real_reference, monkeypatch, tmp_path, place
):
    if place == "render":
        monkeypatch.setattr(VtkRenderer, "render", fail)
    else:
        monkeypatch.setattr(vtk_renderer, "offscreen_window", fail)
    window = make_window(model=None, lighting="direct")
    assert window.reference.client.error is None
    assert "out of memory" in window.reference.detail
    assert "the ray caster draws instead" in window.reference.detail
    window.brightness.set(1.0)
    # A moment later the first view is fitted to the pane.
    inputs = window.state.inputs
    window.saving.draw(CHOICE, tmp_path / "picture.png")
    qtbot.waitUntil((tmp_path / "picture.png").exists)
    saved = np.asarray(Image.open(tmp_path / "picture.png").convert("RGB"))
    expected = np.rint(255 * by_the_ray_caster(window, inputs)[..., :3])
    assert saved.max() > 20
    np.testing.assert_allclose(saved, expected, atol=1)
    # What nothing draws is not saved.
    monkeypatch.setattr(RaycastRenderer, "render", fail)
    window.saving.draw(CHOICE, tmp_path / "another.png")
    qtbot.waitUntil(lambda: "out of memory" in window.notice.text)
    assert [each.name for each in tmp_path.iterdir()] == ["picture.png"]


def test_without_a_graphics_card_vtk_draws_where_it_is_chosen(
    qtbot, make_window, real_reference, monkeypatch
):
    monkeypatch.setattr(opengl, "opengl_name", lambda: "llvmpipe (LLVM 15.0.6, 256 bits)")
    window = make_window(model=None, lighting="direct")
    client, choose = window.reference.client, window.workspace.reference.choose
    assert client.description == "ray caster" and "llvmpipe" in client.remark
    for changes, name in (
        ({"drawing": "vtk"}, "VTK"),
        ({"drawing": "raycast"}, "ray caster"),
        ({"drawing": "auto"}, "ray caster"),
        # VTK does not draw this light, with or without a graphics card.
        ({"lighting": "soft"}, "ray caster"),
    ):
        choose(**changes)
        is_automatic = changes.get("drawing", "auto") == "auto"
        qtbot.waitUntil(lambda: client.is_ready and client.is_settled, timeout=1000 * PATIENCE_S)
        assert (client.description, bool(client.remark)) == (name, is_automatic)


def test_the_ground_truth_next_to_a_generator_is_vtks_without_a_graphics_card(
    qtbot, make_window, real_reference, monkeypatch
):
    monkeypatch.setattr(opengl, "opengl_name", lambda: "llvmpipe (LLVM 15.0.6, 256 bits)")
    window = make_window(lighting="direct")
    client = window.reference.client
    shown = []
    window.reference.resultShown.connect(lambda result: shown.append(result.image.by))
    for lighting, name in (("direct", "VTK"), ("none", "VTK"), ("soft", "ray caster")):
        window.workspace.reference.choose(lighting=lighting)
        window.state.set_view(View(azimuth=40.0 + len(shown)))
        qtbot.waitUntil(lambda: client.is_ready and client.is_settled, timeout=1000 * PATIENCE_S)
        assert shown[-1].startswith(name) and window.reference.status.startswith(name)
    # Alone, where nothing is compared with it, the ray caster's faster image stays.
    window.workspace.open_model(None)
    window.workspace.reference.choose(lighting="direct")
    qtbot.waitUntil(lambda: client.is_ready and client.is_settled, timeout=1000 * PATIENCE_S)
    assert shown[-1] == "ray caster" and "llvmpipe" in client.remark
