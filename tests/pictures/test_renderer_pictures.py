"""Every scene, drawn by every renderer, against one stored picture.

The ray caster draws the stored pictures.
"""

from typing import get_args

import compare
import pytest
from compare import Tolerance
from scenes import SCENES, volume_of

from model.rendering.renderer import open_renderer
from model.scene.scene import Lighting

ROUNDING = Tolerance(0.0013, 0.005)
"""Of stored pictures, to 1/255, and of floating-point numbers."""

TOLERANCES = {
    "raycast": dict.fromkeys(get_args(Lighting), ROUNDING),
    # Its own pictures have 8 bits, and OpenGL interpolates with weights of 8 bits.
    "vtk": {"none": Tolerance(0.003, 0.012), "direct": Tolerance(0.004, 0.04)},
}
"""Largest differences of each renderer from a stored picture, under each light that it has."""

CASES = [
    # Of bytes alone where time is short: other types of voxels are kernels of their own.
    pytest.param(name, kind, marks=() if name.startswith("bytes") else pytest.mark.slow)
    for name in SCENES
    for kind in TOLERANCES
    if SCENES[name].lighting in TOLERANCES[kind]
]


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_a_renderer_draws_what_is_stored(name, kind, regenerates):
    scene = SCENES[name]
    volume = volume_of(scene.volume)
    renderer = open_renderer(kind, volume, scene.lighting, sample_distance=scene.step)
    drawn = compare.side_by_side(renderer.render(scene.inputs, scene.raster))
    renderer.close()
    if regenerates and kind == "raycast":
        compare.store(name, drawn)
    compare.check(name, drawn, TOLERANCES[kind][scene.lighting], kind)


def test_no_stored_picture_is_left_over():
    assert {path.stem for path in compare.STORED.glob("*.png")} == set(SCENES)
