"""The scene: what is modelled, and nothing else.

Samplers, networks, training and the window read it from here; a checkpoint
carries the scene that it was trained for.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

from model.errors import TfscopeError
from model.scene.light import LightDirection, LightRange
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.view import ViewRange
from model.scene.volume import Triple, Volume

Lighting = Literal["none", "direct", "global"]
"""Emission-absorption alone, gradient shading, or volumetric scattering with shadows."""

RendererName = Literal["vtk", "raycast"]
"""VTK, the reference; or the own ray caster, which is several times faster.

Unlit and under direct lighting their images are the same; global lighting is
scattering in VTK, and shadows with ambient occlusion in the ray caster.
"""


@dataclass(frozen=True)
class Scene:
    """Everything that is fixed while a generator is trained.

    Attributes
    ----------
    volume_name : str
        For people; the fingerprint tells volumes apart.
    volume_fingerprint : str
        :attr:`model.scene.volume.Volume.fingerprint` of the volume.
    scalar_range : tuple of float
        The volume's smallest and largest value, in its own units.
    scalar_window : tuple of float
        Where the means of random opacity modes lie, in the data's units.
    image_size : int
        Width and height of the colour image, pixels.
    lighting : {"none", "direct", "global"}
    light : LightDirection or None
        None exactly when the lighting is "none".
    light_range : LightRange or None
        Where the light may be moved to; None for a fixed light, or none.
    sample_distance : float
        Distance between samples along a ray, in voxels.
    view_range : ViewRange
    renderer : {"vtk", "raycast"}
        What renders the images that are learned from.
    proportions : tuple of float
        The volume's lengths along x, y and z over the diameter of its bounding
        sphere. Scenes of earlier versions do not say it; then the volume may be
        anywhere in the sphere.
    """

    volume_name: str = field(compare=False)
    volume_fingerprint: str
    scalar_range: Range
    scalar_window: Range
    image_size: int
    lighting: Lighting = "none"
    light: LightDirection | None = None
    light_range: LightRange | None = None
    sample_distance: float = 0.5
    view_range: ViewRange = field(default_factory=ViewRange)
    renderer: RendererName = "vtk"
    proportions: Triple = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        lo, hi = self.scalar_range
        window_lo, window_hi = self.scalar_window
        if self.lighting not in get_args(Lighting):
            raise TfscopeError(
                f"The lighting '{self.lighting}' is unknown; choose none, direct or global."
            )
        if self.renderer not in get_args(RendererName):
            raise TfscopeError(f"The renderer '{self.renderer}' is unknown; choose vtk or raycast.")
        if (self.light is None) != (self.lighting == "none"):
            raise TfscopeError("A lit scene needs a light direction, and an unlit one has none.")
        if self.light_range is not None and self.light is None:
            raise TfscopeError("An unlit scene has no light that could be moved.")
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

    @property
    def window_samples(self) -> slice:
        """Which of a TF's 256 samples over the scalar range lie inside the scalar window."""
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
    ) -> Scene:
        """The scene of a volume, with the default light and window for it."""
        return cls(
            volume_name=volume.name,
            volume_fingerprint=volume.fingerprint,
            scalar_range=volume.scalar_range,
            scalar_window=scalar_window or default_scalar_window(volume),
            image_size=image_size,
            lighting=lighting,
            light=None if lighting == "none" else LightDirection(),
            light_range=LightRange() if movable_light else None,
            renderer=renderer,
            proportions=volume.proportions,
        )

    def to_json(self) -> dict[str, Any]:
        """The scene as plain data."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: Any) -> Scene:
        """Rebuild a scene from :meth:`to_json`'s data.

        Raises
        ------
        TfscopeError
            When the data is not a scene.
        """
        try:
            values = dict(data)
            values["scalar_range"] = _pair(values["scalar_range"])
            values["scalar_window"] = _pair(values["scalar_window"])
            if "proportions" in values:
                values["proportions"] = tuple(float(v) for v in values["proportions"])
            values["view_range"] = ViewRange(**values["view_range"])
            if values["light"] is not None:
                values["light"] = LightDirection(**values["light"])
            if values["light_range"] is not None:
                values["light_range"] = LightRange(**values["light_range"])
            return cls(**values)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise TfscopeError(f"The scene is malformed near {error}.") from error


def default_scalar_window(volume: Volume) -> Range:
    """The part of the scalar range where opacity modes show structure.

    The paper adjusts it by hand per volume. Here it leaves out an eighth of
    the range at the top, where few voxels are left, and at the bottom as many
    values as the most frequent one (air, background) reaches, an eighth at
    least and a quarter at most.
    """
    lo, hi = volume.scalar_range
    counts, _ = volume.histogram(256)
    background = (int(counts.argmax()) + 4) / 256
    bottom = min(max(background, 0.125), 0.25)
    return lo + bottom * (hi - lo), hi - 0.125 * (hi - lo)


def _pair(values: Any) -> Range:
    lo, hi = values
    return float(lo), float(hi)
