from __future__ import annotations

from dataclasses import replace

import pytest
from ramp import make_tf, make_volume

from model.scene.inputs import SceneInputs, outside_range
from model.scene.scene import Scene
from model.scene.transfer_function import OpacityTF
from model.scene.view import View

SCENE = Scene.of(make_volume(), image_size=16, scalar_window=(120.0, 180.0))


def outside(view: View, opacity: OpacityTF) -> str:
    return outside_range(SceneInputs(view, opacity, make_tf().color), SCENE)


def test_inside_there_is_nothing_to_say() -> None:
    view = View(azimuth=300.0, elevation=80.0, roll=-10.0, distance=0.4)
    assert outside(view, make_tf(120.0, 180.0).opacity) == ""


@pytest.mark.parametrize(
    ("view", "said"),
    [
        (View(elevation=-85.0), "elevation -85°"),
        (View(roll=11.0), "roll 11°"),
        (View(distance=0.3), "distance 0.30"),
        (View(distance=1.2), "distance 1.20"),
    ],
)
def test_a_view_outside_is_named(view: View, said: str) -> None:
    text = outside(view, make_tf().opacity)
    assert said in text
    assert text.count(",") == 0


def test_modes_outside_are_counted() -> None:
    opacity = make_tf(110.0, 190.0, 150.0).opacity
    assert "2 modes" in outside(View(), opacity)


def test_a_free_curve_is_named() -> None:
    opacity = OpacityTF((100.0, 200.0), points=((100.0, 0.0), (200.0, 1.0)))
    assert "free opacity curve" in outside(View(), opacity)


def test_several_things_make_one_line() -> None:
    view = replace(View(), elevation=90.0, roll=20.0)
    text = outside(view, make_tf(100.0).opacity)
    assert "\n" not in text
    assert all(part in text for part in ("elevation", "roll", "a mode"))
