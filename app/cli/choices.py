"""Choices among names on the command line that model/ has no name for."""

from __future__ import annotations

from typing import Literal

from model.scene.scene import RendererName

Renderer = Literal[RendererName, "generator"]
"""Renderers of a single image."""

ReferenceRenderer = Literal["auto", RendererName]
"""Renderers of the window's reference image."""

SensitivityEngine = Literal["exact", "learned", "blockwise"]
"""Engines that differentiate."""

FieldScale = Literal["own", "global"]
"""Colour scales of a value's field."""

StudyName = Literal["baselines", "latent-dim", "l1-weight"]
"""The paper's studies."""

PaperItem = Literal[
    "all",
    "teaser",
    "overview",
    "sensitivity",
    "value-fields",
    "exploration",
    "interpolation",
    "qualitative",
    "table1",
    "table2",
    "baselines",
    "latent-dim",
    "l1-weight",
]
"""The paper's figures and tables."""

Device = Literal["auto", "cpu", "cuda"]
"""Devices that networks run on."""

Backend = Literal["auto", "eager", "compiled", "openvino", "onnxruntime"]
"""Backends of generators."""

Precision = Literal["auto", "float32", "bfloat16"]
"""Precisions of networks."""

Preset = Literal["draft", "compact", "large", "paper"]
"""Presets of network and image sizes."""

CodecKind = Literal["plain", "contractive", "variational"]
"""Kinds of codecs, see :class:`model.training.codec_training.CodecDesign`."""


def minutes_of(minutes: float | None, samples: int | None, default: float) -> float | None:
    """The budget in minutes: the default where no budget is given at all."""
    return default if minutes is None and samples is None else minutes
