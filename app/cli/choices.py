"""Choices among names on the command line, and what they are called in model/."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, cast

from model.scene.scene import Lighting, RendererName, TFFamily
from model.scene.value_scale import ValueScale

if TYPE_CHECKING:
    from model.latent.codes import PictureOf
    from model.sensitivity.measure import Measure


class LightingOption(StrEnum):
    """The lightings of a scene, for the command line."""

    NONE = "none"
    DIRECT = "direct"
    SOFT = "soft"
    SHADOWS = "shadows"
    PATH = "path"


class ScaleOption(StrEnum):
    """The scales of the scalar axis, for the command line."""

    LINEAR = "linear"
    LOG = "log"


class SensitivityEngine(StrEnum):
    """Engines that differentiate, for the command line."""

    EXACT = "exact"
    LEARNED = "learned"
    BLOCKWISE = "blockwise"


class MeasureOption(StrEnum):
    """Measures of a region's reaction to an edit, for the command line."""

    SIGNED = "signed"
    CHANGE = "change"


class FieldScaleOption(StrEnum):
    """Colour scales of a value's field, for the command line."""

    OWN = "own"
    GLOBAL = "global"


class PictureOption(StrEnum):
    """Subject of a latent code's picture, for the command line."""

    CODE = "code"
    TF = "tf"


class StudyName(StrEnum):
    """The paper's studies, for the command line."""

    BASELINES = "baselines"
    LATENT_DIM = "latent-dim"
    L1_WEIGHT = "l1-weight"


class PaperItem(StrEnum):
    """The paper's figures and tables, for the command line."""

    ALL = "all"
    TEASER = "teaser"
    OVERVIEW = "overview"
    SENSITIVITY = "sensitivity"
    VALUE_FIELDS = "value-fields"
    EXPLORATION = "exploration"
    INTERPOLATION = "interpolation"
    QUALITATIVE = "qualitative"
    TABLE1 = "table1"
    TABLE2 = "table2"
    BASELINES = "baselines"
    LATENT_DIM = "latent-dim"
    L1_WEIGHT = "l1-weight"


class Renderer(StrEnum):
    """Renderers of a single image, for the command line."""

    VTK = "vtk"
    RAYCAST = "raycast"
    GENERATOR = "generator"


class ReferenceOption(StrEnum):
    """Renderers of the window's reference image, for the command line."""

    AUTO = "auto"
    VTK = "vtk"
    RAYCAST = "raycast"


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

    AUTO = "auto"
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


class TFFamilyOption(StrEnum):
    """Families of random TFs, for the command line."""

    PAPER = "paper"
    DRAWN = "drawn"


class CodecKindOption(StrEnum):
    """Kinds of codecs, see :class:`model.training.codec_training.CodecDesign`."""

    PLAIN = "plain"
    CONTRACTIVE = "contractive"
    VARIATIONAL = "variational"


def renderer_name(option: StrEnum) -> RendererName:
    """Return the renderer's name of an option."""
    return cast(RendererName, str(option))


def family_name(option: TFFamilyOption) -> TFFamily:
    """Return the TF family of an option."""
    return cast(TFFamily, str(option))


def lighting(option: LightingOption) -> Lighting:
    """Return the lighting of an option."""
    return cast(Lighting, str(option))


def scale(option: ScaleOption | None) -> ValueScale | None:
    """Return the scale of an option; None stays None."""
    return None if option is None else cast(ValueScale, str(option))


def measure(option: MeasureOption) -> Measure:
    """Return the measure of an option."""
    return cast("Measure", str(option))


def picture_of(option: PictureOption | None) -> PictureOf | None:
    """Return what is to be drawn of a latent code; None for what a model usually draws."""
    return None if option is None else option.value


def minutes_of(minutes: float | None, samples: int | None, default: float) -> float | None:
    """The budget in minutes: the default where no budget is given at all."""
    return default if minutes is None and samples is None else minutes
