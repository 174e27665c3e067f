from __future__ import annotations

import math
from dataclasses import replace
from itertools import count
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from ramp import make_volume
from window_fakes import FakeEngine, make_request

from app.engines import path_tracing, stand_in
from app.engines.engines import (
    RendererEngine,
)
from app.engines.messages import SupersededError
from app.engines.path_tracing import PathTracingEngine
from app.engines.quality import Quality
from app.engines.requests import (
    BatchRequest,
    ImageRequest,
    PictureRequest,
    RegionSensitivityRequest,
    ValueSensitivityRequest,
    Watch,
)
from app.engines.stand_in import StandInEngine
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.light import LightDirection
from model.scene.region import Outline
from model.scene.tf_perturbation import edit_around
from model.scene.view import View
from model.sensitivity.rendered import region_responses


class RecordingRenderer:
    """Paints each pixel with its row and column in the whole picture."""

    def __init__(self) -> None:
        self.calls: list[tuple[Raster, float]] = []

    def render(self, inputs: object, size: Raster, sample_distance: float) -> NDArray[Any]:
        self.calls.append((size, sample_distance))
        image = np.ones((size.rows, size.columns, 4), dtype=np.float32)
        image[..., 0] = np.arange(size.top, size.bottom)[:, None] / 1000
        image[..., 1] = np.arange(size.left, size.right) / 1000
        return image


def make_engine() -> tuple[RendererEngine, RecordingRenderer]:
    renderer = RecordingRenderer()
    return RendererEngine(cast(Any, renderer), sample_distance=0.5), renderer


def test_a_live_image_is_one_coarse_call_and_a_final_one_comes_in_bands() -> None:
    engine, renderer = make_engine()
    wide = Raster(600, 500)
    request = replace(make_request(1), quality=Quality(500, 4.0, live=True, raster=wide))
    engine.image(request)
    assert renderer.calls == [(wide, 2.0)]
    image = engine.image(replace(request, quality=Quality(500, raster=wide)))
    bands = renderer.calls[1:]
    assert len(bands) > 2 and {distance for _, distance in bands} == {0.5}
    np.testing.assert_allclose(image[:, 0, 0], np.arange(500) / 1000, atol=1e-6)


def test_a_final_image_is_given_up_when_nobody_wants_it() -> None:
    engine, renderer = make_engine()
    answers = iter([True, False])
    with pytest.raises(SupersededError):
        engine.image(replace(make_request(1), quality=Quality(1000)), lambda: next(answers))
    assert len(renderer.calls) == 1


def test_path_traced_light_says_its_samples_and_is_given_up_when_nobody_wants_it() -> None:
    renderer = RefiningRenderer(PathTracer(make_volume(), threads=1), None)
    engine = PathTracingEngine(renderer, sample_distance=0.5)
    request = replace(make_request(1), quality=Quality(32, samples=1))
    first = engine.image(request)
    assert engine.description == "path tracer, 1 sample" and engine.image_error == math.inf
    many = engine.image(replace(request, quality=Quality(32, samples=16)))
    assert engine.description == "path tracer, 16 samples"
    truth = PathTracer(make_volume(), threads=1, samples=1024, seed=1).render(request.inputs, 32)
    found = float(np.sqrt(np.mean((many - truth)[..., :3] ** 2)))
    assert engine.image_error is not None and found / 1.5 < engine.image_error < 1.5 * found
    np.testing.assert_array_equal(many[..., 3], first[..., 3])
    asked = count()
    with pytest.raises(SupersededError):
        engine.image(
            replace(request, quality=Quality(64, samples=1 << 20)), Watch(lambda: next(asked) < 20)
        )
    engine.close()


def test_a_path_traced_picture_goes_on_where_it_ended() -> None:
    traced: list[int] = []

    class Counting(PathTracer):
        def _run(self, task: Any, raster: Any, wanted: Any, together: int = 1) -> bool:
            traced.append(together)
            return super()._run(task, raster, wanted, together)

    engine = PathTracingEngine(RefiningRenderer(Counting(make_volume(), threads=1), None), 0.5)
    request = replace(make_request(1), quality=Quality(16, samples=2))
    for samples in (2, 4, 8):
        image = engine.image(replace(request, quality=Quality(16, samples=samples)))
    # What the ray caster sees, and eight samples.
    assert sum(traced) == 9
    whole = PathTracer(make_volume(), threads=1, samples=8).render(request.inputs, 16)
    np.testing.assert_allclose(image, whole, atol=1e-6)
    # Another view is another picture.
    engine.image(replace(request, inputs=replace(request.inputs, view=View(azimuth=80.0))))
    assert sum(traced) == 12
    measured = ImageRequest(request.inputs, Quality(16), is_measured=True)
    # What is measured is drawn anew, though it is there.
    engine.image(measured)
    engine.image(measured)
    assert sum(traced) == 16
    engine.close()


def test_small_path_traced_pictures_have_few_samples() -> None:
    """Six of 200 x 200 pixels with 64 samples of each held the image up for half a minute."""
    renderer = RefiningRenderer(PathTracer(make_volume(), threads=1), None)
    assert renderer.samples == 64 and not renderer.cleans
    engine = PathTracingEngine(renderer, sample_distance=0.5)
    inputs = make_request(1).inputs
    other = replace(inputs, view=View(azimuth=80.0))
    request = BatchRequest(inputs, Quality(24), (other,))
    for image, seen in zip(engine.images(request), (inputs, other), strict=True):
        tracer = PathTracer(make_volume(), threads=1, samples=16)
        np.testing.assert_allclose(image, tracer.render(seen, 24), atol=1e-6)
    asked = count()
    with pytest.raises(SupersededError):
        engine.images(request, Watch(lambda: next(asked) < 4))
    engine.close()


def test_path_traced_tiles_make_up_the_picture_that_is_traced_as_a_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(path_tracing, "TILE", 40)
    monkeypatch.setattr(path_tracing, "MARGIN", 5)
    renderer = RefiningRenderer(PathTracer(make_volume(), threads=1), None, samples=2)
    engine = PathTracingEngine(renderer, sample_distance=0.5)
    whole, inputs = Raster(90, 50), make_request(1).inputs
    for samples in (1, 4):
        quality = Quality(50, raster=whole, samples=samples)
        noted: list[float] = []
        picture = engine.picture(PictureRequest(inputs, quality), Watch(noted=noted.append))
        # How far it has got is told all the way, and in the end it is all there.
        assert noted == sorted(noted) and noted[-1] == pytest.approx(1.0)
        assert len(noted) >= 30 and max(np.diff(noted)) < 0.1
        # Without a number, as many as the renderer has.
        *_, right = renderer.refined(inputs, whole, max(samples, 2))
        np.testing.assert_allclose(picture / 255, right.rgba, atol=0.6 / 255)
        # Of each tile by its pixels; margins count for little.
        assert engine.image_error is not None
        assert right.error / 1.2 < engine.image_error < 1.2 * right.error
    asked = count()
    with pytest.raises(SupersededError):
        engine.picture(PictureRequest(inputs, quality), Watch(lambda: next(asked) < 3))
    engine.close()


def test_a_picture_to_save_is_put_together_from_tiles() -> None:
    engine, renderer = make_engine()
    size = Quality(900, raster=Raster(1500, 900))
    noted: list[float] = []
    picture = engine.picture(
        PictureRequest(make_request(1).inputs, size), Watch(noted=noted.append)
    )
    assert noted == [0.0, 0.5]
    assert picture.shape == (900, 1500, 4) and picture.dtype == np.uint8
    assert len(renderer.calls) == 2
    columns = np.clip(np.arange(1500) / 1000 * 255, 0, 400)
    np.testing.assert_array_equal(picture[0, :900, 1], np.rint(columns[:900]))


def test_small_pictures_are_traced_where_that_is_wanted_and_there_is_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    volume, light = make_volume(), LightDirection()
    built: list[FakeEngine] = []

    def tracing() -> Any:
        built.append(FakeEngine())
        return built[-1]

    engine = StandInEngine.of(volume, light, 0.5, tracing)
    inputs = replace(make_request(1).inputs, light=light)
    soft = RaycastRenderer(volume, "soft", light)
    request = BatchRequest(inputs, Quality(24), (inputs,))
    np.testing.assert_array_equal(engine.images(request)[1], soft.render(inputs, 24))
    assert not built
    # The fake's second image is grey.
    wanted = replace(request, traced=True)
    np.testing.assert_allclose(engine.images(wanted)[1], 0.1)
    assert len(built) == 1 and engine.images(wanted).shape == (2, 24, 24, 4)
    # As many pixels as would take too long are drawn in soft light again.
    monkeypatch.setattr(stand_in, "TRACED_SECONDS", 0.0)
    np.testing.assert_array_equal(engine.images(wanted)[1], soft.render(inputs, 24))
    engine.close()
    soft.close()
    assert built[0].closed


def test_under_path_traced_light_pictures_and_fields_are_soft_and_curves_unlit() -> None:
    volume, light = make_volume(), LightDirection()
    engine = StandInEngine.of(volume, light, 0.5)
    soft, unlit = RaycastRenderer(volume, "soft", light), RaycastRenderer(volume)
    inputs = replace(make_request(1).inputs, light=light)
    drawn = engine.image(ImageRequest(inputs, Quality(24)))
    np.testing.assert_array_equal(drawn, soft.render(inputs, 24))
    region = RegionSensitivityRequest(inputs, Quality(24), Outline(), 8.0)
    found = engine.region_sensitivity(region)
    right = region_responses(unlit, inputs, 24, Outline(), 8.0)
    np.testing.assert_allclose(found, right, rtol=1e-4, atol=1e-6)
    field = ValueSensitivityRequest(inputs, Quality(24), (150.0, 150.0), 8.0)
    edit = edit_around(150.0, soft.scalar_range, 8.0)
    np.testing.assert_allclose(
        engine.value_sensitivity(field), soft.change(inputs, 24, edit), rtol=1e-4, atol=1e-6
    )
    for each in (engine, soft, unlit):
        each.close()
