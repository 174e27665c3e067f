import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from window_fakes import make_request

from app.engines.exactness import distance
from app.engines.messages import Result
from app.engines.requests import Image, Quality
from app.state.image_errors import ImageErrors
from model.rendering.raster import Raster
from model.scene.view import View

WHOLE = Raster(64, 48)
INPUTS = make_request(1).inputs


def gray(level, raster=WHOLE):
    return np.full((*raster.shape, 4), level, np.float32)


def result(level, quality=None, error=None, inputs=INPUTS, **changes):
    quality = quality or Quality(48, raster=WHOLE)
    image = replace(Image(gray(level, quality.pixels), 0.1, error=error), **changes)
    return Result(replace(make_request(1), quality=quality, inputs=inputs), image)


LIVE = Quality(48, live=True, raster=WHOLE)


COARSE = gray(0.4, Raster(32, 24))


def moving(level, error=None):
    """An image while something moves: a coarse one, or one of all pixels with an error."""
    return result(level, LIVE, error) if error else result(level, LIVE, rgba=COARSE)


def said(errors, moves=False, settled=False):
    return errors.fidelity(INPUTS, moves, settled, WHOLE).text


def test_two_images_are_compared_as_a_screen_shows_them():
    rng = np.random.default_rng(0)
    coarse = rng.random((31, 40, 4)).astype(np.float32)
    fine = rng.random((90, 128, 4)).astype(np.float32)
    shown = torch.nn.functional.interpolate(
        torch.from_numpy(coarse).permute(2, 0, 1)[None], (90, 128), mode="bilinear"
    )[0].permute(1, 2, 0)
    expected = np.sqrt(np.mean((shown.numpy() - fine)[..., :3].astype(float) ** 2))
    assert distance(coarse, fine) == pytest.approx(expected, rel=1e-5)
    # Of many pixels, some stand for all.
    large = np.repeat(np.repeat(fine, 8, 0), 8, 1)
    other = np.repeat(np.repeat(rng.random((90, 128, 4)).astype(np.float32), 8, 0), 8, 1)
    expected = np.sqrt(np.mean((large - other)[..., :3].astype(float) ** 2))
    assert distance(other, large) == pytest.approx(expected, rel=0.03)


def test_what_is_not_exact_is_said_in_words_where_its_error_is_not_known():
    errors = ImageErrors()
    errors.note(moving(0.4), WHOLE)
    assert said(errors, moves=True) == "coarser while moving" and said(errors) == "refining"
    # What no eye sees is not said.
    errors.note(moving(0.5, 0.0029), WHOLE)
    assert said(errors, moves=True) == ""
    errors.note(moving(0.5, 0.02), WHOLE)
    assert said(errors, moves=True) == "error .02"


def test_a_path_traced_image_has_its_estimated_error():
    errors = ImageErrors()
    quality = Quality(48, raster=WHOLE)
    errors.note(result(0.5, quality, float("inf")), WHOLE)
    assert said(errors) == "refining"
    errors.note(result(0.5, quality, 0.0123, samples=4), WHOLE)
    found = errors.fidelity(INPUTS, False, False, WHOLE)
    assert found.text == "error .012, refining"
    errors.note(result(0.5, quality, 0.0062, samples=64), WHOLE)
    found = errors.fidelity(INPUTS, False, True, WHOLE)
    assert found.text == "error .0062"
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
    # Kernels are compiled before the first one.
    errors.note(result(0.4, LIVE, seconds=30.0, rgba=COARSE), WHOLE)
    assert errors.moving is None
    errors.note(moving(0.4), WHOLE)
    assert errors.moving == (0.1, None)
    # Neither an image of another view measures it, nor a preview, nor one that lacks pixels.
    turned = replace(INPUTS, view=View(80.0))
    errors.note(result(0.0, inputs=turned), WHOLE)
    errors.note(result(0.0, is_preview=True), WHOLE)
    errors.note(result(0.0, rgba=COARSE), WHOLE)
    # Nor one of a wider pane, which shows more beside it.
    errors.note(result(0.0, Quality(48, raster=Raster(96, 48))), WHOLE)
    assert errors.moving == (0.1, None)
    errors.note(result(0.5), WHOLE)
    assert errors.moving == (0.1, pytest.approx(0.1))
    errors.forget()
    assert errors.moving is None
