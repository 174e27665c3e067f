"""What crosses the threads between the window and its engines: plain, frozen data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene


@dataclass(frozen=True)
class RenderRequest:
    """One image wanted from an engine.

    Attributes
    ----------
    sequence : int
        Grows with every request of the window; its result carries the same.
    inputs : SceneInputs
    size : int
        Width and height in pixels; a generator keeps its own size.
    live : bool
        True while the user is still dragging: sooner matters more than finer.
    """

    sequence: int
    inputs: SceneInputs
    size: int
    live: bool


@dataclass(frozen=True, eq=False)
class RenderResult:
    """The answer to a request: an image or an error, never both.

    Attributes
    ----------
    sequence : int
    live : bool
    image : ndarray of float32, shape (S, S, 4), or None
        RGBA in [0, 1], colour premultiplied on black, row 0 at the top.
    error : str or None
        One sentence for the user.
    seconds : float
        Time that the engine took.
    """

    sequence: int
    live: bool
    image: NDArray[np.float32] | None
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


def error_sentence(error: BaseException) -> str:
    """Return what to tell the user about an exception.

    Our own errors are sentences already. Of any other, which is a defect, the
    type is said too.
    """
    if isinstance(error, TfscopeError):
        return str(error)
    return f"Unexpected {type(error).__name__}: {error}"
