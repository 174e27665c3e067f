import numpy as np
import pytest
from ramp import make_tf

from app.engines.messages import Result
from app.engines.requests import Image, ImageRequest, Quality
from app.state.reference_choices import ReferenceChoices, quiet_seconds, slow_lights
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.view import View


def image(side, by_raycast=True, quiet=1.6):
    whole = Raster(side, side)
    request = ImageRequest(SceneInputs.of(View(), make_tf()), Quality(side, raster=whole))
    drawn = np.zeros((side, side, 4), np.float32)
    return Result(request, Image(drawn, 99.0, by_raycast=by_raycast, quiet_seconds=quiet))


@pytest.mark.parametrize(
    ("lighting", "drawn", "seconds"),
    [
        # A light counts by the pixels of what moves, or of a first image, however wide the pane.
        ("soft", image(1024), 0.1),
        ("soft", image(128), 1.6),
        ("direct", image(768), 0.4),
        # VTK's says nothing of it.
        ("direct", image(768, by_raycast=False), None),
        ("none", image(768), None),
        ("soft", image(768, quiet=None), None),
    ],
)
def test_a_light_is_judged_by_the_time_on_free_cores(lighting, drawn, seconds):
    assert quiet_seconds(lighting, drawn) == pytest.approx(seconds)


def test_lights_of_more_than_their_time_are_slow():
    assert slow_lights({}) == frozenset()
    assert slow_lights({"soft": 0.09, "direct": 2.9}) == frozenset()
    assert slow_lights({"soft": 0.2, "direct": 2.9}) == {"soft"}
    assert slow_lights({"soft": 0.2, "direct": 3.1}) == {"soft", "direct"}


def test_automatic_light_is_the_best_that_is_not_slow():
    automatic = ReferenceChoices()
    assert automatic.settings(None).lighting == "soft"
    assert automatic.settings(None, frozenset({"soft"})).lighting == "direct"
    assert automatic.settings(None, frozenset({"soft", "direct"})).lighting == "none"
    assert ReferenceChoices(drawing="vtk").settings(None).lighting == "direct"
    # Who has chosen a light has it, however slow.
    assert ReferenceChoices(lighting="soft").settings(None, frozenset({"soft"})).lighting == "soft"
