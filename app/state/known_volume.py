"""Memories of a volume, as plain data whose every value is checked by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from app.state.kept_fields import checks_of, kept, unknown
from app.state.kept_inputs import input_check
from app.state.value_checks import (
    checked,
    either,
    flag,
    list_of,
    number,
    one_of,
    text,
    valid_of,
    whole_number,
)
from model.scene.scene import Lighting

MOST_RECENT = 10
"""Number of recent files of each kind, and of remembered models of a volume."""


MOST_MARKS, MOST_POINTS = 1000, 100_000
"""Number of regions of a volume, and of a region's corners."""

LightingChoice = Literal["auto"] | Lighting
"""A lighting of the reference image, or the one that suits model and machine."""

FORMER_LIGHT: str = "shadows"
"""Light that volumes and sessions of the first version may be remembered in."""

FORMER_TOLD = "It was seen in a light that is not there, “Shadows”; soft light is shown."

Scale = Literal["linear", "logarithmic"]


@dataclass(frozen=True)
class KnownRegion:
    """A region that was drawn in a volume's images.

    Attributes
    ----------
    points : tuple of (x, y)
        Those of its :class:`~model.scene.region.Outline`.
    """

    name: str
    points: tuple[tuple[float, float], ...]


_lighting = one_of("none", "direct", "soft", "path")
recent_texts = list_of(text, MOST_RECENT)
"""Check of a list of paths, the newest first."""

_scale = one_of("linear", "logarithmic")


def _region(value: Any) -> KnownRegion:
    """Take a region, or raise ValueError."""
    if isinstance(value, KnownRegion):
        return value
    if not isinstance(value, dict):
        raise ValueError("it must have names")
    pair = list_of(number(-1e3, 1e3), 2)
    points = list_of(pair, MOST_POINTS)(value.get("points"))
    if len(points) < 3 or any(len(point) != 2 for point in points):
        raise ValueError("it must have corners")
    return KnownRegion(text(value.get("name")), tuple((x, y) for x, y in points))


def _visible(value: Any) -> tuple[float, ...]:
    """Check that a value is empty or a range."""
    ends = list_of(number(-1e300, 1e300), 2)(value)
    if ends and not (len(ends) == 2 and ends[0] < ends[1]):
        raise ValueError("it must have a lower and a higher end")
    return ends


@dataclass(frozen=True)
class KnownVolume:
    """Memories of one volume.

    Attributes
    ----------
    path : str
        Where it was opened last; empty if that is not known.
    up_axis : str
        Axis that the user has turned up, such as "-y"; empty for the file's own.
    raw_layout : str
        Layout to read a headerless file with, see :meth:`RawLayout.parse`; empty for none.
    view : tuple of float
        Values of the last :class:`~model.scene.view.View`; empty if unknown.
    lighting : {"auto", "none", "direct", "soft", "path"}
        Of the reference image.
    light : tuple of float
        Azimuth and elevation of the light that the user has moved, in degrees; else empty.
    brightness : float or None
        Factor of the images' colours, 0.25 to 4; None for the usual one of the light.
    crop : tuple of float
        Least fractions along x, y and z of the part that is shown, then the greatest; empty for
        all of it.
    draws_missing : bool
        Whether voxels are drawn where nothing was measured.
    choice : str
        What was chosen of a file of several volumes, see :meth:`Choice.parse`; empty for nothing.
    models : tuple of str
        Folders of models that were opened with it, the newest first.
    active_region : str
        Name of the active one; empty for the whole image.
    region_count : int
        Number of the last one that was numbered.
    value_scale, opacity_scale : {"linear", "logarithmic"}
        Of the TF's plot.
    visible : tuple of float
        Lowest and highest scalar value in sight in the TF's plot; empty for the usual ones.
    others : dict
        What this version does not know, to be kept.
    """

    path: str = kept(text, "")
    up_axis: str = kept(one_of("", "+x", "-x", "+y", "-y", "+z", "-z"), "", in_session=True)
    raw_layout: str = kept(text, "", in_session=True)
    models: tuple[str, ...] = kept(recent_texts, (), merging="newest_first")
    view: tuple[float, ...] = kept(input_check("view"), (), in_session=True)
    lighting: LightingChoice = kept(
        either(one_of("auto", FORMER_LIGHT), _lighting), "auto", in_session=True
    )
    light: tuple[float, ...] = kept(input_check("light"), (), in_session=True)
    brightness: float | None = kept(either(one_of(None), number(0.25, 4.0)), None, in_session=True)
    crop: tuple[float, ...] = kept(input_check("crop"), (), in_session=True)
    draws_missing: bool = kept(flag, False, in_session=True)
    choice: str = kept(text, "", in_session=True)
    regions: tuple[KnownRegion, ...] = kept(
        valid_of(_region, MOST_MARKS), (), in_session=True, merging="collected"
    )
    active_region: str = kept(text, "", in_session=True)
    region_count: int = kept(whole_number(0, 10**9), 0, in_session=True, merging="greatest")
    value_scale: Scale = kept(_scale, "linear", in_session=True)
    opacity_scale: Scale = kept(_scale, "linear", in_session=True)
    visible: tuple[float, ...] = kept(_visible, (), in_session=True)
    others: dict[str, Any] = unknown()


def changed_volume(known: KnownVolume, changes: dict[str, Any]) -> KnownVolume:
    """Return what is known of a volume with some values changed.

    Raises
    ------
    ValueError
        For a name that there is not, or a wrong value.
    """
    return replace(
        known, **{name: checked(checks_of(KnownVolume), name, v) for name, v in changes.items()}
    )
