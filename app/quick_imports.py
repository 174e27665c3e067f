"""Faster imports: PySide reads no sources."""

import sys

import PySide6.QtCore  # noqa: F401 - it loads the module that is changed here


def leave_sources_unread() -> None:
    """Keep PySide from reading the source of every module that is imported from now on.

    It searches them for an option of snake-case names, which takes half a second and 20 MB. A
    PySide without that function is left as it is.
    """
    features = sys.modules.get("shibokensupport.feature")
    if hasattr(features, "_mod_uses_pyside"):
        features._mod_uses_pyside = lambda _module: False  # type: ignore[union-attr]
