"""Imports without PySide's look at the source of each module."""

from __future__ import annotations

import sys

import PySide6.QtCore  # noqa: F401 - it loads the module that is changed here


def leave_sources_unread() -> None:
    """Keep PySide from reading the source of every module that is imported from now on.

    It looks for its own name in them, to offer snake-case names to those that ask for them,
    which none does here. In the sources of torch, numba and SciPy that takes half a second of
    the window's start, and 20 MB, as Python keeps all that it has read. A PySide that has no
    such function just goes on.
    """
    features = sys.modules.get("shibokensupport.feature")
    if hasattr(features, "_mod_uses_pyside"):
        features._mod_uses_pyside = lambda _module: False  # type: ignore[union-attr]
