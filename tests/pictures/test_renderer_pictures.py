"""Every scene, drawn by every renderer, against one stored picture.

The ray caster draws the stored pictures. Colour stands at the left of one, opacity at its right, so
that both can be looked at.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import imageio.v3 as iio
import numpy as np
import pytest
from scenes import SCENES, volume_of

from model.rendering.renderer import open_renderer
from model.scene.scene import Lighting

STORED = Path(__file__).parent / "stored"
FAILED = Path(__file__).parents[2] / "build" / "pictures"

STRAYS = 0.001
"""Share of a picture's numbers that may differ by more: another rounding moves a sample over a
step of the TF, or a ray past an edge."""


@dataclass(frozen=True)
class Tolerance:
    """Largest differences of a picture: root mean square, and of all numbers but STRAYS."""

    rmse: float
    most: float


def side_by_side(image):
    """Colour beside opacity, of an image (rows, columns, 4) in [0, 1]."""
    opacity = np.repeat(image[..., 3:], 3, axis=-1)
    return np.rint(255 * np.concatenate([image[..., :3], opacity], axis=1)).astype(np.uint8)


def check(name, drawn, tolerance, label):
    """Compare a picture with the stored one; fail with both, and their difference, in a folder.

    The label, for the folder, says who drew it.
    """
    expected = np.asarray(iio.imread(STORED / f"{name}.png"))
    assert drawn.shape == expected.shape, f"{name}: {drawn.shape} instead of {expected.shape}"
    difference = abs(drawn.astype(np.float64) - expected) / 255
    rmse = float(np.sqrt(np.mean(difference**2)))
    most = float(np.quantile(difference, 1 - STRAYS, method="higher"))
    if rmse <= tolerance.rmse and most <= tolerance.most:
        return
    folder = FAILED / f"{name}-{label}"
    folder.mkdir(parents=True, exist_ok=True)
    # A difference of the tolerance is half as bright as can be.
    shown = np.clip(difference / tolerance.most / 2, 0, 1)
    pictures = {"stored": expected, "drawn": drawn, "difference": np.rint(255 * shown)}
    for kind, picture in pictures.items():
        iio.imwrite(folder / f"{kind}.png", picture.astype(np.uint8))
    raise AssertionError(
        f"{name} {label} differs from the stored picture by an RMSE of {rmse:.4f} (at most "
        f"{tolerance.rmse:g}), and by {most:.3f} (at most {tolerance.most:g}) in all but "
        f"{100 * STRAYS:g} % of its numbers; see the pictures in {folder}."
    )


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
    drawn = side_by_side(renderer.render(scene.inputs, scene.raster))
    renderer.close()
    if regenerates and kind == "raycast":
        iio.imwrite(STORED / f"{name}.png", drawn, optimize=True)
    check(name, drawn, TOLERANCES[kind][scene.lighting], kind)


def test_no_stored_picture_is_left_over():
    assert {path.stem for path in STORED.glob("*.png")} == set(SCENES)
