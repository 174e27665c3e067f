"""What is seen of a file that takes long to be saved, with the button that ends it."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QProgressDialog, QWidget


class SaveProgress(QProgressDialog):
    """Shows how far the saving of a file has got, until it is ended.

    Parameters
    ----------
    title, text : str
        Of the window, and what is done.
    steps : int
        Their number.
    cancel : callable
        Called when the user does not want the file any more.
    """

    def __init__(
        self, title: str, text: str, steps: int, cancel: Callable[[], object], parent: QWidget
    ) -> None:
        super().__init__(text, "Cancel", 0, steps, parent)
        self.setWindowTitle(title)
        self.setMinimumDuration(0)
        # The last step is not the end, and when it closes by itself it says that it was cancelled.
        self.setAutoClose(False)
        self.setAutoReset(False)
        self.canceled.connect(cancel)
        self.setValue(0)

    def end(self) -> None:
        """Close without a word."""
        self.blockSignals(True)
        self.close()
        self.deleteLater()
