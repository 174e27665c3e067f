"""The states of an engine client and their transitions."""

from __future__ import annotations

from enum import Enum


class EngineState(Enum):
    """State of an engine client.

    The values are used by tests and logs.
    """

    EMPTY = "empty"
    """There is no engine yet."""
    WAITING = "waiting"
    """The engine waits for something else, such as a volume."""
    LOADING = "loading"
    """The engine is being built; requests wait for it."""
    WORKING = "working"
    """The newest image is being drawn."""
    SETTLED = "settled"
    """The newest final image is available."""
    PAUSED = "paused"
    """The engine accepts no requests, for a reason that is not an error."""
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
"""Allowed next states of each state, besides itself."""

SETTLED_STATES = frozenset({_S.SETTLED, _S.PAUSED, _S.FAILED})
"""States in which no further result is expected."""
