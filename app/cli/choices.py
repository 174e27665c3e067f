"""Choices among names on the command line that model/ has no name for."""

from __future__ import annotations

from typing import Literal

from model.networks.names import StudyName
from model.scene.scene import RendererName

Renderer = Literal[RendererName, "generator"]
"""Renderers of a single image."""

ReferenceRenderer = Literal["auto", RendererName]
"""Renderers of the window's reference image."""

SensitivityEngine = Literal["exact", "learned", "blockwise"]
"""Engines that differentiate."""

FieldScale = Literal["own", "global"]
"""Colour scales of a value's field."""

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
    StudyName,
]
"""The paper's figures and tables."""


def minutes_of(minutes: float | None, samples: int | None, default: float) -> float | None:
    """The budget in minutes: the default where no budget is given at all."""
    return default if minutes is None and samples is None else minutes
