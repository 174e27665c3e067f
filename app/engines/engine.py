"""What every engine can be asked, be it a renderer or a trained generator."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.engines.messages import (
    BatchRequest,
    ImageRequest,
    LatentRequest,
    RegionSensitivityRequest,
    Request,
    ValueSensitivityRequest,
    VisibilityRequest,
    kind_of,
)
from model.errors import NotOfferedError
from model.scene.scene import Scene

Array = NDArray[np.float32]


class Engine(Protocol):
    """Answers requests: built, used and closed in one and the same thread.

    Each verb returns the array that its request's docstring describes, and raises
    :class:`model.errors.NotOfferedError` where the engine cannot answer.
    """

    @property
    def description(self) -> str:
        """Where it runs, in a word or two; may be empty."""

    @property
    def scene(self) -> Scene | None:
        """The scene that a generator was trained for."""

    def image(self, request: ImageRequest) -> Array:
        """Draw one image."""

    def images(self, request: BatchRequest) -> Array:
        """Draw several images."""

    def region_sensitivity(self, request: RegionSensitivityRequest) -> Array:
        """Say where in the TF an edit changes a region."""

    def value_sensitivity(self, request: ValueSensitivityRequest) -> Array:
        """Say where in the image an edit of a scalar value shows."""

    def visibility(self, request: VisibilityRequest) -> Array:
        """Say how much of each scalar value is seen in a region."""

    def latent_images(self, request: LatentRequest) -> Array:
        """Draw images of latent codes."""

    def close(self) -> None:
        """Free what the engine holds."""


def answer(engine: Engine, request: Request) -> Array:
    """Have an engine answer a request of any kind.

    Raises
    ------
    NotOfferedError
        For a kind that the engine does not answer.
    """
    match request:
        case ImageRequest():
            return engine.image(request)
        case BatchRequest():
            return engine.images(request)
        case RegionSensitivityRequest():
            return engine.region_sensitivity(request)
        case ValueSensitivityRequest():
            return engine.value_sensitivity(request)
        case VisibilityRequest():
            return engine.visibility(request)
        case LatentRequest():
            return engine.latent_images(request)
    raise NotOfferedError(f"No engine answers a request for a {kind_of(request)}.")
