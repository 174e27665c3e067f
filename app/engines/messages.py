"""Messages between the window and its engines' threads, as plain, frozen data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.engines.requests import Request
from model.errors import TfscopeError
from model.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Result:
    """Result of a request: an array or an error, never both. Several, where images become better.

    Attributes
    ----------
    value : ndarray of float32, or None
        Array of the shape given by the request's class.
    error : str or None
        One sentence for the user.
    seconds : float
        Computation time.
    description, remark : str
        The engine's, which may change as it falls back on another renderer; "" for as before.
    is_last, by_raycast, stands_in, samples
        Of an image; see :class:`app.engines.image.Image`.
    image_error : float or None
        Its `error`, or that of a picture to save.
    """

    request: Request
    value: NDArray[np.float32] | None
    error: str | None
    seconds: float
    description: str = ""
    remark: str = ""
    is_last: bool = True
    by_raycast: bool = False
    stands_in: bool = False
    samples: int = 1
    image_error: float | None = None


@dataclass(frozen=True)
class Progress:
    """Message that a part of an answer is there, 0 to 1."""

    request: Request
    part: float


class SupersededError(Exception):
    """Raised by an engine that gives up an answer nobody waits for any more."""


@dataclass(frozen=True)
class EngineReady:
    """Message that an engine is built and accepts requests.

    Attributes
    ----------
    description : str
        Device and backend, for display; may be empty.
    scene : Scene or None
        Scene that a generator was trained on; None for renderers.
    draws_codes : bool
        Whether it draws images from latent codes.
    remark : str
        One sentence on why this one draws, and no other; may be empty.
    """

    description: str
    scene: Scene | None
    draws_codes: bool = False
    remark: str = ""


@dataclass(frozen=True)
class EngineFailed:
    """Message that an engine could not be built; `error` is one sentence for the user."""

    error: str


Message = EngineReady | EngineFailed | Progress | Result | None
"""Message from a worker's thread; None when the thread has ended."""


def error_sentence(error: BaseException) -> str:
    """Return an exception's message for the user.

    tfscope's own errors are complete sentences. Other exceptions are defects, and
    their type is included.
    """
    if isinstance(error, TfscopeError):
        return str(error)
    return f"Unexpected {type(error).__name__}: {error}"
