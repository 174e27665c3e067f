"""What crosses the threads between the window and its engines: plain, frozen data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Scene


@dataclass(frozen=True)
class Quality:
    """How fine an image is to be; a generator keeps its own.

    Attributes
    ----------
    size : int
        Width and height in pixels.
    coarseness : float
        How much farther apart a renderer's samples lie along the rays.
    live : bool
        True while the user is still dragging: sooner matters more than finer.
    """

    size: int
    coarseness: float = 1.0
    live: bool = False


@dataclass(frozen=True)
class Request:
    """Something wanted from an engine; each subclass is a kind with a slot of its own.

    Attributes
    ----------
    sequence : int
        Grows with every request of the window; its result carries the same.
    inputs : SceneInputs
    quality : Quality
    """

    sequence: int
    inputs: SceneInputs
    quality: Quality


@dataclass(frozen=True)
class ImageRequest(Request):
    """One image: float32 (S, S, 4), RGBA in [0, 1], premultiplied on black, row 0 at the top."""


@dataclass(frozen=True)
class BatchRequest(Request):
    """Several images, float32 (N, S, S, 4), of the first inputs and of `more`."""

    more: tuple[SceneInputs, ...] = ()


@dataclass(frozen=True)
class RegionSensitivityRequest(Request):
    """Where in the TF an edit changes a region: float32 (256,).

    Attributes
    ----------
    region : Region
    width : float
        Standard deviation of the edits, in bins of the TF.
    """

    region: Region
    width: float


@dataclass(frozen=True)
class ValueSensitivityRequest(Request):
    """Where in the image an edit of a scalar value shows: float32 (S, S, 3).

    Attributes
    ----------
    value : float
        In the data's units.
    width : float
        Standard deviation of the edit, in bins of the TF.
    """

    value: float
    width: float


@dataclass(frozen=True)
class VisibilityRequest(Request):
    """How much of each scalar value is seen in a region: float32 (256,)."""

    region: Region


@dataclass(frozen=True, eq=False)
class LatentRequest(Request):
    """Images of latent codes, float32 (N, S, S, 4), instead of the inputs' opacity TF.

    Attributes
    ----------
    codes : ndarray of float32, shape (N, latent_dim)
    """

    codes: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Result:
    """The answer to a request: a float array or an error, never both.

    Attributes
    ----------
    request : Request
    value : ndarray of float32, or None
        As the request's kind says.
    error : str or None
        One sentence for the user.
    seconds : float
        Time that the engine took.
    """

    request: Request
    value: NDArray[np.float32] | None
    error: str | None
    seconds: float


@dataclass(frozen=True)
class EngineReady:
    """An engine is built and takes requests.

    Attributes
    ----------
    description : str
        Where it runs, in a word or two; may be empty.
    scene : Scene or None
        The scene that a generator was trained for.
    """

    description: str
    scene: Scene | None


@dataclass(frozen=True)
class EngineFailed:
    """An engine could not be built; `error` is one sentence for the user."""

    error: str


Message = EngineReady | EngineFailed | Result | None
"""What a worker's thread says; None when it has ended."""


def error_sentence(error: BaseException) -> str:
    """Return what to tell the user about an exception.

    Our own errors are sentences already. Of any other, which is a defect, the
    type is said too.
    """
    if isinstance(error, TfscopeError):
        return str(error)
    return f"Unexpected {type(error).__name__}: {error}"


def kind_of(request: Any) -> str:
    """Name of a request's kind, for people: "image", "region sensitivity"."""
    words = type(request).__name__.removesuffix("Request")
    return "".join(f" {c.lower()}" if c.isupper() else c for c in words).strip()
