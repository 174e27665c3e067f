"""The scene: all that is fixed for one generator, with its distant light."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.json_files import MalformedError, build
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.value_scale import ValueScale, place_of
from model.scene.view import DEFAULT_UP, ViewRange
from model.scene.volume import Triple, Volume


@dataclass(frozen=True)
class LightDirection:
    """Direction to the distant light, relative to the view, in degrees.

    Positive azimuth is to the viewer's right, positive elevation upwards; (0, 0) is a headlight. By
    default it comes from the upper left, close enough to the viewer that facing surfaces are
    bright. Raises :class:`TfscopeError` for angles that are not finite numbers.
    """

    azimuth: float = -30.0
    elevation: float = 30.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and math.isfinite(value)):
                raise TfscopeError(f"The light's {name} is {value!r}; give degrees.")

    @classmethod
    def parse(cls, text: str) -> LightDirection:
        """Read ``"AZ,EL"``, in degrees; raise :class:`TfscopeError` for anything else."""
        try:
            azimuth, elevation = (float(part) for part in text.split(","))
        except ValueError:
            raise TfscopeError(
                f"'{text}' is not a light direction; give azimuth,elevation in degrees relative "
                "to the view, for example -30,30."
            ) from None
        return cls(azimuth, elevation)

    def towards(self) -> tuple[float, float, float]:
        """Unit vector to the light, with components along the view's right, up and back."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        return (
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        )


@dataclass(frozen=True)
class LightRange:
    """Training range of a movable light, in degrees; others are a :class:`TfscopeError`."""

    max_azimuth: float = 80.0
    max_elevation: float = 70.0
    """Limits of the angles' absolute values, above 0 and up to 90, so that the light stays on the
    viewer's side."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and 0 < value <= 90):
                raise TfscopeError(f"The light range's {name} is {value!r}; give degrees to 90.")

    def nearest(self, light: LightDirection) -> LightDirection:
        """Return the nearest direction within the range, angle by angle."""
        return LightDirection(
            min(max(light.azimuth, -self.max_azimuth), self.max_azimuth),
            min(max(light.elevation, -self.max_elevation), self.max_elevation),
        )


FORMAT_VERSION = 5  # version of the scene's format in stores and models

Lighting = Literal["none", "direct", "soft", "path"]
"""Emission-absorption only; gradient shading; shadows and ambient light from a grid (ray caster
only); or multiple scattering (path tracer)."""

EXACT_LIGHTINGS: tuple[Lighting, ...] = ("none", "direct", "soft")
"""Lightings under which the ray caster has the exact derivative of images by the TF."""

PATH_CURVES: Lighting = "none"
PATH_FIELDS: Lighting = "soft"
"""Lights whose exact derivatives replace those of path-traced light, which has none: for regions'
curves, and for fields. They are the ray caster's most similar lights."""

TFFamily = Literal["paper", "drawn"]  # mixtures of modes, or also TFs like users' own

RendererName = Literal["vtk", "raycast"]
"""VTK, the reference, or tfscope's ray caster, which is several times faster. Their images agree.

VTK has no "soft" and no "path" lighting; under "path" the ray caster is replaced by the path
tracer."""

RENDERER_NAMES: dict[RendererName, str] = {"vtk": "VTK", "raycast": "ray caster"}
"""Names of the renderers in captions and menus."""


@dataclass(frozen=True)
class Scene:
    """All that is fixed while a generator is trained; :class:`TfscopeError` if inconsistent."""

    volume_name: str = field(compare=False)  # for display; the fingerprint identifies volumes
    volume_fingerprint: str  # `fingerprint` of the volume
    scalar_range: Range
    """Range over which TFs lie, on the scale: :attr:`model.scene.volume.Volume.scalar_range`.
    Voxels beyond it look like those at its ends."""
    scalar_window: Range  # range of the means of random opacity modes, on the scale
    image_size: int  # width and height of the colour image in pixels, 16 to 4096
    lighting: Lighting = "none"
    light: LightDirection | None = None  # None exactly when the lighting is "none"
    light_range: LightRange | None = None  # of a movable light; None for a fixed one or none
    sample_distance: float = 0.5  # distance between samples along a ray in voxels, 0.01 to 10
    view_range: ViewRange = field(default_factory=ViewRange)
    renderer: RendererName = "vtk"  # renderer of the training images
    proportions: Triple = (1.0, 1.0, 1.0)
    """Lengths of the volume along x, y and z, relative to the diameter of its bounding sphere.
    Older scenes lack them and use the sphere's bounding cube."""
    dimensions: tuple[int, int, int] | None = None  # along x, y and z; not in old scenes
    tf_family: TFFamily = "drawn"  # random TFs of the scene, see `random_inputs`
    scale: ValueScale = "linear"  # scale of the volume, of both ranges and of TFs

    def __post_init__(self) -> None:
        lo, hi = self.scalar_range
        window_lo, window_hi = self.scalar_window
        for name, value, kinds in (
            ("lighting", self.lighting, get_args(Lighting)),
            ("renderer", self.renderer, get_args(RendererName)),
            ("TF family", self.tf_family, get_args(TFFamily)),
        ):
            if value not in kinds:
                known = f"{', '.join(kinds[:-1])} or {kinds[-1]}"
                raise TfscopeError(f"The {name} '{value}' is unknown; choose {known}.")
        if (self.light is None) != (self.lighting == "none"):
            raise TfscopeError("A lit scene needs a light direction; an unlit one must have none.")
        if self.light_range is not None and self.light is None:
            raise TfscopeError("An unlit scene has no light to move.")
        if not (math.isfinite(lo) and math.isfinite(hi) and lo < hi):
            raise TfscopeError(f"The scene's scalar range [{lo:g}, {hi:g}] is not increasing.")
        if not lo <= window_lo < window_hi <= hi:
            raise TfscopeError(
                f"The scalar window [{window_lo:g}, {window_hi:g}] must increase and lie inside "
                f"the scalar range [{lo:g}, {hi:g}]."
            )
        if not 16 <= self.image_size <= 4096:
            raise TfscopeError(
                f"An image size of {self.image_size} pixels is not supported; give 16 to 4096."
            )
        if not 0.01 <= self.sample_distance <= 10:
            raise TfscopeError(
                f"A sample distance of {self.sample_distance:g} voxels is not supported; "
                "give 0.01 to 10."
            )
        if len(self.proportions) != 3 or not all(0 < length <= 1 for length in self.proportions):
            raise TfscopeError(
                f"The volume's proportions {self.proportions} must be three numbers in 0..1."
            )
        counts = self.dimensions
        if counts is not None and not (
            len(counts) == 3 and all(type(n) is int and n > 1 for n in counts)
        ):
            raise TfscopeError(
                f"The volume's dimensions {counts} must be three whole numbers from 2."
            )

    @property
    def window_samples(self) -> slice:
        """Slice of the 256 TF samples over the scalar range that are inside the scalar window."""
        lo, hi = self.scalar_range
        first, last = ((value - lo) / (hi - lo) * (TF_SAMPLES - 1) for value in self.scalar_window)
        return slice(math.ceil(first), math.floor(last) + 1)

    @classmethod
    def of(
        cls,
        volume: Volume,
        image_size: int,
        lighting: Lighting = "none",
        scalar_window: Range | None = None,
        renderer: RendererName = "vtk",
        movable_light: bool = False,
        tf_family: TFFamily = "drawn",
        up: str = "",
    ) -> Scene:
        """Create the scene of a volume.

        The window, in the data's units, defaults to :func:`default_scalar_window`; the view range's
        up axis defaults to the volume's, or the usual one. Raises :class:`TfscopeError` for values
        that are out of range or inconsistent.
        """
        return cls(
            volume_name=volume.name,
            volume_fingerprint=volume.fingerprint,
            scalar_range=volume.scalar_range,
            scalar_window=default_scalar_window(volume)
            if scalar_window is None
            else _on_scale(scalar_window, volume),
            image_size=image_size,
            lighting=lighting,
            light=None if lighting == "none" else LightDirection(),
            light_range=LightRange() if movable_light else None,
            view_range=ViewRange(up=up or volume.up or DEFAULT_UP),
            renderer=renderer,
            proportions=volume.proportions,
            dimensions=volume.dimensions,
            tf_family=tf_family,
            scale=volume.scale,
        )

    @classmethod
    def from_json(cls, data: Any) -> Scene:
        """Rebuild a scene from plain data; raise :class:`TfscopeError` if it is malformed."""
        try:
            return build(cls, data, exact=True)
        except MalformedError as error:
            raise TfscopeError(f"The scene is malformed near {error}.") from error


def _on_scale(scalar_window: Range, volume: Volume) -> Range:
    """Convert a scalar window in the data's units to a volume's scale."""
    low, high = scalar_window
    if volume.scale == "log" and low <= 0:
        raise TfscopeError(
            f"The scalar window starts at {low:g}, which has no logarithm; start above zero."
        )
    return place_of(low, volume.scale), place_of(high, volume.scale)


def default_scalar_window(volume: Volume) -> Range:
    """Return the default scalar window: the values at which opacity modes show structure.

    The paper adjusts it by hand. Here it omits the top eighth of the range, and the bottom up to
    slightly above the most frequent value: an eighth to a quarter.
    """
    lo, hi = volume.scalar_range
    counts, _ = volume.histogram(256)
    background = (int(counts.argmax()) + 1) / len(counts) + 3 / 256
    bottom = min(max(background, 0.125), 0.25)
    return lo + bottom * (hi - lo), hi - 0.125 * (hi - lo)


FOOT = 0.02  # height at which the background's peak ends, as a fraction of the peak's height


def window_above_background(
    counts: NDArray[np.int64], edges: NDArray[np.float64], scalar_range: Range, window: Range
) -> Range:
    """Return a scalar window, begun lower if the background in the histogram ends lower.

    The n bins have n + 1 edges. The background is the most frequent value below the window, with
    those above it up to the foot of its peak.
    """
    is_below = (edges[1:] > scalar_range[0]) & (edges[:-1] < window[0])
    peak = int(np.where(is_below, counts, 0).argmax())
    # Of three bins, as scaled integers leave some empty.
    means = np.convolve(counts, np.full(3, 1 / 3), mode="same")[peak:]
    (ends,) = np.nonzero(means < FOOT * means[0])
    end = float(edges[peak + ends[0] + 1]) if len(ends) else window[0]
    return min(end, window[0]), window[1]
