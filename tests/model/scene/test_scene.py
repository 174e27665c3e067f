import json
from dataclasses import replace

import pytest
from ramp import make_volume

from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.orientation import standard_view, view_in
from model.scene.ranges import RangeChoice
from model.scene.region import Region
from model.scene.scene import LightDirection, Scene
from model.scene.view import View, ViewRange

GOOD = {
    "0,0.5,0.25,1,0.1,0.9": CropBox((0.0, 0.25, 0.1), (0.5, 1.0, 0.9)),
    # 0.105 - 0.1 is a little less than 0.005.
    "0.1,0.105,0,1,0,1": CropBox((0.1, 0.0, 0.0), (0.105, 1.0, 1.0)),
    "-100,1500.5": RangeChoice(-100, 1500.5),
    "1%, 99.5%": RangeChoice(1, 99.5, are_percentiles=True),
    "30,-20,5,0.8": View(30.0, -20.0, 5.0, 0.8),
    "30": View(30.0),
    "30, -20,5,0.8 ,orthographic": View(30.0, -20.0, 5.0, 0.8, is_orthographic=True),
    "100,80, 140,120": Region(100, 80, 140, 120),
    "30, -10": LightDirection(30.0, -10.0),
}
BAD = [
    (CropBox, "crop box",
     ["", "0,1", "0,1,0,1,0,x", "0,1,0,1,0,1.5", "0.5,0.5,0,1,0,1", "0.6,0.2,0,1,0,1"]),
    (RangeChoice, "range|percentiles",
     ["", "1", "1,2,3", "a,b", "5,1", "nan,1", "1%,2", "-1%,50%", "1%,101%", "0,inf"]),
    (View, "is not a view", ["north", "1,2,3,4,5,6,7", "", "orthographic", "1,flat"]),
    (View, "from -90 to 90", ["0,91,0,1"]),
    (View, "above 0", ["0,0,0,0"]),
    (View, "finite", ["nan,0,0,1"]),
    (Region, "is not a region; give left,top,right,bottom",
     ["", "1,2,3", "1,2,3,4,5", "1,2,3,x", "1.5,2,3,4"]),
    (LightDirection, "degrees", ["", "1", "1,2,3", "a,b", "nan,1"]),
]  # fmt: skip


@pytest.mark.parametrize("text", GOOD)
def test_what_is_typed_is_read(text):
    assert type(GOOD[text]).parse(text) == GOOD[text]


@pytest.mark.parametrize(("kind", "message", "texts"), BAD)
def test_what_cannot_be_read_is_refused(kind, message, texts):
    for text in texts:
        with pytest.raises(TfscopeError, match=message):
            kind.parse(text)


SCENE = Scene.of(make_volume(), 16)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft", "path"])
def test_a_scene_survives_json(lighting):
    for movable in (False, True)[: 1 + (lighting != "none")]:
        scene = Scene.of(make_volume(), 128, lighting, movable_light=movable, up="-y")
        assert Scene.from_json(json.loads(json.dumps(scene.to_json()))) == scene
        assert (scene.light is None) == (lighting == "none")


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: replace(SCENE, lighting="shadows"), "unknown; choose none, direct, soft or path"),
        (lambda: replace(SCENE, light=LightDirection()), "unlit"),
        (lambda: replace(SCENE, lighting="direct"), "light direction"),
        (lambda: replace(SCENE, scalar_range=(1.0, 1.0)), "not increasing"),
        (lambda: replace(SCENE, scalar_window=(-5.0, 10.0)), "scalar window"),
        (lambda: replace(SCENE, scalar_window=(10.0, 5.0)), "scalar window"),
        (lambda: replace(SCENE, image_size=8), "16 to 4096"),
        (lambda: replace(SCENE, sample_distance=0.0), "0.01 to 10"),
        (lambda: Scene.of(make_volume(), 16, movable_light=True), "no light that could be moved"),
        *((lambda data=data: Scene.from_json(data), "malformed")
          for data in (None, [], {"volume_name": "x"}, "scene")),
        (lambda: ViewRange(up="z"), "not an axis"),
        (lambda: view_in("up", 0.0, 0.0), r"'up' is not an axis; give one of \+x"),
        (lambda: standard_view("Inside", View(), "+z"), "'Inside' is not a view"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(build, message):
    with pytest.raises(TfscopeError, match=message):
        build()


def test_a_scene_takes_the_up_axis_and_a_window_from_its_volume():
    lying = replace(make_volume(), up="-y")
    assert Scene.of(lying, 16).view_range.up == "-y"
    assert Scene.of(lying, 16, up="+x").view_range.up == "+x"
    assert SCENE.view_range.up == "+z"
    lo, hi = SCENE.scalar_window
    assert 100 < lo < hi < 200
