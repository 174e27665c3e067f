"""Errors whose messages are meant for users.

Each message is one plain sentence that says what is wrong, where, and what to do about it. The
command line prints it, with suggested settings as options, and exits with code 2; the window shows
it and continues. Any other exception that escapes is a defect of tfscope.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec


class TfscopeError(Exception):
    """Base of all errors whose message is for the user, in the command line and the window.

    Keyword arguments are suggested settings by name; an empty string is a switch.
    """

    def __init__(self, message: str = "", **suggested: str) -> None:
        super().__init__(message)
        self.suggested = suggested


def first_line(error: Exception) -> str:
    """Return the first line of a library's error message, or the error's type if it has none."""
    # A KeyError's text is in quotes.
    said = error.args[0] if isinstance(error, KeyError) and error.args else error
    return next(iter(str(said).splitlines()), "") or type(error).__name__


EXTRAS = {
    "evaluate": {"ot": "POT", "flip_evaluator": "flip-evaluator", "sklearn": "scikit-learn"},
    "maps": {"sklearn": "scikit-learn"},
    "movies": {"imageio_ffmpeg": "imageio-ffmpeg"},
    "openvino": {"openvino": "openvino"},
    "cluster": {"distributed": "distributed"},
}
"""Packages of ``pyproject.toml``'s extras, by module."""


def missing(extra: str) -> str | None:
    """Return the command that installs an extra's missing packages, as a clause, or None."""
    packages = [package for module, package in EXTRAS[extra].items() if find_spec(module) is None]
    if not packages:
        return None
    return (
        f"{' and '.join(packages)} must be installed by: "
        f"{sys.executable} -m pip install {' '.join(packages)}"
    )


def require(extra: str) -> None:
    """Raise :class:`TfscopeError` unless an extra of ``pyproject.toml`` is installed."""
    if (clause := missing(extra)) is not None:
        raise TfscopeError(f"For this {clause}")


def reason(error: OSError) -> str:
    """Return why the system, or a library, could not read or write."""
    return error.strerror or first_line(error)


@contextmanager
def os_errors_as(kind: type[TfscopeError], what: str, remedy: str = "") -> Iterator[None]:
    """Convert an :class:`OSError` to an error for users: what failed, and why."""
    try:
        yield
    except OSError as error:
        why = f"{what} ({reason(error)})"
        raise kind(f"{why}; {remedy}." if remedy else f"{why}.") from error


class VolumeError(TfscopeError):
    """A volume file cannot be read, or has no usable volume."""


class TransferFunctionError(TfscopeError):
    """A transfer function, or its file, is invalid."""


class RenderError(TfscopeError):
    """An image, a figure or a movie cannot be rendered as requested, or not be written."""


class CannotDrawError(RenderError):
    """The renderer cannot draw this volume here; another one may."""


class DatasetError(TfscopeError):
    """A sample store is missing, foreign, or made for another scene."""


class CheckpointError(TfscopeError):
    """A model folder is missing, truncated, foreign, or of another version."""


class TrainingError(TfscopeError):
    """A training run cannot start, resume, or go on."""


class CollapseError(TrainingError):
    """A training run was stopped because the generator collapsed."""


class NotOfferedError(TfscopeError):
    """An engine does not support the requested kind of result."""


class LatentError(TfscopeError):
    """Latent codes, their map, or a search in it cannot be used."""
