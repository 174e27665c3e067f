"""Scenes at the extremes of what tfscope takes, and what it says of those that it refuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.rendering.raster import Raster
from model.scene.crop import LEAST_LENGTH, CropBox
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF, Point
from model.scene.view import View
from model.scene.volume import Triple, Volume

SHAPE = (14, 20, 17)
"""Voxels of the volumes along z, y and x."""

SIZE = 24
"""Width and height of the pictures in pixels, where nothing else is said."""

VIEW = View(30.0, 20.0, 5.0, 0.8)

CURVE: tuple[Point, ...] = ((0.0, 0.0), (0.3, 0.0), (0.6, 0.4), (0.9, 0.1), (1.0, 0.8))
"""Opacities over fractions of the scalar range."""

STOPS = ((0.0, 0.9, 0.2, 0.1), (0.5, 0.2, 0.9, 0.4), (1.0, 0.3, 0.5, 1.0))


@dataclass(frozen=True, eq=False)
class Posed:
    """A volume, inputs and pixels: all that a picture is drawn from."""

    volume: Volume
    inputs: SceneInputs
    raster: Raster


@dataclass(frozen=True)
class Extreme:
    """One extreme of one kind."""

    kind: str
    name: str
    pose: Callable[[], Posed]


def extremes() -> list[Extreme]:
    """Return all that are drawn, the ordinary scene first."""
    return [
        Extreme("ordinary", "no extreme", posed),
        *_opacities(),
        *_values(),
        *_grids(),
        *_views(),
        *_rasters(),
        *_parts(),
    ]


def posed(
    volume: Volume | None = None,
    curve: tuple[Point, ...] = CURVE,
    view: View = VIEW,
    light: LightDirection | None = None,
    crop: CropBox | None = None,
    raster: Raster | None = None,
) -> Posed:
    """Return a scene with the curve stretched to the volume's range."""
    volume = volume or Volume(field())
    lo, hi = volume.scalar_range

    def at(share: float) -> float:
        return lo * (1 - share) + hi * share

    opacity = OpacityTF((lo, hi), points=tuple((at(place), value) for place, value in curve))
    color = ColorTF((lo, hi), tuple((at(place), r, g, b) for place, r, g, b in STOPS))
    inputs = SceneInputs(view, opacity, color, light, crop)
    return Posed(volume, inputs, raster or Raster(SIZE, SIZE))


def field(shape: tuple[int, int, int] = SHAPE, dtype: Any = np.float32) -> NDArray[Any]:
    """Return smooth random voxels from 0 to 1, with pieces of either."""
    from scipy.ndimage import gaussian_filter

    rough = np.random.default_rng(0).normal(size=shape)
    smooth = gaussian_filter(rough, [min(2.0, n / 7) for n in shape])
    smooth = (smooth - smooth.min()) / (smooth.max() - smooth.min())
    return np.asarray(np.clip(1.4 * smooth - 0.2, 0, 1), dtype=dtype)


def refused() -> dict[str, str]:
    """Return the message by which each input is refused that shows nothing or cannot be drawn.

    Raises
    ------
    AssertionError
        When one of them is not refused.
    """
    ordinary = posed()
    voxels = ordinary.volume.voxels
    everywhere = np.ones(SHAPE, dtype=bool)
    attempts: dict[str, Callable[[], object]] = {
        "one voxel thick": lambda: Volume(field()[:1]),
        "constant volume": lambda: Volume(np.full(SHAPE, 7.0)),
        "missing voxels everywhere": lambda: Volume(voxels, missing=everywhere),
        "a voxel is NaN": lambda: Volume(np.where(field() > 0.5, np.nan, field())),
        "a voxel is infinite": lambda: Volume(np.where(field() > 0.5, np.inf, field())),
        "range of denormal numbers": lambda: Volume(1e-320 * field(dtype=np.float64)),
        "range beyond floating-point numbers": lambda: Volume(
            1.7e308 * (2 * field(dtype=float) - 1)
        ),
        "range that float64 does not resolve": lambda: Volume(1e17 + field(dtype=np.float64)),
        "200 whole numbers at 2^63": lambda: Volume(
            (200 * field(dtype=float)).astype(np.uint64) + 2**63
        ),
        "chosen range of width 0": lambda: ordinary.volume.over((0.5, 0.5)),
        "spacing of 0": lambda: Volume(field(), (1.0, 0.0, 1.0)),
        "spacing that is not finite": lambda: Volume(field(), (1.0, np.inf, 1.0)),
        "crop of zero width": lambda: CropBox((0.5, 0.0, 0.0), (0.5, 1.0, 1.0)),
        "camera in the volume's centre": lambda: replace(VIEW, distance=0.0),
        "a view that is not finite": lambda: replace(VIEW, azimuth=np.nan),
        "a light that is not finite": lambda: LightDirection(np.nan, 0.0),
        "opacity above 1": lambda: OpacityTF((0.0, 1.0), points=((0.0, 1.5),)),
    }
    said = {}
    for name, attempt in attempts.items():
        try:
            attempt()
        except TfscopeError as error:
            said[name] = str(error)
        else:
            raise AssertionError(f"{name}: it was not refused.")
    return said


def _opacities() -> list[Extreme]:
    def of(name: str, curve: tuple[Point, ...]) -> Extreme:
        return Extreme("opacity", name, lambda: posed(curve=curve))

    def single(place: int) -> tuple[Point, ...]:
        around = {place - 1: 0.0, place: 1.0, place + 1: 0.0}
        return tuple((bin_ / 255, value) for bin_, value in around.items() if 0 <= bin_ <= 255)

    return [
        of("0 everywhere", ((0.0, 0.0),)),
        of("1e-12 everywhere", ((0.0, 1e-12),)),
        of("1e-7 everywhere", ((0.0, 1e-7),)),
        of("1e-3 everywhere", ((0.0, 1e-3),)),
        of("0 to 1e-6, a ramp", ((0.0, 0.0), (1.0, 1e-6))),
        of("1 - 1e-7 everywhere", ((0.0, 1 - 1e-7),)),
        of("1 everywhere", ((0.0, 1.0),)),
        of("1 from the middle on", ((0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (1.0, 1.0))),
        of("1 in the lowest bin", single(0)),
        of("1 in a middle bin", single(128)),
        of("1 in the highest bin", single(255)),
    ]


def _values() -> list[Extreme]:
    def of(name: str, make: Callable[[], NDArray[Any]]) -> Extreme:
        return Extreme("values", name, lambda: posed(Volume(make())))

    precise = field(dtype=np.float64)
    found = [
        of(f"0 to {width:g}, float64", lambda width=width: width * precise)  # type: ignore[misc]
        for width in (1e-300, 1e-30, 1e-12, 1e12, 1e30, 1e300)
    ]
    found += [
        of(f"0 to {width:g}, float32", lambda width=width: np.float32(width) * field())  # type: ignore[misc]
        for width in (1e-30, 1e-12, 1e12, 1e30)
    ]
    half = precise - 0.5
    return [
        *found,
        of("-8e307 to 8e307", lambda: 1.6e308 * half),
        of("1e6 and 1e-3 more, float64", lambda: 1e6 + 1e-3 * precise),
        of("1e15 and 1e3 more, float64", lambda: 1e15 + 1e3 * precise),
        of("int64, all of it", lambda: (half * 1.8e19).astype(np.int64)),
        of("two whole numbers", lambda: (precise > 0.5).astype(np.uint8)),
    ]


def _grids() -> list[Extreme]:
    # A needle is narrower than a pixel from where all of it is in view.
    near = replace(VIEW, distance=0.01)

    def spaced(name: str, x: float, y: float, z: float, view: View = VIEW) -> Extreme:
        return Extreme("grid", name, lambda: posed(Volume(field(), (x, y, z)), view=view))

    def shaped(name: str, z: int, y: int, x: int, view: View = VIEW) -> Extreme:
        return Extreme("grid", name, lambda: posed(Volume(field((z, y, x))), view=view))

    return [
        spaced("1 : 1,000 along x", 1e3, 1.0, 1.0, near),
        spaced("1 : 1,000 along z", 1.0, 1.0, 1e3, near),
        spaced("1,000 : 1 along z", 1.0, 1.0, 1e-3),
        spaced("voxels of 1e-12", 1e-12, 1e-12, 1e-12),
        spaced("voxels of 1e12", 1e12, 1e12, 1e12),
        shaped("two voxels thick", 2, 20, 17),
        shaped("2 x 2 x 2 voxels", 2, 2, 2),
        shaped("1,000 x 2 x 2 voxels", 2, 2, 1000, near),
        Extreme(
            "grid",
            "origin 1e12 away",
            lambda: posed(Volume(field(), origin=(1e12, -1e12, 1e12))),
        ),
    ]


def _views() -> list[Extreme]:
    def of(name: str, view: View, light: tuple[float, float] | None = None) -> Extreme:
        lit = None if light is None else LightDirection(*light)
        return Extreme("view", name, lambda: posed(view=view, light=lit))

    return [
        of("camera inside", replace(VIEW, distance=0.05)),
        of("camera 1e-9 from the centre", replace(VIEW, distance=1e-9)),
        Extreme(
            "view",
            "camera 1,000 times as far",
            # An odd number of pixels, so that one of them meets the volume.
            lambda: posed(view=replace(VIEW, distance=1e3), raster=Raster(25, 25)),
        ),
        of("along an axis", View()),
        of("from the pole", View(0.0, 90.0, 0.0, 0.7)),
        of("panned out of view", replace(VIEW, pan_x=1e6)),
        of("light along the view", VIEW, (0.0, 0.0)),
        of("light against the view", VIEW, (180.0, 0.0)),
        of("light from straight above", VIEW, (0.0, 90.0)),
        of("light along an axis", View(), (90.0, 0.0)),
    ]


def _rasters() -> list[Extreme]:
    def of(name: str, *numbers: int) -> Extreme:
        return Extreme("raster", name, lambda: posed(raster=Raster(*numbers)))

    return [
        of("1 x 1", 1, 1),
        of("3 x 2", 3, 2),
        of("16,384 x 1", 16384, 1),
        of("1 x 16,384", 1, 16384),
        of("a row of 16,384 x 16,384", 16384, 16384, 0, 8000, 16384, 1),
        of("a pixel of 16,384 x 16,384", 16384, 16384, 9000, 8000, 1, 1),
    ]


def _parts() -> list[Extreme]:
    def cropped(name: str, low: Triple, high: Triple, view: View = VIEW) -> Extreme:
        return Extreme("part", name, lambda: posed(crop=CropBox(low, high), view=view))

    def missing(name: str, where: NDArray[np.bool_]) -> Extreme:
        garbage = np.where(where, 1e30, field())
        return Extreme(
            "part",
            name,
            lambda: posed(Volume(garbage.astype(np.float32), missing=where)),
        )

    thin = 0.5 + LEAST_LENGTH
    random = np.random.default_rng(1).random(SHAPE)
    two = np.ones(SHAPE, dtype=bool)
    two[7, 10, 8] = two[7, 10, 9] = False
    return [
        cropped("thinnest crop", (0.5, 0.0, 0.0), (thin, 1.0, 1.0)),
        cropped(
            "thinnest crop along all axes",
            (0.5, 0.5, 0.5),
            (thin, thin, thin),
            replace(VIEW, distance=0.02),
        ),
        missing("half of the voxels missing", random < 0.5),
        missing("all but two voxels missing", two),
    ]
