"""Answers to questions about sensitivities, with who gave them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.engines.requests import (
    RegionSensitivityRequest,
    Request,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
)
from model.scene.inputs import SceneInputs
from model.sensitivity.display import shown_responses

Source = Literal["exact", "surrogate", "learned"]
"""Origin of an answer: the ray caster's derivative, that of another light in place of path-traced
light's, or the generator."""

_R = TypeVar("_R", bound=Request)


@dataclass(frozen=True, eq=False)
class Answer(Generic[_R]):
    """An engine's answer."""

    request: _R
    value: NDArray[np.float32]
    source: Source

    def is_of(self, inputs: SceneInputs) -> bool:
        """Whether it is about the image of these inputs."""
        return self.request.inputs == inputs


RegionAnswer = Answer[RegionSensitivityRequest]
FieldAnswer = Answer[ValueSensitivityRequest]
ValueVisibilityAnswer = Answer[ValueVisibilityRequest]
VisibilityAnswer = Answer[VisibilityRequest]


def same_question(one: Answer[Any] | None, other: Answer[Any] | None) -> bool:
    """Whether two engines answered the same question about the same image."""
    if one is None or other is None:
        return False
    return bool(replace(one.request, quality=other.request.quality) == other.request)


def displayed(answer: RegionAnswer) -> NDArray[np.float64]:
    """Return a region's responses (256,) in the displayed unit."""
    request = answer.request
    pixels = int(request.region.mask(request.quality.pixels.shape).sum())
    return shown_responses(answer.value, pixels, request.width)
