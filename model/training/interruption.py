"""Ctrl-C as a wish that is heard between two steps.

A step that is torn apart cannot be resumed exactly: the discriminator may have
moved already and the generator not.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType


class Interruption:
    """Context manager that takes note of the first Ctrl-C instead of raising.

    The second one raises :class:`KeyboardInterrupt` at once, wherever the
    program is. Signals arrive in the main thread only, and those that somebody
    else handles or ignores stay theirs: elsewhere nothing is ever asked.

    Attributes
    ----------
    asked : bool
        Whether Ctrl-C has been pressed.
    """

    def __init__(self) -> None:
        self.asked = False
        self._installed = False

    def __enter__(self) -> Interruption:
        main = threading.current_thread() is threading.main_thread()
        if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._note)
            self._installed = True
        return self

    def __exit__(self, *error: object) -> None:
        self._release()

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        self._release()

    def _release(self) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            self._installed = False
