import math
import threading
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest
import torch
from lively import SIZE, lively_network
from ramp import byte_volume, make_tf
from window_fakes import PATIENCE_S, FakeEngine, make_request

from app.engines import drawer, path_tracing, renderer_engine
from app.engines.drawer import Drawer
from app.engines.engines import REAL_BUILDERS, GeneratorEngine
from app.engines.exactness import STOPS
from app.engines.pace import LONGEST_SECONDS, REST_SECONDS, SCALES, SHARP_SECONDS, SOON_SECONDS
from app.engines.path_tracing import PathAnalyst, PathTracingEngine
from app.engines.renderer_engine import ReferenceEngine, RendererEngine
from app.engines.requests import (
    IMAGES_B,
    UNWATCHED,
    BatchRequest,
    ImageRequest,
    PictureRequest,
    Quality,
    RegionSensitivityRequest,
    SupersededError,
    TradeOffRequest,
    ValueSensitivityRequest,
    VisibilityRequest,
    Watch,
)
from model.errors import NotOfferedError
from model.generator.generator import Generator
from model.latent.codes import NetworkCodec
from model.networks.card import ModelCard
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.scene import LightDirection, Scene
from model.scene.tf_perturbation import edit_around
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.exact import region_responses


class FakeRenderer:
    """Paints each pixel with its row and column; its time passes on the clock of engines alone."""

    now = 0.0

    def __init__(self, seconds=0.0):
        self.seconds, self.calls = seconds, []
        self.waits = 0.0  # seconds that the next image takes in addition

    def close(self):
        """Nothing is held."""

    def render(self, inputs, size, sample_distance, go_on=None):
        FakeRenderer.now += self.seconds * size.rows * size.columns + self.waits
        self.waits = 0.0
        self.calls.append((size, sample_distance))
        image = np.ones((size.rows, size.columns, 4), dtype=np.float32)
        image[..., 0] = (size.top + size.step * np.arange(size.rows))[:, None] / 1000
        image[..., 1] = (size.left + size.step * np.arange(size.columns)) / 1000
        return image


@pytest.fixture
def clock(monkeypatch):
    monkeypatch.setattr(drawer.time, "perf_counter", lambda: FakeRenderer.now)


PANE = Raster(1000, 400)
AT_REST = ImageRequest(make_request(1).inputs, Quality(400, raster=PANE))
MOVING = replace(AT_REST, quality=replace(AT_REST.quality, live=True))


def rests(engine, **changes):
    """Images at rest, each wider than the one before; the last of them says so."""
    images = list(engine.images_of(replace(AT_REST, **changes)))
    widths = [image.width for image in images]
    assert widths == sorted(widths)
    assert [image.is_last for image in images] == [False] * (len(images) - 1) + [True]
    return images


@pytest.mark.parametrize("seconds", [1e-7, 2e-6, 1e-5])
def test_every_pixel_is_drawn_in_the_end_and_something_is_seen_soon(clock, seconds):
    engine = RendererEngine(Drawer(FakeRenderer(seconds), 0.5))
    rests(engine)
    # By now it is known how long pixels take; the scene is another.
    images = rests(engine, inputs=replace(AT_REST.inputs, view=View(80.0)))
    assert images[-1].rgba.shape == (400, 1000, 4)
    np.testing.assert_allclose(images[-1].rgba[:, 0, 0], np.arange(400) / 1000, atol=1e-6)
    assert images[0].seconds <= 1.5 * SHARP_SECONDS or images[0].width < 0.2 * PANE.width
    # Half of the width comes between where all pixels take long.
    is_long = images[-1].seconds > REST_SECONDS
    assert any(image.width == PANE.width / 2 for image in images) == is_long
    # Half of the pixels come first where all take longer; those between are like them.
    half = next((image for image in images[:-1] if image.width == PANE.width), None)
    assert (half is not None) == (images[-1].seconds > SOON_SECONDS)
    if half is not None:
        assert half.is_preview and half.quiet_seconds is None
        assert half.seconds == pytest.approx(images[-1].seconds / 2)
        np.testing.assert_allclose(half.rgba[:, 1:-1], images[-1].rgba[:, 1:-1], atol=1.01e-3)
    # A finer image than what moves, which is there, or none.
    (moved,) = engine.images_of(MOVING)
    assert rests(engine)[0].width > moved.width or moved.width == PANE.width
    # What is there is never drawn coarser.
    assert [image.width for image in rests(engine)] == [PANE.width]


def test_what_takes_minutes_is_left_coarse_unless_all_pixels_are_chosen(clock):
    seconds = 2.1 * LONGEST_SECONDS / (PANE.width * PANE.height)
    engine = RendererEngine(Drawer(FakeRenderer(seconds), 0.5))
    images = rests(engine)
    assert images[0].width < images[-1].width < PANE.width
    assert LONGEST_SECONDS / 8 < images[-1].seconds <= 1.25 * LONGEST_SECONDS
    assert rests(engine, is_fixed=True)[-1].width == PANE.width


def test_a_first_image_that_was_held_up_leaves_none_coarse(clock):
    renderer = FakeRenderer(1e-7)
    renderer.waits = LONGEST_SECONDS / 4  # as while kernels are compiled
    images = rests(RendererEngine(Drawer(renderer, 0.5)))
    assert images[-1].width == PANE.width
    assert images[0].width < PANE.width


def test_an_image_that_moves_takes_as_long_as_is_chosen(clock):
    engine = RendererEngine(Drawer(FakeRenderer(1e-6), 0.5))
    widths = []
    for stop in STOPS.values():
        for _ in range(3):
            (image,) = engine.images_of(replace(MOVING, stop=stop))
        assert image.is_last and image.seconds <= 1.01 * stop.live_seconds
        widths.append(image.width)
    assert widths == sorted(widths) and widths[0] < widths[-1]


class FakeVtk(FakeRenderer):
    """Draws in place of VTK, or leaves it to the ray caster; says in which threads."""

    sample_distance = 0.5
    reason = remark = ""

    def __init__(self, seconds, by_raycast=False):
        super().__init__(seconds)
        self.by_raycast = by_raycast
        self.may_open = threading.Event()
        self.may_open.set()
        self.threads = []

    def open(self):
        assert self.may_open.wait(PATIENCE_S)
        self.threads.append(threading.current_thread())
        return self

    def render(self, inputs, size, sample_distance, go_on=None):
        self.threads.append(threading.current_thread())
        return super().render(inputs, size, sample_distance)

    def close(self):
        self.threads.append(threading.current_thread())


def next_to(vtk):
    """An engine of a fast ray caster and this."""
    return ReferenceEngine(Drawer(FakeRenderer(1e-7), 0.5), vtk.open)


def test_the_ray_casters_sharp_image_comes_before_vtk_is_opened_and_draws(clock):
    vtk = FakeVtk(2e-6)
    engine = next_to(vtk)
    (moved,) = engine.images_of(MOVING)
    assert moved.by_raycast and moved.is_preview and not vtk.threads
    coming = engine.images_of(AT_REST)
    first = next(coming)
    assert first.by_raycast and first.is_preview and not first.is_last and not vtk.threads
    *others, last = coming
    assert [image.by for image in others] == ["ray caster"] * len(others)
    # No coarse image of VTK's takes the place of the sharp one.
    assert (last.by, last.is_last, last.is_preview, last.width) == ("VTK", True, False, PANE.width)
    # What moves is the ray caster's all the same.
    (moved,) = engine.images_of(replace(MOVING, inputs=replace(MOVING.inputs, view=View(9.0))))
    assert moved.by_raycast and moved.is_preview
    engine.close()
    # VTK was opened, drew and was closed in one thread, which is not the engine's.
    assert len(vtk.threads) > 2 and len(set(vtk.threads)) == 1
    assert threading.current_thread() not in vtk.threads
    engine = next_to(FakeVtk(1e-8))
    rests(engine)
    images = rests(engine, inputs=replace(AT_REST.inputs, view=View(80.0)))
    assert [image.by for image in images] == ["VTK"]
    engine.close()


def test_vtk_that_is_being_opened_holds_nothing_up(clock):
    vtk = FakeVtk(1e-6)
    vtk.may_open.clear()
    engine = next_to(vtk)
    coming = engine.images_of(AT_REST, Watch(lambda: False))
    assert next(coming).by_raycast
    with pytest.raises(SupersededError):
        list(coming)
    (moved,) = engine.images_of(MOVING)
    assert moved.by_raycast and not vtk.threads
    vtk.may_open.set()
    assert rests(engine)[-1].by == "VTK"
    engine.close()


def test_without_vtk_the_ray_casters_image_is_the_last_and_drawn_once(clock):
    vtk = FakeVtk(1e-7, by_raycast=True)
    engine = next_to(vtk)
    images = rests(engine)
    assert not vtk.calls
    assert (images[-1].by, images[-1].is_preview, images[-1].width) == ("ray caster", False, 1000)
    assert images[-2].width == PANE.width
    (moved,) = engine.images_of(MOVING)
    assert not moved.is_preview and moved.by_raycast
    engine.close()


def test_time_and_error_of_what_moves_are_measured_against_the_image_at_rest(clock):
    engine = RendererEngine(Drawer(FakeRenderer(1e-6), 0.5))
    request = TradeOffRequest(AT_REST.inputs, AT_REST.quality)
    with pytest.raises(NotOfferedError):
        engine.trade_off(request)
    rests(engine)
    noted = []
    found = engine.trade_off(request, Watch(note=noted.append))
    assert noted == [number / len(SCALES) for number in range(len(SCALES))]
    pixels = [1000 * 400 * scale**2 for scale in sorted(SCALES)]
    np.testing.assert_allclose(found[:, 0], 1e-6 * np.array(pixels), rtol=0.02)
    assert found[-1, 1] == 0 and (found[:-1, 1] > 0).all()


@pytest.mark.parametrize(
    "asked", ["images", "images_of", "picture", "region_sensitivity", "visibility"]
)
def test_the_ray_caster_gives_up_anywhere(asked):
    engine = RendererEngine(Drawer(RaycastRenderer(byte_volume(), threads=1), 0.5))
    inputs, quality = make_request(1).inputs, Quality(64)
    request = {
        "images": BatchRequest(inputs, quality, (inputs,) * 3),
        "images_of": ImageRequest(inputs, quality),
        "picture": PictureRequest(inputs, quality),
        "region_sensitivity": RegionSensitivityRequest(inputs, quality, Outline(), 8.0),
        "visibility": VisibilityRequest(inputs, quality, (Outline(),)),
    }[asked]
    answers = count()
    with pytest.raises(SupersededError):
        list(getattr(engine, asked)(request, Watch(lambda: next(answers) < 2)))
    # What comes next is not given up.
    list(getattr(engine, asked)(request))


def traced(engine, size, samples):
    stop = replace(STOPS["balanced"], samples=samples, error=0.0)
    images = list(engine.images_of(ImageRequest(make_request(1).inputs, Quality(size), stop)))
    assert images[-1].is_last and not any(image.is_last for image in images[:-1])
    return images


def test_path_traced_light_says_its_samples_and_is_given_up_when_nobody_wants_it():
    engine = PathTracingEngine(RefiningRenderer(PathTracer(byte_volume(), threads=1), None), 0.5)
    images = traced(engine, 32, 16)
    whole = [image for image in images if image.width == 32]
    assert [image.samples for image in whole] == [1, 2, 4, 8, 16]
    assert whole[0].by == "path tracer, 1 sample" and whole[0].error == math.inf
    assert whole[-1].by == engine.description == "path tracer, 16 samples"
    assert 0 < whole[-1].error < 0.5
    asked, stop = count(), replace(STOPS["exact"], samples=1 << 20, error=0.0)
    endless = ImageRequest(make_request(1).inputs, Quality(64), stop)
    with pytest.raises(SupersededError):
        list(engine.images_of(endless, Watch(lambda: next(asked) < 20)))
    engine.close()


def test_a_path_traced_image_goes_on_where_it_ended():
    passes = []

    class Counting(PathTracer):
        def _run(self, *arguments):
            passes.append(1)
            return super()._run(*arguments)

    engine = PathTracingEngine(RefiningRenderer(Counting(byte_volume(), threads=1), None), 0.5)
    traced(engine, 16, 2)
    passes.clear()
    images = traced(engine, 16, 8)
    # Two samples more, then four, and nothing coarser.
    assert len(passes) == 2
    assert [image.samples for image in images] == [2, 4, 8]
    whole = PathTracer(byte_volume(), threads=1).render(make_request(1).inputs, 16, samples=8)
    np.testing.assert_allclose(images[-1].rgba, whole, atol=1e-6)
    # What is good enough is there at once.
    assert [image.samples for image in traced(engine, 16, 4)] == [8]
    # An error leaves nothing that would go on.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Counting, "_run", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            traced(engine, 16, 16)
    assert traced(engine, 16, 16)[-1].samples == 16
    engine.close()


def test_two_path_traced_images_in_turn_are_each_as_if_it_were_alone():
    engine = PathTracingEngine(RefiningRenderer(PathTracer(byte_volume(), threads=1), None), 0.5)
    stop = replace(STOPS["balanced"], samples=8, error=0.0)
    a = ImageRequest(make_request(1).inputs, Quality(16), stop)
    b = replace(a, inputs=SceneInputs.of(View(), make_tf(140.0)), channel=IMAGES_B)
    b_is_wanted = True
    asked = count()
    paused = Watch(gives_way=lambda: next(asked) % 3 == 0)
    coming = engine.images_of(a, paused), engine.images_of(b, Watch(lambda: b_is_wanted))
    # B is called off in the midst, which is nothing to A. A often pauses.
    next(coming[1])
    first = next(filter(None, coming[0]))
    b_is_wanted = False
    (*others, last) = coming[0]
    assert None in others
    again = list(engine.images_of(b))[-1]
    assert first.samples < last.samples == again.samples == 8
    for request, image in ((a, last), (b, again)):
        alone = PathTracer(byte_volume(), threads=1).render(request.inputs, 16, samples=8)
        np.testing.assert_allclose(image.rgba, alone, atol=1e-6)
    engine.close()


def test_where_nothing_cleans_soft_light_is_seen_while_something_moves():
    soft = Drawer(RaycastRenderer(byte_volume(), "soft", LightDirection()), 0.5)
    renderer = RefiningRenderer(PathTracer(byte_volume(), threads=1), None)
    engine = PathTracingEngine(renderer, 0.5, open_soft=lambda: soft)
    inputs = replace(make_request(1).inputs, light=LightDirection())
    live = ImageRequest(inputs, Quality(32, live=True))
    (moved,) = engine.images_of(live)
    assert moved.is_preview and moved.by_raycast and moved.error is None
    np.testing.assert_array_equal(moved.rgba, soft.renderer.render(inputs, moved.width))
    *_, last = engine.images_of(replace(live, quality=Quality(32), stop=STOPS["fast"]))
    assert last.is_last and not last.is_preview and last.by.startswith("path tracer")
    engine.close()


@pytest.mark.parametrize(("live", "distance"), [(False, 0.1), (True, 0.5)])
def test_small_pictures_at_rest_have_the_samples_of_large_ones(live, distance):
    renderer = RaycastRenderer(byte_volume(), threads=1)
    engine = RendererEngine(Drawer(renderer, 0.5, "raycast", 0.1))
    inputs = make_request(1).inputs
    (image,) = engine.images(BatchRequest(inputs, Quality(24, live=live)))
    np.testing.assert_array_equal(image, renderer.render(inputs, 24, distance))
    engine = RendererEngine(Drawer(FakeRenderer(1e-7), 0.5))  # VTK, while kernels are compiled
    assert len(engine.images(BatchRequest(inputs, Quality(24, live=live)))) == 1


@pytest.mark.parametrize(("width", "distance"), [(0.4, 0.025), (8.0, 0.1)])
def test_where_layers_are_thinner_than_a_step_samples_become_denser_at_rest(width, distance):
    steep = Volume((100 + 100 * (np.indices((6, 7, 8)).sum(axis=0) % 2)).astype(np.uint8))
    layer = OpacityTF((100.0, 200.0), (GaussianMode(150.0, width, 0.9),))
    inputs = replace(make_request(1).inputs, opacity_tf=layer)
    renderer = RaycastRenderer(steep, threads=1)
    engine = RendererEngine(Drawer(renderer, 0.5, "raycast", 0.1))
    truth = renderer.render(inputs, 160, distance)
    shown = rests(engine, inputs=inputs, quality=Quality(160))[-1].rgba
    np.testing.assert_array_equal(shown, truth)
    saved = engine.picture(PictureRequest(inputs, Quality(160)))
    np.testing.assert_array_equal(saved, np.rint(255 * truth))


def test_small_path_traced_pictures_have_few_samples():
    """Six of 200 x 200 pixels with 64 samples of each held the image up for half a minute."""
    renderer = RefiningRenderer(PathTracer(byte_volume(), threads=1), None)
    assert renderer.samples == 64 and not renderer.cleans
    engine = PathTracingEngine(renderer, sample_distance=0.5)
    inputs = make_request(1).inputs
    other = replace(inputs, view=View(azimuth=80.0))
    request = BatchRequest(inputs, Quality(24), (other,))
    for image, seen in zip(engine.images(request), (inputs, other), strict=True):
        tracer = PathTracer(byte_volume(), threads=1)
        np.testing.assert_allclose(image, tracer.render(seen, 24, samples=16), atol=1e-6)


def test_path_traced_tiles_make_up_the_picture_that_is_traced_as_a_whole(monkeypatch):
    monkeypatch.setattr(renderer_engine, "TILE", 40)
    monkeypatch.setattr(path_tracing, "MARGIN", 5)
    renderer = RefiningRenderer(PathTracer(byte_volume(), threads=1), None, samples=2)
    engine = PathTracingEngine(renderer, sample_distance=0.5)
    whole, inputs = Raster(90, 50), make_request(1).inputs
    for samples in (1, 4):
        quality = Quality(50, raster=whole, samples=samples)
        noted = []
        picture = engine.picture(PictureRequest(inputs, quality), Watch(note=noted.append))
        # How far it has got is told all the way, and in the end it is all there.
        assert noted == sorted(noted) and noted[-1] == pytest.approx(1.0)
        assert len(noted) >= 30 and max(np.diff(noted)) < 0.1
        # Without a number, as many as the renderer has.
        *_, right = renderer.refined(inputs, whole, max(samples, 2))
        np.testing.assert_allclose(picture / 255, right.rgba, atol=0.6 / 255)
        # Of each tile by its pixels; margins count for little.
        assert right.error / 1.2 < engine.image_error < 1.2 * right.error


def test_a_picture_to_save_is_put_together_from_tiles():
    renderer = FakeRenderer()
    engine = RendererEngine(Drawer(renderer, 0.5))
    size = Quality(900, raster=Raster(1500, 900))
    noted = []
    picture = engine.picture(PictureRequest(make_request(1).inputs, size), Watch(note=noted.append))
    assert noted == [0.0, 0.5]
    assert picture.shape == (900, 1500, 4) and picture.dtype == np.uint8
    assert len(renderer.calls) == 2
    np.testing.assert_array_equal(picture[0, :900, 1], np.rint(np.arange(900) / 1000 * 255))


def test_small_pictures_are_traced_where_that_is_wanted_and_there_is_time(monkeypatch):
    volume, light = byte_volume(), LightDirection()
    built = []

    def tracing():
        built.append(FakeEngine())
        return built[-1]

    engine = PathAnalyst(volume, light, 0.5, tracing)
    inputs = replace(make_request(1).inputs, light=light)
    soft = RaycastRenderer(volume, "soft", light)
    request = BatchRequest(inputs, Quality(24), (inputs,))
    np.testing.assert_array_equal(engine.images(request)[1], soft.render(inputs, 24, 0.1))
    assert not built
    # The fake's second image is grey.
    wanted = replace(request, traced=True)
    np.testing.assert_allclose(engine.images(wanted)[1], 0.1)
    assert len(built) == 1 and engine.images(wanted).shape == (2, 24, 24, 4)
    engine.close()
    assert built[0].closed


def test_under_path_traced_light_pictures_and_fields_are_soft_and_curves_unlit():
    volume, light = byte_volume(), LightDirection()
    engine, fine = PathAnalyst(volume, light, 0.5), PathAnalyst(volume, light, 0.1)
    # Fields at rest have closer samples.
    soft, unlit = RaycastRenderer(volume, "soft", light, 0.25), RaycastRenderer(volume)
    finer = RaycastRenderer(volume, "soft", light, 0.1)
    inputs = replace(make_request(1).inputs, light=light)
    region = RegionSensitivityRequest(inputs, Quality(24), Outline(), 8.0)
    found = engine.region_sensitivity(region)
    right = region_responses(unlit, inputs, 24, Outline(), 8.0)
    np.testing.assert_allclose(found, right, rtol=1e-4, atol=1e-6)
    field = ValueSensitivityRequest(inputs, Quality(24), (150.0, 150.0), 8.0)
    edit = edit_around(150.0, soft.scalar_range, 8.0)
    for analyst, own in ((engine, soft), (fine, finer)):
        changes = own.change(inputs, 24, edit)
        np.testing.assert_allclose(analyst.value_sensitivity(field), changes, rtol=1e-4, atol=1e-6)


VIEW = View(40, 20, 3, 1.0)
INPUTS = SceneInputs.of(VIEW, make_tf())
SMALL = Quality(16)


@pytest.fixture(scope="module")
def engine():
    card = ModelCard(Scene.of(byte_volume(), SIZE.image_size), "draft", SIZE)
    return GeneratorEngine(Generator(card, lively_network(), torch.device("cpu")), [])


def test_codes_are_drawn_as_the_tfs_that_they_are_of(engine):
    other = SceneInputs.of(VIEW, make_tf(140.0))
    tfs = np.stack([one.opacity_tf.sample() for one in (INPUTS, other)])
    codes = tuple(map(tuple, NetworkCodec(engine._generator.network.codec).encode(tfs).tolist()))
    from_codes = BatchRequest(INPUTS, SMALL, (other,), codes).answer(engine, UNWATCHED)
    from_tfs = BatchRequest(INPUTS, SMALL, (other,)).answer(engine, UNWATCHED)
    assert np.abs(from_tfs[0] - from_tfs[1]).max() > 1e-4
    np.testing.assert_allclose(from_codes, from_tfs, atol=1e-5)


def test_what_is_kept_of_an_image_belongs_to_it(engine):
    other = SceneInputs.of(View(200, -10, 0, 1.0), make_tf(140.0))
    half, whole = Outline.rectangle(0, 0, 0.5, 0.5), Outline()
    asked = [(INPUTS, half, 6.0), (INPUTS, whole, 6.0), (other, whole, 6.0), (INPUTS, half, 9.0)]
    for inputs, region, width in asked:
        request = RegionSensitivityRequest(inputs, SMALL, region, width)
        fresh = GeneratorEngine(engine._generator, [])
        found = request.answer(engine, UNWATCHED)
        np.testing.assert_allclose(found, request.answer(fresh, UNWATCHED), rtol=1e-5, atol=1e-9)
        assert np.abs(found).max() > 0


def test_a_model_that_returns_is_not_loaded_again(engine):
    kept = []
    GeneratorEngine(engine._generator, kept).close()
    again = REAL_BUILDERS.generator(Path("missing"), kept, "cpu")
    assert again._generator is engine._generator and not kept
