"""Text in pictures, for which Qt wants an application even where no window is opened."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PySide6.QtCore import QCoreApplication

_kept: list[QCoreApplication] = []


def fonts() -> None:
    """Make Qt's fonts available, without a display."""
    from PySide6.QtWidgets import QApplication

    if QApplication.instance() is None:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
        _kept.append(QApplication(["tfscope"]))
