"""What the window remembers between runs, as plain data whose every value is checked by itself."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from app.engines.engines import Drawing
from app.state.exactness import STEPS, USUAL
from app.state.value_checks import (
    Checks,
    base64_text,
    checked,
    dict_of,
    either,
    list_of,
    number,
    one_of,
    text,
    valid_of,
    valid_values,
    whole_number,
)
from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.scene import RENDERER_NAMES, Lighting, RendererName
from model.scene.transfer_function import TransferFunction
from model.scene.view import View

FORMAT_VERSION = 2
"""Version of the data: in the first one, the lights "soft" and "shadows" were "global"."""

MOST_RECENT = 10
"""Number of recent files of each kind, and of remembered models of a volume."""

MOST_VOLUMES = 300
"""Number of volumes that are remembered; the one opened longest ago gives way."""

MOST_TRADES = 12
"""Number of a volume's measurements, one for each machine, light and renderer; the oldest gives
way."""

MOST_IMAGES = 20
"""Number of images of a measurement."""

MOST_MARKS, MOST_POINTS = 1000, 100_000
"""Number of regions and of named TFs of a volume, and of a region's corners."""

LightingChoice = Literal["auto"] | Lighting
"""A lighting of the reference image, or the one that suits model and machine."""

ReferenceSize = Literal["generator"] | int | None
"""As many pixels as the generator's image, a number of pixels, or as many as the pane has."""


Scale = Literal["linear", "logarithmic"]

ThemeChoice = Literal["system", "dark", "light"]
"""The window's colours: the system's, or others."""


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


@dataclass(frozen=True)
class KnownPlace:
    """A TF that was named on the map of TFs.

    Attributes
    ----------
    tf : dict
        Its opacity TF as the content of a TF file, see
        :meth:`~model.scene.transfer_function.TransferFunction.to_json`.
    place : tuple of float
        Where it lay on the map.
    picture : str
        What it showed, a PNG file in base64; empty for none.
    """

    name: str
    tf: dict[str, Any]
    place: tuple[float, ...] = (0.0, 0.0)
    picture: str = ""


@dataclass(frozen=True)
class KnownTrade:
    """Cost of images while something moves, as the mean over some scenes of a volume.

    Attributes
    ----------
    machine : str
        Processor and threads.
    lighting : str
    renderer : {"vtk", "raycast"}
        Who drew; in path-traced light the path tracer stands in the ray caster's place.
    size : float
        Square root of the number of pixels at rest.
    scenes : int
    seconds, error : float
        Of the image at rest, see :class:`~app.state.trade_keeper.AtRest`.
    images : tuple of (scale, seconds, error)
        See :class:`~app.state.trade_keeper.Traded`; times and errors as factors of those at rest.
    """

    machine: str
    lighting: Lighting
    renderer: RendererName
    size: float
    scenes: int
    seconds: float
    error: float
    images: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class KnownVolume:
    """What is remembered of a volume.

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
    lighting : {"auto", "none", "direct", "soft", "shadows", "path"}
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
    place_count : int
        Number of the last one that was numbered.
    value_scale, opacity_scale : {"linear", "logarithmic"}
        Of the TF's plot.
    visible : tuple of float
        Lowest and highest scalar value in sight in the TF's plot; empty for the usual ones.
    trades : tuple of KnownTrade
        The newest last.
    others : dict
        What this version does not know, to be kept.
    """

    path: str = ""
    up_axis: str = ""
    raw_layout: str = ""
    models: tuple[str, ...] = ()
    view: tuple[float, ...] = ()
    lighting: LightingChoice = "auto"
    light: tuple[float, ...] = ()
    brightness: float | None = None
    crop: tuple[float, ...] = ()
    draws_missing: bool = False
    choice: str = ""
    regions: tuple[KnownRegion, ...] = ()
    active_region: str = ""
    region_count: int = 0
    places: tuple[KnownPlace, ...] = ()
    place_count: int = 0
    value_scale: Scale = "linear"
    opacity_scale: Scale = "linear"
    visible: tuple[float, ...] = ()
    trades: tuple[KnownTrade, ...] = ()
    others: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Remembered:
    """Everything that the window remembers, but for the TFs.

    Attributes
    ----------
    drawing : {"auto", "vtk", "raycast"}
    exactness : int
        Number of one of :data:`app.state.exactness.STEPS`.
    reference_size : None, int or "generator"
        Pixels of the reference image, 16 to 8192; None for as many as its pane has.
    shadows_first : bool
        Whether volumes open in shadows where these do not take long.
    denoises : bool
        Whether path-traced pictures are denoised.
    trackball : bool
        Whether dragging turns views freely.
    legend, scale_bar, cube, opacity_images : bool
        Whether images have a colour legend, a scale bar, an orientation cube, and the opacity
        image.
    decoded_tf : bool
        Whether what a model's codec makes of the TF is drawn over it.
    last_folder : str
        Folder of the last file; empty if there is none.
    window_geometry : str
        Qt's bytes in base64; empty if unknown.
    splitters : dict of tuple of int
        Sizes by the splitter's name.
    swapped : bool
        Whether the two images have changed places.
    theme : {"system", "dark", "light"}
    single_keys : bool
        Whether letters alone are keys of the window.
    recent_volumes, recent_models, recent_transfer_functions, recent_sessions : tuple of str
        Absolute paths, the newest first.
    volumes : dict of KnownVolume
        By fingerprint, the one opened last at the end.
    others : dict
        What this version does not know, to be kept.
    """

    drawing: Drawing = "auto"
    exactness: int = USUAL
    reference_size: ReferenceSize = None
    shadows_first: bool = True
    denoises: bool = True
    trackball: bool = False
    colors_follow_modes: bool = True
    legend: bool = False
    scale_bar: bool = False
    cube: bool = True
    opacity_images: bool = False
    decoded_tf: bool = False
    last_folder: str = ""
    window_geometry: str = ""
    splitters: dict[str, tuple[int, ...]] = field(default_factory=dict)
    hidden_panes: tuple[str, ...] = ()
    swapped: bool = False
    theme: ThemeChoice = "system"
    single_keys: bool = True
    recent_volumes: tuple[str, ...] = ()
    recent_models: tuple[str, ...] = ()
    recent_transfer_functions: tuple[str, ...] = ()
    recent_sessions: tuple[str, ...] = ()
    volumes: dict[str, KnownVolume] = field(default_factory=dict)
    others: dict[str, Any] = field(default_factory=dict)

    def with_changes(self, changes: dict[str, Any]) -> Remembered:
        """Return a copy with some values changed.

        Raises
        ------
        ValueError
            For a name that there is not, or a value outside its range.
        """
        return replace(self, **{name: checked(CHECKS, name, v) for name, v in changes.items()})

    def to_json(self) -> dict[str, Any]:
        """Return the values as plain data."""
        data = asdict(self)
        data["volumes"] = {
            fingerprint: _with_others(volume) for fingerprint, volume in data["volumes"].items()
        }
        return {"tfscope_preferences": FORMAT_VERSION, **_with_others(data)}

    @classmethod
    def from_json(cls, data: Any) -> Remembered:
        """Rebuild values from :meth:`to_json`'s data; each wrong one is its default.

        Raises
        ------
        ValueError
            When it is not such data at all.
        """
        if not isinstance(data, dict) or "tfscope_preferences" not in data:
            raise ValueError("it does not hold tfscope's settings")
        rest = {name: value for name, value in data.items() if name != "tfscope_preferences"}
        if data["tfscope_preferences"] == 1:
            _name_shadows(rest)
        return cls(**valid_values(CHECKS, rest))


def _name_shadows(data: dict[str, Any]) -> None:
    """Call "global" light what it was drawn as, in place: the ray caster's was another one."""
    name = "soft" if data.get("drawing") == "raycast" else "shadows"
    volumes = data.get("volumes")
    for volume in volumes.values() if isinstance(volumes, dict) else ():
        if isinstance(volume, dict) and volume.get("lighting") == "global":
            volume["lighting"] = name


def _with_others(data: dict[str, Any]) -> dict[str, Any]:
    """Put what this version does not know beside what it knows."""
    known = {name: value for name, value in data.items() if name != "others"}
    return {**data["others"], **known}


def _known_volumes(value: Any) -> dict[str, KnownVolume]:
    """Take what is known of volumes, without those of which it is malformed."""
    if not isinstance(value, dict):
        raise ValueError("it must have names")
    known = {}
    for fingerprint, each in list(value.items())[-MOST_VOLUMES:]:
        if isinstance(each, KnownVolume):
            known[fingerprint] = each
        elif isinstance(each, dict):
            known[fingerprint] = KnownVolume(**valid_values(VOLUME_CHECKS, each))
    return known


_flag = one_of(False, True)
_lighting = one_of("none", "direct", "soft", "shadows", "path")
_recent = list_of(text, MOST_RECENT)


def _view(value: Any) -> tuple[float, ...]:
    """Check that a value is empty or has the numbers of a view."""
    numbers = list_of(number(-1e9, 1e9), 6)(value)
    if numbers:
        try:
            View(*numbers)
        except (TfscopeError, TypeError) as error:
            raise ValueError(str(error)) from None
    return numbers


def _light(value: Any) -> tuple[float, ...]:
    """Check that a value is empty or has the angles of a light."""
    angles = list_of(number(-180, 180), 2)(value)
    if len(angles) == 1:
        raise ValueError("it must have two angles")
    return angles


def _crop(value: Any) -> tuple[float, ...]:
    """Check that a value is empty or has the planes of a crop box."""
    planes = list_of(number(0.0, 1.0), 6)(value)
    if planes:
        try:
            CropBox(planes[:3], planes[3:])
        except (TfscopeError, ValueError) as error:
            raise ValueError(str(error)) from None
    return planes


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


def _place(value: Any) -> KnownPlace:
    """Take a named TF, or raise ValueError."""
    if isinstance(value, KnownPlace):
        return value
    if not isinstance(value, dict):
        raise ValueError("it must have names")
    try:
        TransferFunction.from_json(value.get("tf"))
    except TfscopeError as error:
        raise ValueError(str(error)) from None
    place = list_of(number(-1e9, 1e9), 2)(value.get("place", (0.0, 0.0)))
    if len(place) != 2:
        raise ValueError("it must have two coordinates")
    name, picture = text(value.get("name")), base64_text(value.get("picture", ""))
    return KnownPlace(name, value["tf"], place, picture)


def _trade(value: Any) -> KnownTrade:
    """Take a measurement, or raise ValueError."""
    if isinstance(value, KnownTrade):
        return value
    if not isinstance(value, dict):
        raise ValueError("it must have names")
    image = list_of(number(0.0, 1e6), 3)
    images = list_of(image, MOST_IMAGES)(value.get("images"))
    if not images or any(len(each) != 3 for each in images):
        raise ValueError("it must have images of three numbers")
    return KnownTrade(
        text(value.get("machine")),
        _lighting(value.get("lighting")),
        one_of(*RENDERER_NAMES)(value.get("renderer")),
        number(1.0, 1e6)(value.get("size")),
        whole_number(1, 10**9)(value.get("scenes")),
        number(0.0, 1e6)(value.get("seconds")),
        number(0.0, 1.0)(value.get("error")),
        tuple((scale, seconds, error) for scale, seconds, error in images),
    )


def _visible(value: Any) -> tuple[float, ...]:
    """Check that a value is empty or a range."""
    ends = list_of(number(-1e300, 1e300), 2)(value)
    if ends and not (len(ends) == 2 and ends[0] < ends[1]):
        raise ValueError("it must have a lower and a higher end")
    return ends


VOLUME_CHECKS: Checks = {
    "path": text,
    "up_axis": one_of("", "+x", "-x", "+y", "-y", "+z", "-z"),
    "raw_layout": text,
    "choice": text,
    "models": _recent,
    "view": _view,
    "lighting": either(one_of("auto"), _lighting),
    "light": _light,
    "brightness": either(one_of(None), number(0.25, 4.0)),
    "crop": _crop,
    "draws_missing": _flag,
    "regions": valid_of(_region, MOST_MARKS),
    "active_region": text,
    "region_count": whole_number(0, 10**9),
    "places": valid_of(_place, MOST_MARKS),
    "place_count": whole_number(0, 10**9),
    "value_scale": one_of("linear", "logarithmic"),
    "opacity_scale": one_of("linear", "logarithmic"),
    "visible": _visible,
    "trades": valid_of(_trade, MOST_TRADES),
}

CHECKS: Checks = {
    "drawing": one_of("auto", *RENDERER_NAMES),
    "exactness": whole_number(0, len(STEPS) - 1),
    "reference_size": either(one_of(None, "generator"), whole_number(16, 8192)),
    "shadows_first": _flag,
    "denoises": _flag,
    "trackball": _flag,
    "colors_follow_modes": _flag,
    "legend": _flag,
    "scale_bar": _flag,
    "cube": _flag,
    "opacity_images": _flag,
    "decoded_tf": _flag,
    "last_folder": text,
    "window_geometry": base64_text,
    "splitters": dict_of(list_of(whole_number(0, 1_000_000), 20), 50),
    "hidden_panes": list_of(text, 20),
    "swapped": _flag,
    "theme": one_of("system", "dark", "light"),
    "single_keys": _flag,
    "recent_volumes": _recent,
    "recent_models": _recent,
    "recent_transfer_functions": _recent,
    "recent_sessions": _recent,
    "volumes": _known_volumes,
}


def changed_volume(known: KnownVolume, changes: dict[str, Any]) -> KnownVolume:
    """Return what is known of a volume with some values changed.

    Raises
    ------
    ValueError
        For a name that there is not, or a wrong value.
    """
    return replace(known, **{name: checked(VOLUME_CHECKS, name, v) for name, v in changes.items()})
