"""Scenes at the extremes of what tfscope takes, and what it says of those that it refuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.rendering.raster import Raster
from model.scene.crop import LEAST_LENGTH, CropBox
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF, Point
from model.scene.view import View
from model.scene.volume import Volume

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
    """Return the message by which each input is refused that shows nothing or cannot be drawn."""
    voxels = field()
    precise = field(dtype=np.float64)
    attempts: dict[str, Callable[[], object]] = {
        "one voxel thick": lambda: Volume(voxels[:1]),
        "constant volume": lambda: Volume(np.full(SHAPE, 7.0)),
        "missing voxels everywhere": lambda: Volume(voxels, missing=np.ones(SHAPE, dtype=bool)),
        "a voxel is NaN": lambda: Volume(np.where(voxels > 0.5, np.nan, voxels)),
        "a voxel is infinite": lambda: Volume(np.where(voxels > 0.5, np.inf, voxels)),
        "range of denormal numbers": lambda: Volume(1e-320 * precise),
        "range beyond floating-point numbers": lambda: Volume(1.7e308 * (2 * precise - 1)),
        "range that float64 does not resolve": lambda: Volume(1e17 + precise),
        "200 whole numbers at 2^63": lambda: Volume((200 * precise).astype(np.uint64) + 2**63),
        "chosen range of width 0": lambda: Volume(voxels).over((0.5, 0.5)),
        "spacing of 0": lambda: Volume(voxels, (1.0, 0.0, 1.0)),
        "spacing that is not finite": lambda: Volume(voxels, (1.0, np.inf, 1.0)),
        "crop of zero width": lambda: CropBox((0.5, 0.0, 0.0), (0.5, 1.0, 1.0)),
        "camera in the volume's centre": lambda: replace(VIEW, distance=0.0),
        "a view that is not finite": lambda: replace(VIEW, azimuth=np.nan),
        "a light that is not finite": lambda: LightDirection(np.nan, 0.0),
        "opacity above 1": lambda: OpacityTF((0.0, 1.0), points=((0.0, 1.5),)),
    }
    messages = {}
    for name, attempt in attempts.items():
        with pytest.raises(TfscopeError) as refusal:
            attempt()
        messages[name] = str(refusal.value)
    return messages


def extremes() -> dict[tuple[str, str], Callable[[], Posed]]:
    """Return all scenes that are drawn by their kind and name, the ordinary one first."""
    # Volumes are made when they are drawn: there are many.
    kinds: dict[str, dict[str, Callable[[], Posed]]] = {
        "ordinary": {"no extreme": posed},
        "opacity": {name: partial(posed, curve=curve) for name, curve in _curves().items()},
        "values": {name: partial(_of_volume, make, VIEW) for name, make in _values().items()},
        "grid": {name: partial(_of_volume, *given) for name, given in _grids().items()},
        "view": {name: partial(posed, **given) for name, given in _views().items()},
        "raster": {name: partial(posed, raster=Raster(*n)) for name, n in _RASTERS.items()},
        "part": {name: partial(posed, **given) for name, given in _crops().items()}
        | {name: partial(_of_volume, make, VIEW) for name, make in _missing().items()},
    }
    return {(kind, name): pose for kind, all_ in kinds.items() for name, pose in all_.items()}


def _of_volume(make: Callable[[], Volume], view: View) -> Posed:
    return posed(make(), view=view)


def _curves() -> dict[str, tuple[Point, ...]]:
    def single(place: int) -> tuple[Point, ...]:
        around = {place - 1: 0.0, place: 1.0, place + 1: 0.0}
        return tuple((bin_ / 255, value) for bin_, value in around.items() if 0 <= bin_ <= 255)

    flat = {"0": 0.0, "1e-12": 1e-12, "1e-7": 1e-7, "1e-3": 1e-3}
    high = {"1 - 1e-7": 1 - 1e-7, "1": 1.0}
    return {
        **{f"{name} everywhere": ((0.0, value),) for name, value in flat.items()},
        "0 to 1e-6, a ramp": ((0.0, 0.0), (1.0, 1e-6)),
        **{f"{name} everywhere": ((0.0, value),) for name, value in high.items()},
        "1 from the middle on": ((0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (1.0, 1.0)),
        "1 in the lowest bin": single(0),
        "1 in a middle bin": single(128),
        "1 in the highest bin": single(255),
    }


def _values() -> dict[str, Callable[[], Volume]]:
    precise = field(dtype=np.float64)
    half = precise - 0.5
    wide = {
        f"0 to {width:g}, float{bits}": partial(_scaled, width, bits)
        for bits, widths in (
            (64, (1e-300, 1e-30, 1e-12, 1e12, 1e30, 1e300)),
            (32, (1e-30, 1e-12, 1e12, 1e30)),
        )
        for width in widths
    }
    return {
        **wide,
        "-8e307 to 8e307": lambda: Volume(1.6e308 * half),
        "1e6 and 1e-3 more, float64": lambda: Volume(1e6 + 1e-3 * precise),
        "1e15 and 1e3 more, float64": lambda: Volume(1e15 + 1e3 * precise),
        "int64, all of it": lambda: Volume((half * 1.8e19).astype(np.int64)),
        "two whole numbers": lambda: Volume((precise > 0.5).astype(np.uint8)),
    }


def _scaled(width: float, bits: int) -> Volume:
    dtype = np.dtype(f"float{bits}")
    return Volume(dtype.type(width) * field(dtype=dtype))


def _grids() -> dict[str, tuple[Callable[[], Volume], View]]:
    # A needle is narrower than a pixel from where all of it is in view.
    near = replace(VIEW, distance=0.01)

    def spaced(*spacing: float) -> Callable[[], Volume]:
        return lambda: Volume(field(), spacing)  # type: ignore[arg-type]

    def shaped(*shape: int) -> Callable[[], Volume]:
        return lambda: Volume(field(shape))  # type: ignore[arg-type]

    return {
        "1 : 1,000 along x": (spaced(1e3, 1.0, 1.0), near),
        "1 : 1,000 along z": (spaced(1.0, 1.0, 1e3), near),
        "1,000 : 1 along z": (spaced(1.0, 1.0, 1e-3), VIEW),
        "voxels of 1e-12": (spaced(1e-12, 1e-12, 1e-12), VIEW),
        "voxels of 1e12": (spaced(1e12, 1e12, 1e12), VIEW),
        "two voxels thick": (shaped(2, 20, 17), VIEW),
        "2 x 2 x 2 voxels": (shaped(2, 2, 2), VIEW),
        "1,000 x 2 x 2 voxels": (shaped(2, 2, 1000), near),
        "origin 1e12 away": (lambda: Volume(field(), origin=(1e12, -1e12, 1e12)), VIEW),
    }


def _views() -> dict[str, dict[str, Any]]:
    def lit(azimuth: float, elevation: float, view: View = VIEW) -> dict[str, Any]:
        return {"view": view, "light": LightDirection(azimuth, elevation)}

    return {
        "camera inside": {"view": replace(VIEW, distance=0.05)},
        "camera 1e-9 from the centre": {"view": replace(VIEW, distance=1e-9)},
        # An odd number of pixels, so that one of them meets the volume.
        "camera 1,000 times as far": {
            "view": replace(VIEW, distance=1e3),
            "raster": Raster(25, 25),
        },
        "along an axis": {"view": View()},
        "from the pole": {"view": View(0.0, 90.0, 0.0, 0.7)},
        "panned out of view": {"view": replace(VIEW, pan_x=1e6)},
        "light along the view": lit(0.0, 0.0),
        "light against the view": lit(180.0, 0.0),
        "light from straight above": lit(0.0, 90.0),
        "light along an axis": lit(90.0, 0.0, View()),
    }


_RASTERS = {
    "1 x 1": (1, 1),
    "3 x 2": (3, 2),
    "16,384 x 1": (16384, 1),
    "1 x 16,384": (1, 16384),
    "a row of 16,384 x 16,384": (16384, 16384, 0, 8000, 16384, 1),
    "a pixel of 16,384 x 16,384": (16384, 16384, 9000, 8000, 1, 1),
}


def _crops() -> dict[str, dict[str, Any]]:
    thin = 0.5 + LEAST_LENGTH
    return {
        "thinnest crop": {"crop": CropBox((0.5, 0.0, 0.0), (thin, 1.0, 1.0))},
        "thinnest crop along all axes": {
            "crop": CropBox((0.5, 0.5, 0.5), (thin, thin, thin)),
            "view": replace(VIEW, distance=0.02),
        },
    }


def _missing() -> dict[str, Callable[[], Volume]]:
    def without(where: NDArray[np.bool_]) -> Callable[[], Volume]:
        garbage = np.where(where, 1e30, field()).astype(np.float32)
        return lambda: Volume(garbage, missing=where)

    two = np.ones(SHAPE, dtype=bool)
    two[7, 10, 8] = two[7, 10, 9] = False
    return {
        "half of the voxels missing": without(np.random.default_rng(1).random(SHAPE) < 0.5),
        "all but two voxels missing": without(two),
    }
