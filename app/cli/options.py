"""Options shared by several commands, and the conversion of their values."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from model.errors import TfscopeError
from model.scene.scene import Lighting, RendererName, TFFamily
from model.scene.transfer_function import Range

if TYPE_CHECKING:
    from model.networks.size import Architecture
    from model.sensitivity.measure import Measure


class LightingOption(StrEnum):
    """The lightings of a scene, for the command line."""

    NONE = "none"
    DIRECT = "direct"
    GLOBAL = "global"


class SensitivityEngine(StrEnum):
    """Engines that differentiate, for the command line."""

    EXACT = "exact"
    LEARNED = "learned"
    BLOCKWISE = "blockwise"


class MeasureOption(StrEnum):
    """Measures of a region's reaction to an edit, for the command line."""

    SIGNED = "signed"
    CHANGE = "change"


class StudyName(StrEnum):
    """The paper's studies, for the command line."""

    BASELINES = "baselines"
    LATENT_DIM = "latent-dim"
    L1_WEIGHT = "l1-weight"


class Renderer(StrEnum):
    """Renderers of a single image, for the command line."""

    VTK = "vtk"
    RAYCAST = "raycast"
    GENERATOR = "generator"


class SampleRenderer(StrEnum):
    """Renderers of training samples, for the command line."""

    VTK = "vtk"
    RAYCAST = "raycast"


class Device(StrEnum):
    """Devices that networks run on, for the command line."""

    AUTO = "auto"
    CPU = "cpu"
    CUDA = "cuda"


class BackendOption(StrEnum):
    """Backends of generators, for the command line."""

    AUTO = "auto"
    EAGER = "eager"
    COMPILED = "compiled"
    OPENVINO = "openvino"
    ONNXRUNTIME = "onnxruntime"


class PrecisionOption(StrEnum):
    """Precisions of generators, for the command line."""

    FLOAT32 = "float32"
    BFLOAT16 = "bfloat16"


class TrainingPrecision(StrEnum):
    """Precisions of training, for the command line."""

    AUTO = "auto"
    FLOAT32 = "float32"
    BFLOAT16 = "bfloat16"


class Preset(StrEnum):
    """Presets of network and image sizes, for the command line."""

    DRAFT = "draft"
    COMPACT = "compact"
    LARGE = "large"
    PAPER = "paper"


class ArchitectureOption(StrEnum):
    """Architectures of generators, for the command line."""

    REFINED = "refined"
    PAPER = "paper"


class TFFamilyOption(StrEnum):
    """Families of random TFs, for the command line."""

    PAPER = "paper"
    DRAWN = "drawn"


class CodecKindOption(StrEnum):
    """Kinds of codecs, see :class:`model.training.codec_training.CodecDesign`."""

    PLAIN = "plain"
    CONTRACTIVE = "contractive"
    VARIATIONAL = "variational"


VolumeFile = Annotated[
    Path | None,
    typer.Option("--volume", help="Volume file or DICOM folder. (default: the shipped jet)"),
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
ModelFolder = Annotated[Path | None, typer.Option("--model", help="Folder of a trained model.")]
DeviceName = Annotated[Device, typer.Option("--device", help="Where the generator runs.")]
BackendName = Annotated[
    BackendOption,
    typer.Option(
        "--backend",
        help="What draws the generator's images. (auto: the fastest here)",
    ),
]
PrecisionName = Annotated[
    PrecisionOption,
    typer.Option("--precision", help="In bfloat16 images come faster and are off by some 1/255."),
]
TrainingPrecisionName = Annotated[
    TrainingPrecision,
    typer.Option(
        "--precision", help="Digits that steps are computed in. (auto: the faster one here)"
    ),
]
LightingName = Annotated[
    LightingOption,
    typer.Option(
        "--lighting",
        help="Emission-absorption alone, gradient shading, or scattering with shadows.",
    ),
]
LightText = Annotated[
    str | None,
    typer.Option(
        "--light",
        metavar="AZ,EL",
        help="Direction to the light in degrees: to the right of the view and above it. "
        "(default: the model's, or -45,45)",
    ),
]
MovableLight = Annotated[
    bool,
    typer.Option(
        "--movable-light", help="Draw the light's direction at random: models can follow it."
    ),
]
TFFamilyName = Annotated[
    TFFamilyOption,
    typer.Option(
        "--tf-family",
        help="Random opacity TFs: the paper's mixtures of Gaussian modes, or also ramps, "
        "plateaus, steps, bands, free curves, constants and empty ones, as people draw them.",
    ),
]
SampleRendererName = Annotated[
    SampleRenderer,
    typer.Option(
        "--renderer",
        help="What renders the samples: the fast ray caster, or VTK. They differ in global "
        "lighting only.",
    ),
]
ViewText = Annotated[
    str,
    typer.Option(
        "--view",
        metavar="AZ,EL,ROLL,DIST",
        help="Degrees, and the distance in units of the one at which the whole volume is in "
        "view: 1 is the farthest that models are trained for, 0.4 the nearest.",
    ),
]
TFFile = Annotated[
    Path | None,
    typer.Option("--tf", metavar="TF.json", help="Transfer function. (default: from the data)"),
]
Window = Annotated[
    str | None,
    typer.Option(
        "--window",
        metavar="LO,HI",
        help="Scalar values between which random opacity modes lie. (default: from the data)",
    ),
]
JsonFile = Annotated[
    Path | None, typer.Option("--json", metavar="OUT.json", help="Also write the result.")
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


def renderer_name(option: StrEnum) -> RendererName:
    """Return the renderer's name of an option."""
    return cast(RendererName, str(option))


def family_name(option: TFFamilyOption) -> TFFamily:
    """Return the TF family of an option."""
    return cast(TFFamily, str(option))


def architecture_name(option: ArchitectureOption | None) -> Architecture | None:
    """Return the architecture of an option; None for the preset's own."""
    return None if option is None else option.value


def lighting(option: LightingOption) -> Lighting:
    """Return the lighting of an option."""
    return cast(Lighting, str(option))


def measure(option: MeasureOption) -> Measure:
    """Return the measure of an option."""
    return cast("Measure", str(option))


def parse_window(text: str | None) -> Range | None:
    """Parse ``"LO,HI"``; None stays None.

    Raises
    ------
    TfscopeError
        When the text is not a pair of numbers.
    """
    if text is None:
        return None
    try:
        lo, hi = (float(part) for part in text.split(","))
    except ValueError:
        raise TfscopeError(
            f"'{text}' is not a scalar window; give its lowest and highest value, such as 0.1,0.9."
        ) from None
    return lo, hi


def minutes_of(minutes: float | None, samples: int | None, default: float) -> float | None:
    """The budget in minutes: the default where no budget is given at all."""
    return default if minutes is None and samples is None else minutes
