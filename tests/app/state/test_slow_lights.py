"""Lights that take too long are given up, by times that are made up."""

from __future__ import annotations

import numpy as np
import pytest
from ramp import make_tf

from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import ImageRequest
from app.state.reference_choices import ReferenceChoices
from app.state.slow_lights import SlowLights
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.view import View

WHOLE = Raster(800, 600)


def image(
    seconds: float,
    stands_in: bool = False,
    scale: float = 1.0,
    coarseness: float = 1.0,
) -> Result:
    raster = WHOLE.scaled(scale)
    inputs = SceneInputs.of(View(), make_tf())
    quality = Quality(raster.shorter, coarseness, raster=raster)
    request = ImageRequest(inputs, quality, stands_in=stands_in)
    return Result(request, np.zeros((1, 1, 4), np.float32), None, seconds)


@pytest.mark.parametrize("stands_in", [False, True])
def test_shadows_are_given_up_by_an_image_at_rest_of_more_than_their_time(
    stands_in: bool,
) -> None:
    lights = SlowLights()
    assert lights.judge("shadows", image(1.6, stands_in), WHOLE) == pytest.approx(1.6)
    assert lights.found == {"shadows"}
    # The next light has its own limit, and is judged once.
    assert lights.judge("direct", image(1.6, stands_in), WHOLE) == 0
    assert lights.found == {"shadows"}


def test_shadows_stay_once_they_were_fast() -> None:
    lights = SlowLights()
    assert lights.judge("shadows", image(1.4), WHOLE) == 0
    assert lights.judge("shadows", image(9.0), WHOLE) == 0
    assert not lights.found


def test_a_coarse_image_is_believed_only_where_it_is_far_too_slow() -> None:
    lights = SlowLights()
    # A sixteenth of the pixels foretells 2.4 s, of which preparations are a part.
    assert lights.judge("shadows", image(0.15, scale=0.25), WHOLE) == 0
    assert lights.judge("shadows", image(1.2), WHOLE) == 0
    lights = SlowLights()
    assert lights.judge("shadows", image(0.3, scale=0.25), WHOLE) == pytest.approx(4.8)
    assert lights.found == {"shadows"}


def test_an_image_of_fewer_samples_tells_nothing() -> None:
    lights = SlowLights()
    assert lights.judge("shadows", image(5.0, coarseness=4.0), WHOLE) == 0
    assert not lights.found


def test_direct_light_goes_out_by_the_ray_casters_first_image() -> None:
    lights = SlowLights()
    # As many pixels as the first image has, however wide the pane.
    assert lights.judge("direct", image(9.0, stands_in=True), WHOLE) == 0
    lights = SlowLights()
    assert lights.judge("direct", image(12.0, stands_in=True), WHOLE) > 3
    assert lights.found == {"direct"}


def test_automatic_light_is_the_best_that_is_not_slow() -> None:
    automatic = ReferenceChoices()
    assert automatic.settings(None).lighting == "shadows"
    assert automatic.settings(None, frozenset({"shadows"})).lighting == "direct"
    assert automatic.settings(None, frozenset({"shadows", "direct"})).lighting == "none"
    assert ReferenceChoices(shadows_first=False).settings(None).lighting == "direct"
    assert ReferenceChoices(drawing="vtk").settings(None).lighting == "direct"
    # Who has chosen a light has it, however slow.
    assert ReferenceChoices("shadows").settings(None, frozenset({"shadows"})).lighting == "shadows"
