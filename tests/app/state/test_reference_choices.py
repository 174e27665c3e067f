import numpy as np
import pytest
from ramp import make_tf

from app.engines.messages import Result
from app.engines.requests import Image, ImageRequest, Quality
from app.state.reference_choices import ReferenceChoices, SlowLights
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.view import View

WHOLE = Raster(800, 600)


def image(seconds, by_raycast=True, scale=1.0):
    inputs = SceneInputs.of(View(), make_tf())
    request = ImageRequest(inputs, Quality(WHOLE.shorter, raster=WHOLE))
    drawn = np.zeros((*WHOLE.scaled(scale).shape, 4), np.float32)
    return Result(request, Image(drawn, seconds, by_raycast=by_raycast))


def test_soft_light_is_given_up_by_its_second_image_of_more_than_its_time():
    lights = SlowLights()
    assert lights.judge("soft", image(9.0), WHOLE, is_busy=True) == 0
    # With the first one, what draws it was loaded. A quarter of the width is what moves.
    assert lights.judge("soft", image(9.0, scale=0.25), WHOLE) == 0
    assert lights.judge("soft", image(3.2), WHOLE) == pytest.approx(0.2, rel=0.02)
    assert lights.found == {"soft"}
    # The next light has its own limit, and is judged once.
    assert lights.judge("direct", image(1.6), WHOLE) == 0
    assert lights.found == {"soft"}


@pytest.mark.parametrize("fast", [image(0.09, scale=0.18), image(1.4)])
def test_soft_light_stays_once_it_was_fast(fast):
    lights = SlowLights()
    assert lights.judge("soft", fast, WHOLE) == 0
    assert lights.judge("soft", image(99.0), WHOLE) == 0
    assert lights.judge("soft", image(99.0), WHOLE) == 0
    assert not lights.found


def test_direct_light_goes_out_by_the_ray_casters_second_image():
    lights = SlowLights()
    # VTK's says nothing of it.
    assert lights.judge("direct", image(99.0, by_raycast=False), WHOLE) == 0
    # As many pixels as the first image has, however wide the pane.
    assert lights.judge("direct", image(9.0), WHOLE) == 0
    lights = SlowLights()
    assert lights.judge("direct", image(12.0), WHOLE) == 0
    assert lights.judge("direct", image(12.0), WHOLE) > 3
    assert lights.found == {"direct"}


def test_automatic_light_is_the_best_that_is_not_slow():
    automatic = ReferenceChoices()
    assert automatic.settings(None).lighting == "soft"
    assert automatic.settings(None, frozenset({"soft"})).lighting == "direct"
    assert automatic.settings(None, frozenset({"soft", "direct"})).lighting == "none"
    assert ReferenceChoices(drawing="vtk").settings(None).lighting == "direct"
    # Who has chosen a light has it, however slow.
    assert ReferenceChoices("soft").settings(None, frozenset({"soft"})).lighting == "soft"
