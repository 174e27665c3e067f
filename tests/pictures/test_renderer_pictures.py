"""Every scene, drawn by every renderer, against one stored picture.

The ray caster draws the stored pictures. Colour stands at the left of one, opacity at its right, so
that both can be looked at.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import get_args

import imageio.v3 as iio
import numpy as np
import pytest

from model.rendering.raster import Raster
from model.rendering.renderer import open_renderer
from model.scene.crop import CropBox
from model.scene.filling import fill
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection, Lighting
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

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
    """Compare a picture with the stored one; on failure save both and their difference."""
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


def _grid(x, y, z):
    """Places of the voxels along x, y and z, -1 to 1, each of shape (z, y, x)."""
    places = np.meshgrid(*(np.linspace(-1, 1, n) for n in (z, y, x)), indexing="ij")
    return places[2], places[1], places[0]


def _things(x, y, z):
    """A ball in a shell, a bar through it and a soft blob aside, 0 to 255: no two sides alike."""
    a, b, c = _grid(x, y, z)
    distance = np.sqrt(a**2 + b**2 + c**2)
    shell = 90 * np.exp(-(((distance - 0.75) / 0.09) ** 2))
    ball = 255 / (1 + np.exp(30 * (np.sqrt((a - 0.1) ** 2 + b**2 + (c + 0.1) ** 2) - 0.32)))
    bar = 170 / (1 + np.exp(40 * (np.maximum(abs(b - 0.45), abs(c - 0.4)) - 0.1)))
    blob = 130 * np.exp(-((a + 0.7) ** 2 + (b + 0.6) ** 2 + (c - 0.7) ** 2) / 0.12)
    return np.minimum(np.maximum.reduce([shell, ball, bar, blob]), 255)


def _bytes():
    return Volume(np.rint(_things(40, 36, 32)).astype(np.uint8))


def _floats():
    """Waves as those of Marschner and Lobb, which have detail at every depth."""
    a, b, c = _grid(36, 36, 36)
    waves = np.cos(6 * np.pi * np.cos(np.pi * np.sqrt(a**2 + b**2) / 2))
    return Volume(((1 - np.sin(np.pi * c / 2) + 0.25 * (1 + waves)) / 2.5).astype(np.float32))


def _anisotropic():
    """Slices that lie far apart."""
    return Volume(np.rint(_things(40, 32, 12)).astype(np.uint8), (0.7, 0.7, 2.4))


def _drops():
    """Smooth drops of few values, as a simulated flame is stored; voxels are large in pictures."""
    places = np.stack(_grid(20, 20, 20), axis=-1)
    drops = (0.0, 0.1, -0.1, 0.3, 40), (0.5, -0.4, 0.4, 0.08, 34), (-0.5, 0.5, 0.5, 0.05, 30)
    parts = [h * np.exp(-((places - at) ** 2).sum(axis=-1) / w) for *at, w, h in drops]
    return Volume(np.rint(sum(parts)).clip(0, 47).astype(np.uint8))


def _missing():
    """The same things without a quarter, where 9e9 is stored."""
    a, b, _ = _grid(40, 36, 32)
    voxels = _things(40, 36, 32)
    gone = (a > 0.05) & (b < -0.1)
    voxels[gone] = voxels[~gone].min()  # as readers do
    return Volume(fill(voxels.astype(np.float32), gone), missing=gone)


VOLUMES = {
    "bytes": _bytes,
    "floats": _floats,
    "anisotropic": _anisotropic,
    "missing": _missing,
    "drops": _drops,
    "narrow range": lambda: _bytes().over((60.0, 180.0)),
}


@cache
def volume_of(name):
    """The volume of that name; made once."""
    return VOLUMES[name]()


def _modes(scalar_range, *modes):
    """Modes whose means and widths are fractions of the range."""
    lo, hi = scalar_range
    found = (GaussianMode(lo + m * (hi - lo), w * (hi - lo), a) for m, w, a in modes)
    return OpacityTF(scalar_range, tuple(found))


def _steps(scalar_range, *points):
    """A curve through points whose values are fractions of the range."""
    lo, hi = scalar_range
    return OpacityTF(scalar_range, points=tuple((lo + at * (hi - lo), a) for at, a in points))


TFS = {
    # The shell is a veil, the blob a cloud, ball and bar are solid.
    "veils": lambda r: _modes(r, (0.34, 0.06, 0.09), (0.5, 0.05, 0.2), (0.85, 0.2, 0.9)),
    "solid": lambda r: _steps(r, (0.25, 0.0), (0.34, 1.0)),
    "hard": lambda r: _steps(r, (0.4, 0.0), (0.401, 0.7), (0.6, 0.7), (0.601, 0.05)),
    "thin": lambda r: _modes(r, (0.2, 0.008, 0.8), (0.62, 0.008, 0.9)),
    "haze": lambda r: _steps(r, (0.0, 0.02), (1.0, 0.1)),
}

STOPS = (
    (0.0, 0.35, 0.45, 1.0), (0.4, 0.95, 0.75, 0.2), (0.6, 0.3, 0.8, 0.5), (1.0, 1.0, 0.9, 0.8),
)  # fmt: skip
"""Colours, at fractions of the range."""


OBLIQUE = View(35.0, 25.0, 7.0, 0.64)


@dataclass(frozen=True)
class PictureScene:
    """One of the volumes under one of the TFs, as one picture shows it; steps are in voxels."""

    volume: str
    tf: str = "veils"
    lighting: Lighting = "none"
    view: View = OBLIQUE
    light: LightDirection | None = None
    crop: CropBox | None = None
    step: float = 0.5
    width: int = 96
    height: int = 96

    @property
    def inputs(self):
        """View, TFs, light and crop box, as a renderer gets them."""
        lo, hi = scalar_range = volume_of(self.volume).scalar_range
        stops = tuple((lo + at * (hi - lo), *color) for at, *color in STOPS)
        colors = ColorTF(scalar_range, (*stops[:-1], (hi, *STOPS[-1][1:])))
        return SceneInputs(self.view, TFS[self.tf](scalar_range), colors, self.light, self.crop)

    @property
    def raster(self):
        return Raster(self.width, self.height)


CORNER = CropBox((0.0, 0.0, 0.25), (0.62, 1.0, 1.0))
BEHIND = LightDirection(150.0, 20.0)

SCENES = {
    "bytes": PictureScene("bytes"),
    "bytes-direct": PictureScene("bytes", lighting="direct"),
    "bytes-soft": PictureScene("bytes", lighting="soft"),
    "light-from-behind": PictureScene("bytes", "veils", "soft", light=BEHIND),
    "floats": PictureScene("floats", "veils", view=View(-60.0, 40.0, 0.0, 0.8)),
    "anisotropic-direct": PictureScene("anisotropic", "veils", "direct"),
    "missing-direct": PictureScene("missing", "solid", "direct"),
    "missing-soft": PictureScene("missing", "solid", "soft"),
    "crop-direct": PictureScene("bytes", "haze", "direct", crop=CORNER),
    "hard-steps": PictureScene("bytes", "hard", view=View(-40.0, 10.0, 0.0, 0.6)),
    "thin-peaks": PictureScene("floats", "thin", view=View(20.0, -35.0, 0.0, 0.9)),
    "near-and-aside": PictureScene(
        "bytes", "veils", "direct", View(200.0, -10.0, 4.0, 0.35, 0.6, -0.3), width=120, height=72
    ),
    "inside": PictureScene("floats", "haze", view=View(70.0, 10.0, 0.0, 0.1)),
    "narrow-range": PictureScene("narrow range", "veils", "direct"),
    "drops-1": PictureScene("drops", "solid", "path", View(35.0, 25.0, 7.0, 0.55)),
    "drops-2": PictureScene("drops", "solid", "path", View(-70.0, 50.0, 0.0, 0.55)),
    "drops-3": PictureScene("drops", "veils", "path", View(0.0, 0.0, 0.0, 0.55)),
    "drops-direct": PictureScene("drops", "solid", "direct", View(35.0, 25.0, 7.0, 0.55)),
    "drops-soft": PictureScene("drops", "solid", "soft", View(35.0, 25.0, 7.0, 0.55), step=0.1),
}

ROUNDING = Tolerance(0.0013, 0.005)
"""Of stored pictures, to 1/255, and of floating-point numbers."""

TOLERANCES = {
    # Another rounding sends a path elsewhere.
    "raycast": dict.fromkeys(get_args(Lighting), ROUNDING) | {"path": Tolerance(0.004, 0.04)},
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
    if regenerates and kind == "raycast":
        iio.imwrite(STORED / f"{name}.png", drawn, optimize=True)
    check(name, drawn, TOLERANCES[kind][scene.lighting], kind)


def test_no_stored_picture_is_left_over():
    assert {path.stem for path in STORED.glob("*.png")} == set(SCENES)
