import json
from dataclasses import replace

import pytest

from model.errors import TfscopeError
from model.scene.light import LightDirection
from model.scene.scene import Scene, default_scalar_window


@pytest.mark.parametrize("lighting", ["none", "direct", "soft", "path"])
def test_a_scene_survives_json(volume, lighting):
    scene = Scene.of(volume, 128, lighting)
    assert Scene.from_json(json.loads(json.dumps(scene.to_json()))) == scene
    assert (scene.light is None) == (lighting == "none")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lighting": "shadows"}, "unknown; choose none, direct, soft or path"),
        ({"light": LightDirection()}, "unlit"),
        ({"lighting": "direct"}, "light direction"),
        ({"scalar_range": (1.0, 1.0)}, "not increasing"),
        ({"scalar_window": (-5.0, 10.0)}, "scalar window"),
        ({"scalar_window": (10.0, 5.0)}, "scalar window"),
        ({"image_size": 8}, "16 to 4096"),
        ({"sample_distance": 0.0}, "0.01 to 10"),
    ],
)
def test_impossible_scenes_are_refused(scene, change, message):
    with pytest.raises(TfscopeError, match=message):
        replace(scene, **change)


@pytest.mark.parametrize("data", [None, [], {"volume_name": "x"}, "scene"])
def test_foreign_data_is_no_scene(data):
    with pytest.raises(TfscopeError, match="malformed"):
        Scene.from_json(data)


def test_the_default_window_lies_inside_the_range(volume):
    lo, hi = default_scalar_window(volume)
    assert 0 < lo < hi < 255
