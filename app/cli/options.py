"""Options shared by several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import values
from model.networks.names import DeviceChoice, PrecisionChoice
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.region import Region
from model.scene.scene import Lighting, TFFamily
from model.scene.value_scale import ValueScale
from model.scene.view import View

VolumeFile = Annotated[
    Path | None,
    typer.Option(
        "--volume",
        help="Volume file or DICOM folder. (default: one that ships)",
        callback=values.volume,
    ),
]
VolumeFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--volume",
        help="Volume file; may be repeated. (default: the shipped ones)",
        callback=values.volumes,
    ),
]
RawLayoutText = Annotated[
    str | None,
    typer.Option(
        "--raw",
        metavar="LAYOUT",
        help="Of a headerless file: dimensions, type and byte order, "
        "such as 256x256x110_uint16_big. (default: from its name)",
    ),
]
ComponentName = Annotated[
    str | None,
    typer.Option(
        "--component",
        metavar="N|magnitude",
        help="What to take where each voxel has several numbers.",
    ),
]
SeriesName = Annotated[
    str | None,
    typer.Option(
        "--series",
        metavar="NAME|N",
        help="Which series, image or stack of a file or folder; info lists them. "
        "(default: the largest)",
    ),
]
ArrayName = Annotated[
    str | None,
    typer.Option(
        "--array",
        metavar="NAME|N",
        help="Which array of a file. (default: the largest that is no mask or list of ids)",
    ),
]
TimeName = Annotated[
    str | None,
    typer.Option("--time", metavar="NAME|N", help="Which time step, from 0. (default: the first)"),
]
ChannelName = Annotated[
    str | None,
    typer.Option("--channel", metavar="NAME|N", help="Which channel. (default: the first)"),
]
ScalarRange = Annotated[
    str | None,
    typer.Option(
        "--range",
        metavar="LO,HI",
        help="Scalar range over which TFs lie, in the data's units, or LO%,HI% for percentiles "
        "of the voxels. Values beyond look as those at its ends do. (default: that of --tf, or "
        "of the voxels without outliers)",
        callback=values.scalar_range,
    ),
]
ScaleName = Annotated[
    ValueScale | None,
    typer.Option(
        "--scale",
        help="Scale of the scalar axis: values as they are, or their logarithm. "
        "(default: that of --tf, or linear)",
    ),
]
ModelFolder = Annotated[
    Path | None,
    typer.Option("--model", help="Folder of a trained model.", callback=values.model),
]
PictureSize = Annotated[
    int, typer.Option("--size", min=16, max=4096, help="Width and height in pixels.")
]
DeviceName = Annotated[DeviceChoice, typer.Option("--device", help="Where networks run.")]
TrainingPrecisionName = Annotated[
    PrecisionChoice,
    typer.Option(
        "--precision", help="Digits that steps are computed in. (auto: the faster one here)"
    ),
]
LightingName = Annotated[
    Lighting,
    typer.Option(
        "--lighting",
        help="Emission-absorption alone, gradient shading, shadows and ambient light from a "
        "grid (ray caster), or light scattered many times (path tracer).",
    ),
]
LightAngles = Annotated[
    LightDirection | None,
    typer.Option(
        "--light",
        metavar="AZ,EL",
        parser=values.light,
        help="Direction to the light in degrees: to the right of the view and above it. "
        "(default: the model's, or -30,30)",
    ),
]
MovableLight = Annotated[
    bool,
    typer.Option(
        "--movable-light", help="Draw the light's direction at random: models can follow it."
    ),
]
FAMILY_HELP = (
    "Random opacity TFs: the paper's mixtures of Gaussian modes, or also ramps, plateaus, steps, "
    "bands, free curves, constants and empty ones, as people draw them."
)
TFFamilyName = Annotated[TFFamily, typer.Option("--tf-family", help=FAMILY_HELP)]
VIEW_HELP = (
    "Degrees, and the distance in units of the one at which the whole volume is in view: 1 is "
    "the farthest that models are trained for, 0.4 the nearest. X,Y puts the volume's centre "
    "beside the image's, in halves of its height."
)
ViewNumbers = Annotated[
    View,
    typer.Option(
        "--view",
        metavar="AZ,EL,ROLL,DIST[,X,Y]",
        help=VIEW_HELP,
        parser=values.view,
        show_default="30,20,0,1",
    ),
]
CropPlanes = Annotated[
    CropBox | None,
    typer.Option(
        "--crop",
        metavar="X0,X1,Y0,Y1,Z0,Z1",
        help="Show a box of the volume only, in fractions of its length along each axis. "
        "(default: 0,1,0,1,0,1)",
        parser=values.crop_box,
    ),
]
RegionEdges = Annotated[
    Region | None,
    typer.Option(
        "--region",
        metavar="X0,Y0,X1,Y1",
        help="Where in the TF does this rectangle of pixels react? (default: the whole image)",
        parser=values.region,
    ),
]
TFFile = Annotated[
    Path | None,
    typer.Option(
        "--tf",
        metavar="TF.json",
        help="Transfer function. (default: from the data)",
        callback=values.tf,
    ),
]
Window = Annotated[
    str | None,
    typer.Option(
        "--window",
        metavar="LO,HI",
        help="Scalar values between which random opacity modes lie. (default: from the data)",
    ),
]
UpAxis = Annotated[
    str | None,
    typer.Option(
        "--up",
        metavar="AXIS",
        help="Axis of the volume that points up in the samples' views: +x, -x, +y, -y, +z or -z. "
        "(default: as the file says, or +z)",
        callback=values.up_axis,
    ),
]
JsonFile = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="OUT.json",
        help="Also write the result.",
        callback=values.output(".json"),
    ),
]
StoreFolder = Annotated[
    Path | None,
    typer.Option(
        "--dataset",
        metavar="STORE",
        help="Samples made with 'dataset'. (default: rendered by this command)",
        callback=values.store,
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        "--workers",
        min=1,
        help="Processes that render; in training, threads. (default: one per core)",
    ),
]
Seed = Annotated[
    int,
    typer.Option(
        "--seed",
        min=0,
        help="The same seed gives the same samples, and on one CPU the same training; GPUs add "
        "up in another order each time.",
    ),
]
