"""Options that several commands share, and how their texts are understood."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, cast

import typer

from model.errors import TfscopeError, VolumeError
from model.scene import Lighting
from model.shipped import DEFAULT_VOLUME, shipped_volumes
from model.transfer_function import Range
from model.volume import Volume
from model.volume_files import read_volume


class LightingOption(StrEnum):
    """The lightings of a scene, for the command line."""

    NONE = "none"
    DIRECT = "direct"
    GLOBAL = "global"


class Renderer(StrEnum):
    """Who renders."""

    VTK = "vtk"
    GENERATOR = "generator"


class Device(StrEnum):
    """Where the generator runs."""

    AUTO = "auto"
    CPU = "cpu"
    CUDA = "cuda"


class Preset(StrEnum):
    """Sizes of networks and images."""

    DRAFT = "draft"
    COMPACT = "compact"
    PAPER = "paper"


VolumeFile = Annotated[
    Path | None,
    typer.Option("--volume", help="Volume file or DICOM folder. [default: the shipped jet]"),
]
ModelFolder = Annotated[Path | None, typer.Option("--model", help="Folder of a trained model.")]
DeviceName = Annotated[Device, typer.Option("--device", help="Where the generator runs.")]
LightingName = Annotated[
    LightingOption,
    typer.Option(
        "--lighting",
        help="Emission-absorption alone, gradient shading, or scattering with shadows.",
    ),
]
Window = Annotated[
    str | None,
    typer.Option(
        "--window",
        metavar="LO,HI",
        help="Scalar values between which random opacity modes lie. [default: from the data]",
    ),
]
Workers = Annotated[
    int | None, typer.Option("--workers", min=1, help="Processes. [default: one per core]")
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="The same seed gives the same result.")]


def lighting(option: LightingOption) -> Lighting:
    """The lighting of an option."""
    return cast(Lighting, str(option))


def parse_window(text: str | None) -> Range | None:
    """Read ``"LO,HI"``."""
    if text is None:
        return None
    try:
        lo, hi = (float(part) for part in text.split(","))
    except ValueError:
        raise TfscopeError(
            f"'{text}' is not a scalar window; give its lowest and highest value, such as 0.1,0.9."
        ) from None
    return lo, hi


def open_volume(path: Path | None) -> Volume:
    """Read a volume, the shipped default when none is named."""
    return read_volume(path or DEFAULT_VOLUME)


def volume_of(fingerprint: str, name: str, path: Path | None) -> Volume:
    """Read the volume that a model was trained on: the one named, or the shipped one.

    Raises
    ------
    VolumeError
        When the named volume is another one, or none is named and none of the
        shipped ones fits.
    """
    if path is not None:
        volume = read_volume(path)
        if volume.fingerprint != fingerprint:
            raise VolumeError(f"{path}: the model was trained on another volume, '{name}'.")
        return volume
    for candidate in shipped_volumes():
        volume = read_volume(candidate)
        if volume.fingerprint == fingerprint:
            return volume
    raise VolumeError(f"The model was trained on '{name}', which is not shipped; give --volume.")
