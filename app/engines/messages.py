"""Messages between the window and its engines' threads, as plain, frozen data."""

from dataclasses import dataclass

from app.engines.requests import Array, Image, Request
from model.errors import TfscopeError
from model.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Result:
    """One result of a request: an image, another array, or an error; the remark is the engine's."""

    request: Request
    image: Image | None
    error: str | None = None
    remark: str = ""

    @property
    def value(self) -> Array | None:
        """Array of the shape given by the request's class; None for an error."""
        return None if self.image is None else self.image.rgba

    @property
    def seconds(self) -> float:
        """Computation time."""
        return 0.0 if self.image is None else self.image.seconds

    @property
    def is_last(self) -> bool:
        """Whether this is the last result."""
        return self.image is None or self.image.is_last


@dataclass(frozen=True)
class Progress:
    """Message about the progress of an answer, from 0 to 1."""

    request: Request
    part: float


@dataclass(frozen=True)
class EngineReady:
    """Message that an engine is built; see :class:`app.engines.requests.Engine`."""

    scene: Scene | None


@dataclass(frozen=True)
class EngineFailed:
    """Message that an engine could not be built; `error` is one sentence for the user."""

    error: str


Message = EngineReady | EngineFailed | Progress | Result | None  # None when the thread ended


def error_sentence(error: BaseException) -> str:
    """Return the message of an exception for the user.

    tfscope's own errors are complete sentences. Any other exception is a bug, so its type is
    included.
    """
    if isinstance(error, TfscopeError):
        return str(error)
    return f"Unexpected {type(error).__name__}: {error}"
