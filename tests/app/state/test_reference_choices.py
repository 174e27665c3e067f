import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ramp import make_tf
from window_fakes import make_request

from app.engines.exactness import STOPS, USUAL, distance
from app.engines.messages import Result
from app.engines.requests import Image, ImageRequest, Quality
from app.state.image_errors import ImageErrors
from app.state.opened_volume import OpenedVolume
from app.state.reference_choices import ReferenceChoices, quiet_seconds, slow_lights
from model.rendering.raster import Raster, resized
from model.scene.inputs import SceneInputs
from model.scene.ranges import robust_range
from model.scene.view import View
from model.scene.volume import Volume


def image(side, by_raycast=True, quiet=1.6, live=False):
    quality = Quality(side, live, raster=Raster(side, side))
    request = ImageRequest(SceneInputs.of(View(), make_tf()), quality)
    drawn = np.zeros((side, side, 4), np.float32)
    return Result(request, Image(drawn, 99.0, by_raycast=by_raycast, quiet_seconds=quiet))


@pytest.mark.parametrize(
    ("lighting", "drawn", "seconds"),
    [
        # A light counts by the pixels of what moves, or of a first image, however wide the pane.
        ("soft", image(1024, live=True), 0.1),
        ("soft", image(128, live=True), 1.6),
        ("direct", image(768), 0.4),
        # No finished picture loses its soft light.
        ("soft", image(128), None),
        # VTK's says nothing of it.
        ("direct", image(768, by_raycast=False), None),
        ("none", image(768), None),
        ("soft", image(768, quiet=None, live=True), None),
    ],
)
def test_a_light_is_judged_by_the_time_on_free_cores(lighting, drawn, seconds):
    assert quiet_seconds(lighting, drawn) == pytest.approx(seconds)


def test_automatic_light_is_the_best_that_is_not_slow():
    assert slow_lights({}) == slow_lights({"soft": 0.09, "direct": 2.9}) == frozenset()
    assert slow_lights({"soft": 0.2, "direct": 2.9}) == {"soft"}
    assert slow_lights({"soft": 0.2, "direct": 3.1}) == {"soft", "direct"}
    automatic = ReferenceChoices()
    assert automatic.settings(None).lighting == "soft"
    assert automatic.settings(None, frozenset({"soft"})).lighting == "direct"
    assert automatic.settings(None, frozenset({"soft", "direct"})).lighting == "none"
    assert ReferenceChoices(drawing="vtk").settings(None).lighting == "direct"
    # Who has chosen a light has it, however slow.
    assert ReferenceChoices(lighting="soft").settings(None, frozenset({"soft"})).lighting == "soft"


PLACE = Path("volume.nrrd")


def test_an_outlier_does_not_widen_what_is_looked_at_first():
    voxels = np.linspace(2, 7, 8000).reshape(20, 20, 20)
    voxels[3, 3, 3] = 1e9
    volume = Volume(voxels)
    opened = OpenedVolume.of(PLACE, volume.over(robust_range(volume)))
    assert opened.volume.scalar_range == opened.default.scalar_range == (2.0, 7.0)
    assert 2 <= opened.window[0] < opened.window[1] <= 7
    # The outlier is counted, too, and does not make the other bins coarser.
    assert (opened.edges[0], opened.edges[-1]) == (2.0, 1e9)
    assert opened.counts.sum() == voxels.size and opened.counts[-1] == 1
    assert np.diff(opened.edges).min() < 5 / 250


WHOLE = Raster(64, 48)
INPUTS = make_request(1).inputs


def gray(level, raster=WHOLE):
    return np.full((*raster.shape, 4), level, np.float32)


def result(level, quality=None, error=None, inputs=INPUTS, **changes):
    quality = quality or Quality(48, raster=WHOLE)
    image = replace(Image(gray(level, quality.pixels), 0.1, error=error), **changes)
    return Result(replace(make_request(1), quality=quality, inputs=inputs), image)


LIVE, COARSE = Quality(48, live=True, raster=WHOLE), gray(0.4, Raster(32, 24))


def moving(level, error=None):
    """An image while something moves: a coarse one, or one of all pixels with an error."""
    return result(level, LIVE, error) if error else result(level, LIVE, rgba=COARSE)


def said(errors, moves=False, settled=False):
    return errors.fidelity(INPUTS, moves, settled, WHOLE).text


def test_two_images_are_compared_as_a_screen_shows_them():
    rng = np.random.default_rng(0)
    coarse = rng.random((31, 40, 4)).astype(np.float32)
    fine = rng.random((90, 128, 4)).astype(np.float32)
    shown = resized(coarse, (90, 128))
    expected = np.sqrt(np.mean((shown - fine)[..., :3].astype(float) ** 2))
    assert distance(coarse, fine) == pytest.approx(expected, rel=1e-5)


def test_what_is_not_exact_is_said_in_words_where_its_error_is_not_known():
    errors = ImageErrors()
    errors.note(moving(0.4), WHOLE)
    assert said(errors, moves=True) == "coarser while moving" and said(errors) == "refining"
    # What no eye sees is not said.
    errors.note(moving(0.5, 0.0029), WHOLE)
    assert said(errors, moves=True) == ""
    errors.note(moving(0.5, 0.02), WHOLE)
    assert said(errors, moves=True) == "estimated error .02"


def test_a_path_traced_image_has_its_estimated_error():
    errors = ImageErrors()
    quality = Quality(48, raster=WHOLE)
    errors.note(result(0.5, quality, float("inf")), WHOLE)
    assert said(errors) == "refining"
    errors.note(result(0.5, quality, 0.0123, samples=4), WHOLE)
    found = errors.fidelity(INPUTS, False, False, WHOLE)
    assert found.text == "estimated error .012, refining"
    errors.note(result(0.5, quality, 0.0062, samples=64), WHOLE)
    found = errors.fidelity(INPUTS, False, True, WHOLE)
    assert found.text == "estimated error .0062"
    assert "64 samples" in found.reasons[0] and "--samples" in found.reasons[0]
    errors.note(result(0.5, quality, 0.0029, samples=64), WHOLE)
    assert said(errors, settled=True) == ""
    # Few samples have no estimate.
    errors.note(result(0.5, error=math.inf, samples=2), WHOLE, False)
    assert said(errors, settled=True) == "few samples"
    errors.note(result(0.5, error=math.inf, samples=1), WHOLE, False)
    assert "at 1 sample per" in errors.fidelity(INPUTS, False, True, WHOLE).reasons[0]


def test_time_and_error_of_the_last_moving_image_are_measured():
    errors = ImageErrors()
    # The first one of an image at rest is none of them.
    errors.note(moving(0.4), WHOLE)
    assert errors.moving(STOPS[USUAL]) is None
    errors.note(moving(0.4), WHOLE, True)
    assert errors.moving(STOPS[USUAL]) == (0.1, None)
    # Neither an image of another view measures it, nor a preview, nor one that lacks pixels.
    turned = replace(INPUTS, view=View(80.0))
    errors.note(result(0.0, inputs=turned), WHOLE)
    errors.note(result(0.0, is_preview=True), WHOLE)
    errors.note(result(0.0, rgba=COARSE), WHOLE)
    # Nor one of a wider pane, which shows more beside it.
    errors.note(result(0.0, Quality(48, raster=Raster(96, 48))), WHOLE)
    assert errors.moving(STOPS[USUAL]) == (0.1, None)
    errors.note(result(0.5), WHOLE)
    assert errors.moving(STOPS[USUAL]) == (0.1, pytest.approx(0.1))
    # They are no other stop's.
    assert errors.moving(STOPS["fast"]) is None
    errors.forget()
    assert errors.moving(STOPS[USUAL]) is None
