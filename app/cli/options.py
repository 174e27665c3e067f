"""Commands as dataclasses: each field is an option, with the field's type and default."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, field, fields
from functools import partial
from importlib import import_module
from inspect import Parameter, Signature
from typing import Annotated, Any, get_type_hints

import typer

from app.cli import values
from app.cli.outputs import check_output_folder
from model.networks.card import read_header
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.ranges import RangeChoice
from model.scene.scene import LightDirection
from model.scene.transfer_function import TransferFunction
from model.scene.view import axis_direction

MODEL_RANGE = (
    "A model draws over the range and scale that it was trained on; leave --range and --scale out."
)
REQUIRED = MISSING  # default of an option that must be given


def option(help: str, *, default: Any = None, **details: Any) -> Any:
    """Field that is an option: ``--field-name``, unless `flag` names another one."""
    return field(default=default, metadata=_details(help, **details))


def shared(help: str = "", **details: Any) -> Callable[..., Any]:
    """Return a function that makes an option that several commands share, with changes for each."""
    return partial(option, **{"help": help, **details})


def argument(help: str, **details: Any) -> Any:
    """Field that is a required word without an option's name."""
    return field(metadata=_details(help, flag=None, **details))


def _details(help: str, check: Callable[[Any], object] | None = None, **details: Any) -> Any:
    callback = {} if check is None else {"callback": values.checked(check)}
    return {"help": help, **callback, **details}


def output(help: str, *suffixes: str, default: Any = REQUIRED, **details: Any) -> Any:
    """Option that is an output file with one of some suffixes."""
    return option(help, default=default, check=values.output(*suffixes), **details)


folder = shared(default=REQUIRED, metavar="DIR", check=check_output_folder)
model = shared("Folder of a trained model.", check=read_header)
device = shared("Where networks run.", default="auto")
size = shared("Width and height in pixels.", default=256, min=16, max=4096)
interpolate = shared(
    "Interpolate between voxels. (default: yes, but not for labels; or as in the session)",
    flag="--interpolate/--no-interpolate",
)
lighting = shared(
    "Emission-absorption alone, gradient shading, shadows and ambient light from a grid (ray "
    "caster), or light scattered many times (path tracer).",
    default="none",
)
light = shared(
    "Direction to the light in degrees: to the right of the view and above it. (default: the "
    "model's, or -30,30)",
    metavar="AZ,EL",
    parser=LightDirection.parse,
)
movable_light = shared("Draw the light's direction at random: models can follow it.", default=False)
FAMILY_HELP = (
    "Random opacity TFs: the paper's mixtures of Gaussian modes, or also ramps, plateaus, steps, "
    "bands, free curves, constants and empty ones, as people draw them."
)
VIEW_HELP = (
    "Degrees, and the distance in units of the one at which the whole volume is in view: 1 is "
    "the farthest that models are trained for, 0.4 the nearest. X,Y moves the volume's centre away "
    "from the image's, in halves of its height; orthographic: rays are parallel."
)
view = shared(
    VIEW_HELP,
    default=values.HOME_VIEW,
    metavar="AZ,EL,ROLL,DIST[,X,Y][,orthographic]",
    parser=values.view,
    show_default="30,20,0,1",
)
crop = shared(
    "Show only a box of the volume, in fractions of its length along each axis. (default: "
    "0,1,0,1,0,1)",
    metavar="X0,X1,Y0,Y1,Z0,Z1",
    parser=CropBox.parse,
)
clip = shared(
    "Cut the volume by a plane: its normal points to what is cut away, its offset from the "
    "centre is in halves of the volume's diagonal. (default: no plane)",
    metavar="X,Y,Z[,OFFSET]",
    parser=ClipPlane.parse,
)
tf = shared(
    "Transfer function. (default: from the data)", metavar="TF.json", check=TransferFunction.load
)
window = shared(
    "Scalar values between which random opacity modes lie. (default: from the data)",
    metavar="LO,HI",
    parser=values.scalar_window,
)
up = shared(
    "Axis of the volume that points up in the samples' views: +x, -x, +y, -y, +z or -z. "
    "(default: as the file says, or +z)",
    default="",
    metavar="AXIS",
    check=axis_direction,
    show_default=False,
)
store = shared(
    "Samples made with 'dataset'. (default: rendered by this command)",
    flag="--dataset",
    metavar="STORE",
    check=values.store,
)
workers = shared("Processes that render; in training, threads. (default: one per core)", min=1)
seed = shared(
    "The same seed gives the same samples, and on one CPU the same training; sums on "
    "GPUs are rounded differently each time.",
    default=0,
    min=0,
)

_VOLUME: dict[str, Field[Any]] = {
    "path": option(
        "Volume file or DICOM folder. (default: one that ships)",
        flag="--volume"),
    "raw": option(
        "Layout of a headerless file: dimensions, type and byte order, such as "
        "256x256x110_uint16_big. (default: from its name)",
        metavar="LAYOUT"),
    "component": option(
        "What to take where each voxel has several numbers.", metavar="N|magnitude"),
    "series": option(
        "Which series, image or stack of a file or folder; info lists them. (default: the largest)",
        metavar="NAME|N"),
    "array": option(
        "Which array of a file. (default: the largest that is no mask or list of ids)",
        metavar="NAME|N"),
    "time": option(
        "Which time step, from 0. (default: the first)", metavar="NAME|N"),
    "channel": option("Which channel. (default: the first)", metavar="NAME|N"),
    "spacing": option(
        "Distance of voxels along x, y and z, with a unit if it is known, such as "
        "'0.5,0.5,2 um'. (default: the file's)",
        metavar="X,Y,Z"),
    "stretch": option(
        "Stretch of z: 2 draws it twice as long as its spacing says. (default: 1, or more where "
        "z has another unit than x and y)",
        metavar="FACTOR"),
    "scalar_range": option(
        "Scalar range over which TFs lie, in the data's units, or LO%,HI% for percentiles of the "
        "voxels. Values beyond it look like its ends. (default: that of --tf, or of the voxels "
        "without outliers)",
        flag="--range",
        metavar="LO,HI",
        check=RangeChoice.parse),
    "scale": option(
        "Scale of the scalar axis: values as they are, or their logarithm. (default: that of "
        "--tf, or linear)"),
}  # fmt: skip


def volume(*left_out: str, **others: Any) -> Any:
    """Field that is a :class:`VolumeSource`, whose own fields are options."""
    parts = {name: part for name, part in {**_VOLUME, **others}.items() if name not in left_out}
    return field(metadata={"parts": parts})


def as_function(command: type) -> Callable[..., None]:
    """Return a function for typer: it makes a command's dataclass and calls its ``run``."""
    hints = get_type_hints(command)
    own = {each.name: each for each in fields(command)}
    parameters = [*_parameters(own, hints)]

    def run(**given: Any) -> None:
        for name, each in own.items():
            if "parts" in each.metadata:
                group = hints[name](**{part: given.pop(part) for part in each.metadata["parts"]})
                group.check()
                given[name] = group
        command(**given).run()

    # Typer reads both.
    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__doc__ = command.__doc__
    return run


def _parameters(own: Mapping[str, Field[Any]], hints: dict[str, Any]) -> Iterator[Parameter]:
    for name, each in own.items():
        details = dict(each.metadata)
        if "parts" in details:
            yield from _parameters(details["parts"], get_type_hints(hints[name]))
            continue
        hint = hints[name]
        if details:
            flag = details.pop("flag", f"--{name.replace('_', '-')}")
            # Options with a parser are texts to typer; it would take a tuple for several words.
            kind = str if "parser" in details else hint
            made = typer.Option(flag, **details) if flag else typer.Argument(**details)
            hint = Annotated[kind, made]
        elif hint is not typer.Context:
            continue
        default = Parameter.empty if each.default is MISSING else each.default
        yield Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def late(module: str) -> Any:
    """Import the module that does a command's work; the options are known without it."""
    return import_module(f"app.cli.{module}")


def same_named(options: Any, target: type) -> dict[str, Any]:
    """Return those of a command's options that a dataclass also has as fields."""
    return {
        each.name: getattr(options, each.name)
        for each in fields(target)
        if hasattr(options, each.name)
    }
