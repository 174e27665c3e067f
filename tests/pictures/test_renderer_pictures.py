"""Every scene, drawn by every renderer, against one stored picture.

The ray caster draws the stored pictures.
"""

from __future__ import annotations

from typing import get_args

import compare
import numpy as np
import pytest
from compare import Tolerance
from numpy.typing import NDArray
from scenes import SCENES, PictureScene, volume_of

from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.scene.scene import Lighting
from tests import reference_raycaster

ROUNDING = Tolerance(0.0013, 0.005)
"""Of stored pictures, to 1/255, and of floating-point numbers."""

LIGHTINGS: tuple[Lighting, ...] = get_args(Lighting)

TOLERANCES: dict[str, dict[Lighting, Tolerance]] = {
    "raycast": dict.fromkeys(LIGHTINGS, ROUNDING),
    # Without skipping of empty space and early termination.
    "every-sample": dict.fromkeys(LIGHTINGS, ROUNDING),
    # A second ray caster, of the tests: slow, in float64, by NumPy.
    "float64": {"none": ROUNDING},
    # Its own pictures have 8 bits, and OpenGL interpolates with weights of 8 bits.
    "vtk": {
        "none": Tolerance(0.003, 0.012),
        "direct": Tolerance(0.004, 0.04),
    },
}
"""Largest differences of each renderer from a stored picture, under each light."""

EXCEPTIONS: dict[tuple[str, str], Tolerance] = {
    # The ray caster looks TFs up in a table, in which a step is 1/16 of a bin wide.
    ("hard-steps", "float64"): Tolerance(0.0013, 0.016),
    ("thin-peaks", "float64"): Tolerance(0.0025, 0.012),
}
"""Scenes in which a renderer may be further away."""


def is_drawn(name: str, renderer: str) -> bool:
    """Whether a renderer draws a scene."""
    scene = SCENES[name]
    if scene.lighting not in TOLERANCES[renderer]:
        return False
    if renderer == "float64":
        return scene.crop is None and scene.volume != "missing" and scene.width == scene.height
    return True


CASES = [
    # Of bytes alone where time is short: other types of voxels are kernels of their own.
    pytest.param(name, kind, marks=() if name.startswith("bytes") else pytest.mark.slow)
    for name in SCENES
    for kind in TOLERANCES
    if is_drawn(name, kind)
]


def draw(scene: PictureScene, kind: str) -> NDArray[np.float32]:
    volume, inputs = volume_of(scene.volume), scene.inputs
    if kind == "float64":
        opacity, color = inputs.opacity_tf, inputs.color_tf
        scalar_range = volume.scalar_range
        samples = opacity.sample(scalar_range), color.sample(scalar_range)
        return reference_raycaster.render(volume, scene.view, *samples, scene.width, scene.step)
    renderer = open_renderer(
        "vtk" if kind == "vtk" else "raycast",
        volume,
        scene.lighting,
        sample_distance=scene.step,
    )
    if kind == "every-sample":
        assert isinstance(renderer, RaycastRenderer)
        renderer.skip_empty = renderer.terminate_early = False
    try:
        return renderer.render(inputs, scene.raster)
    finally:
        renderer.close()


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_a_renderer_draws_what_is_stored(name: str, kind: str, regenerates: bool) -> None:
    scene = SCENES[name]
    drawn = compare.side_by_side(draw(scene, kind))
    if regenerates and kind == "raycast":
        compare.store(name, drawn)
    tolerance = EXCEPTIONS.get((name, kind), TOLERANCES[kind][scene.lighting])
    compare.check(name, drawn, tolerance, kind)


def test_no_stored_picture_is_left_over() -> None:
    assert {path.stem for path in compare.STORED.glob("*.png")} == set(SCENES)
