"""The interface of engines, which are renderers or trained generators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from app.engines.messages import (
    BatchRequest,
    BlockFieldsRequest,
    DecodedTFRequest,
    FieldRangeRequest,
    ImageRequest,
    PictureRequest,
    RegionSensitivityRequest,
    Request,
    StandInRequest,
    TradeRequest,
    ValueSensitivityRequest,
    ValueVisibilityRequest,
    VisibilityRequest,
    kind_of,
)
from model.errors import NotOfferedError
from model.scene.scene import Scene

Array = NDArray[np.float32]


def always() -> bool:
    """Return True: the answer is wanted."""
    return True


class Engine(Protocol):
    """Interface of engines; each is built, used and closed in one thread.

    Each method returns the array described by its request's class, and raises
    :class:`model.errors.NotOfferedError` if the engine does not support the request. One that
    is told whether its answer is wanted may raise :class:`SupersededError` once it is not.
    """

    @property
    def description(self) -> str:
        """Device and backend, for display; may be empty."""

    @property
    def remark(self) -> str:
        """One sentence on why this one draws, and no other; empty if nothing is to be said."""

    @property
    def by_raycast(self) -> bool:
        """Whether the ray caster draws."""

    @property
    def image_error(self) -> float | None:
        """Estimated RMSE of the last image, infinite if not known yet; None if there is none."""

    @property
    def scene(self) -> Scene | None:
        """Scene that a generator was trained on; None for renderers."""

    @property
    def draws_codes(self) -> bool:
        """Whether images can be drawn from latent codes; False for renderers."""

    def image(self, request: Request, is_wanted: Callable[[], bool] = always) -> Array:
        """Draw one image."""

    def picture(
        self, request: PictureRequest, is_wanted: Callable[[], bool] = always
    ) -> NDArray[np.uint8]:
        """Draw a picture to save."""

    def images(self, request: BatchRequest, is_wanted: Callable[[], bool] = always) -> Array:
        """Draw several images."""

    def region_sensitivity(
        self, request: RegionSensitivityRequest, is_wanted: Callable[[], bool] = always
    ) -> Array:
        """Compute the sensitivity of a region to edits at each scalar value."""

    def value_sensitivity(
        self, request: ValueSensitivityRequest, is_wanted: Callable[[], bool] = always
    ) -> Array:
        """Compute the sensitivity of each pixel to edits at one scalar value."""

    def block_fields(
        self, request: BlockFieldsRequest, is_wanted: Callable[[], bool] = always
    ) -> Array:
        """Compute the sensitivity of blocks to edits at all scalar values."""

    def field_range(
        self, request: FieldRangeRequest, is_wanted: Callable[[], bool] = always
    ) -> Array:
        """Compute the ends of the scale over the fields of many scalar values."""

    def visibility(self, request: VisibilityRequest) -> Array:
        """Compute the visibility of each scalar value in a region."""

    def value_visibility(self, request: ValueVisibilityRequest) -> Array:
        """Compute how much of each pixel shows some scalar values."""

    def latent_images(self, request: BatchRequest) -> Array:
        """Draw images from the request's latent codes."""

    def decoded_tf(self, request: DecodedTFRequest) -> Array:
        """Encode the opacity TF as its latent code, and decode that again."""

    def close(self) -> None:
        """Release the engine's resources."""


def answer(
    engine: Engine, request: Request, is_wanted: Callable[[], bool] = always
) -> NDArray[Any]:
    """Dispatch a request of any kind to an engine's method.

    Parameters
    ----------
    engine : Engine
    request : Request
    is_wanted : callable
        Says whether somebody still waits for the answer.

    Raises
    ------
    NotOfferedError
        For a kind that the engine does not support.
    SupersededError
        When the engine has given up, as nobody waits for the answer.
    """
    match request:
        case ImageRequest() | StandInRequest() | TradeRequest():
            return engine.image(request, is_wanted)
        case PictureRequest():
            return engine.picture(request, is_wanted)
        case BatchRequest() if request.codes:
            return engine.latent_images(request)
        case BatchRequest():
            return engine.images(request, is_wanted)
        case RegionSensitivityRequest():
            return engine.region_sensitivity(request, is_wanted)
        case ValueSensitivityRequest():
            return engine.value_sensitivity(request, is_wanted)
        case BlockFieldsRequest():
            return engine.block_fields(request, is_wanted)
        case FieldRangeRequest():
            return engine.field_range(request, is_wanted)
        case VisibilityRequest():
            return engine.visibility(request)
        case DecodedTFRequest():
            return engine.decoded_tf(request)
        case ValueVisibilityRequest():
            return engine.value_visibility(request)
    raise NotOfferedError(f"No engine answers a request for a {kind_of(request)}.")
