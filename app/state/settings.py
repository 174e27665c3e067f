"""Settings of the window and memory of a volume, which are kept between runs."""

from dataclasses import dataclass, field, fields
from typing import Annotated, Literal, TypeVar

from msgspec import Meta

from app.engines.exactness import USUAL, Stop
from app.engines.requests import Drawing
from app.state.sensitivity_state import NamedRegion
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.scene import LightDirection, Lighting
from model.scene.slices import SliceColors
from model.scene.transfer_function import Range, TransferFunction
from model.scene.view import View

ReferenceSize = Literal["generator"] | Annotated[int, Meta(ge=16, le=8192)] | None
"""The generator's number of pixels, a chosen number, or the pane's."""

ThemeChoice = Literal["system", "dark", "light"]  # the window's colours: the system's, or others

BackgroundChoice = Literal["black", "gradient", "white"]  # background of the images

Shown = Literal["both", "generator", "reference"]  # names of the images to show

RecentKind = Literal["volumes", "models", "transfer_functions", "sessions"]


Share = Annotated[float, Meta(ge=0, le=1)]
Place = tuple[Share, Share, Share]  # along x, y and z
_Byte = Annotated[int, Meta(ge=0, le=255)]
_Side = Annotated[int, Meta(ge=0, le=8192)]


@dataclass(frozen=True)
class FigureSettings:
    """Choices of the figure or movie that was saved last."""

    longer_side: _Side = 0  # in pixels, in the image's proportions; 0 for the size on the screen
    own_size: tuple[_Side, _Side] | None = None  # width and height in other proportions
    background: tuple[_Byte, _Byte, _Byte] | Literal["gradient", "window"] | None = "window"
    """The window's, or another; None is a transparent one."""
    legend: bool = False
    scale_bar: bool = False
    samples: Annotated[int, Meta(ge=0, le=4096)] = 0  # of a pixel; 0 for the usual number
    seconds: Annotated[float, Meta(ge=0, le=600)] = 0.0  # of a movie; 0 for a figure
    rate: Annotated[int, Meta(ge=1, le=60)] = 25  # frames a second
    session: bool = True  # whether PNG files hold the session


@dataclass(frozen=True)
class ImageSettings:
    """Settings of the reference's images in all volumes."""

    drawing: Drawing = "auto"
    stop: Stop = USUAL
    reference_size: ReferenceSize = None
    denoises: bool = True


@dataclass(frozen=True)
class SessionSettings(ImageSettings):
    """Settings that a session also holds: how images are drawn, and the overlays."""

    legend: bool = False
    scale_bar: bool = False
    cube: bool = True
    background: BackgroundChoice = "black"
    opacity_images: bool = False
    shown: Shown = "both"
    swapped: bool = False
    slices: bool = False
    large_slice: Annotated[int, Meta(ge=0, le=2)] | None = None  # number of the one shown alone


@dataclass(frozen=True)
class Settings(SessionSettings):
    """All that the window remembers except for single volumes; the newest recent file is first."""

    trackball: bool = False
    colors_follow_modes: bool = True
    last_folder: str = ""
    window_geometry: Annotated[str, Meta(pattern="^[A-Za-z0-9+/=]*$")] = ""
    editor_share: Share | None = None  # of the window's height; None for the usual one
    theme: ThemeChoice = "system"
    single_keys: bool = True
    figure: FigureSettings | None = None
    recent_volumes: tuple[str, ...] = ()
    recent_models: tuple[str, ...] = ()
    recent_transfer_functions: tuple[str, ...] = ()
    recent_sessions: tuple[str, ...] = ()
    places: dict[str, str] = field(default_factory=dict)  # fingerprints by paths, the newest last


T = TypeVar("T")


def part_of(settings: ImageSettings, kind: type[T]) -> T:
    """Return the settings that one of their base classes has."""
    names = [each.name for each in fields(kind)]  # type: ignore[arg-type]
    return kind(**{name: getattr(settings, name) for name in names})


LightingChoice = Literal["auto"] | Lighting
"""A lighting of the reference image; "auto" suits model and machine."""

PlotScale = Literal["linear", "logarithmic"]


@dataclass(frozen=True)
class LookOfB:
    """Light and renderer of the image B; None for those of A."""

    lighting: LightingChoice | None = None
    drawing: Drawing | None = None


@dataclass(frozen=True)
class VolumeMemory:
    """Memory of one volume; None or empty if the user has not chosen.

    A session holds it without path, models and seconds. The layout of a headerless file and the
    choice of a file of several volumes are as :meth:`RawLayout.parse` and :meth:`Choice.parse` read
    them.
    """

    path: str = ""
    models: tuple[str, ...] = ()  # folders of models that were opened with it, the newest first
    tf: TransferFunction | None = None
    tf_b: TransferFunction | None = None  # B's TF; A's is `tf`
    compares: bool = False  # whether B is shown
    pane: Literal["A", "B"] = "A"  # the edited one
    look_b: LookOfB = field(default_factory=LookOfB)
    up_axis: Literal["", "+x", "-x", "+y", "-y", "+z", "-z"] = ""
    raw_layout: str = ""
    choice: str = ""
    view: View | None = None
    lighting: LightingChoice = "auto"
    shows_model: bool | None = None  # whether a model's image was asked for, or left out
    light: LightDirection | None = None
    light_b: LightDirection | None = None  # of B; None for that of A
    brightness: Annotated[float, Meta(ge=0.25, le=32.0)] | None = None
    light_seconds: dict[Lighting, float] = field(default_factory=dict)
    """Seconds per image by light on this machine, for the automatic choice."""
    crop: CropBox | None = None
    clip: ClipPlane | None = None
    interpolates: bool | None = None  # whether values between voxels are interpolated
    draws_missing: bool = False
    mask: str = ""  # name of the mask's file, next to that of the memory or session; "" without one
    regions: tuple[NamedRegion, ...] = ()
    active_region: str = ""  # name of the active one; empty for the whole image
    region_count: Annotated[int, Meta(ge=0, le=10**9)] = 0
    value_scale: PlotScale = "linear"
    opacity_scale: PlotScale = "linear"
    cross_hair: Place | None = None  # in the slices
    slice_colors: SliceColors | None = None
    gray_window: Range | None = None  # of the slices
    visible: Range | None = None  # visible scalar values of the TF's plot
