"""The states of an engine client, and which may follow which."""

from __future__ import annotations

from enum import Enum


class EngineState(Enum):
    """What can be expected of an engine.

    The values are the words that tests and logs use.
    """

    EMPTY = "empty"
    """There is no engine yet."""
    WAITING = "waiting"
    """Something else has to come first, such as a volume."""
    LOADING = "loading"
    """The engine is being built; requests wait for it."""
    WORKING = "working"
    """The newest image is on its way."""
    SETTLED = "settled"
    """The newest final image is there."""
    PAUSED = "paused"
    """The engine takes no requests, for a reason that is no error."""
    FAILED = "failed"
    """There is an error instead of the newest image."""


_S = EngineState

TRANSITIONS: dict[EngineState, frozenset[EngineState]] = {
    _S.EMPTY: frozenset({_S.WAITING, _S.LOADING, _S.PAUSED, _S.FAILED}),
    _S.WAITING: frozenset({_S.EMPTY, _S.LOADING, _S.WORKING, _S.PAUSED, _S.FAILED}),
    _S.LOADING: frozenset({_S.EMPTY, _S.WAITING, _S.WORKING, _S.SETTLED, _S.PAUSED, _S.FAILED}),
    _S.WORKING: frozenset({_S.EMPTY, _S.WAITING, _S.LOADING, _S.SETTLED, _S.PAUSED, _S.FAILED}),
    _S.SETTLED: frozenset({_S.EMPTY, _S.WAITING, _S.LOADING, _S.WORKING, _S.PAUSED, _S.FAILED}),
    _S.PAUSED: frozenset({_S.EMPTY, _S.WAITING, _S.LOADING, _S.WORKING, _S.FAILED}),
    _S.FAILED: frozenset({_S.EMPTY, _S.WAITING, _S.LOADING, _S.WORKING, _S.PAUSED, _S.SETTLED}),
}
"""The states that may follow each, beside itself."""

SETTLED_STATES = frozenset({_S.SETTLED, _S.PAUSED, _S.FAILED})
"""Those in which nothing more is to be expected."""
