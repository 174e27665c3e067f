"""The views that were looked from: undo and redo of gestures."""

from __future__ import annotations

import time
from collections.abc import Callable

from model.scene.view import View

MOST_VIEWS = 100

MERGE_SECONDS = 1.0
"""Gestures of one kind that follow one another faster count as one."""


class ViewHistory:
    """A list of views with a place in it, apart from the undo steps of the TF.

    Parameters
    ----------
    view : View
        The first one.
    clock : callable
        Returns the time in seconds.
    """

    def __init__(self, view: View, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.start(view)

    def start(self, view: View) -> None:
        """Forget all views but this one."""
        self._views = [view]
        self._place = 0
        self._kind, self._when = "", 0.0

    @property
    def can_undo(self) -> bool:
        """True if there is a view before the present one."""
        return self._place > 0

    @property
    def can_redo(self) -> bool:
        """True if a view was undone."""
        return self._place < len(self._views) - 1

    def record(self, view: View, kind: str = "") -> None:
        """Add a view after the present one, and forget those that were undone.

        Parameters
        ----------
        kind : str
            What led to it, such as ``"zoom"``: steps of one kind in quick succession become
            one. An empty one stands alone.
        """
        now = self._clock()
        if view == self._views[self._place]:
            return
        merged = kind and kind == self._kind and now - self._when < MERGE_SECONDS
        kept = self._views[: self._place + (0 if merged else 1)]
        self._views = [*kept, view][-MOST_VIEWS:]
        self._place = len(self._views) - 1
        self._kind, self._when = kind, now

    def replace(self, view: View) -> None:
        """Put another view in the place of the present one."""
        self._views[self._place] = view

    def undo(self) -> View:
        """Go back by one view, if there is one, and return the present one."""
        return self._go(-1)

    def redo(self) -> View:
        """Go forth by one view, if there is one, and return the present one."""
        return self._go(1)

    def _go(self, step: int) -> View:
        self._place = min(max(self._place + step, 0), len(self._views) - 1)
        self._kind = ""
        return self._views[self._place]
