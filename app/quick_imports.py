"""Imports without PySide's look at the source of each module."""

from __future__ import annotations

import sys

import PySide6.QtCore  # noqa: F401 - it loads the module that is changed here


def leave_sources_unread() -> None:
    """Keep PySide from reading the source of every module that is imported from now on.

    It looks there for a wish for snake-case names. That takes half a second of the start, and
    20 MB. A PySide without such a function is left as it is.
    """
    features = sys.modules.get("shibokensupport.feature")
    if hasattr(features, "_mod_uses_pyside"):
        features._mod_uses_pyside = lambda _module: False  # type: ignore[union-attr]
