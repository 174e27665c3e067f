"""The errors that a user of tfscope may meet.

Each carries one plain sentence that says what was wrong, where, and what to
do about it, and may suggest settings by name. The command line prints it, with
the suggestions as options, and exits with code 2; the window shows it and goes
on working. Anything else that escapes is a defect of ours.
"""

from __future__ import annotations


class TfscopeError(Exception):
    """Base of every error whose message is meant for the user.

    Parameters
    ----------
    message : str
        In words that fit the command line and the window alike.
    **suggested : str
        Settings that would help, by name; an empty text stands for a switch.

    Attributes
    ----------
    suggested : dict of str
    """

    def __init__(self, message: str = "", **suggested: str) -> None:
        super().__init__(message)
        self.suggested = suggested


def first_line(error: Exception) -> str:
    """What a library's error says first, for a sentence of ours; its type where it says nothing."""
    return next(iter(str(error).splitlines()), "") or type(error).__name__


class VolumeError(TfscopeError):
    """A volume file cannot be read, or holds no usable volume."""


class ViewError(TfscopeError):
    """A view's numbers are malformed or outside their ranges."""


class TransferFunctionError(TfscopeError):
    """A transfer function, or the file that holds one, is invalid."""


class RenderError(TfscopeError):
    """The reference renderer cannot run on this machine or for this scene."""


class DatasetError(TfscopeError):
    """A sample store is missing, foreign, or made for another scene."""


class CheckpointError(TfscopeError):
    """A model folder is missing, truncated, foreign, or of another version."""


class DeviceError(TfscopeError):
    """The requested compute device is not there."""


class TrainingError(TfscopeError):
    """A training run cannot start, resume, or go on."""


class CollapseError(TrainingError):
    """A training run was stopped because nothing good can come of it any more."""


class NotOfferedError(TfscopeError):
    """An engine cannot answer this kind of question."""
