"""A line at the top of the window for what must not be overlooked."""

from __future__ import annotations

from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QWidget


class NoticeBar(QFrame):
    """Shows one sentence until the user dismisses it; hidden otherwise."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "notice")
        self._label = QLabel()
        self._label.setWordWrap(True)
        dismiss = QPushButton("Dismiss")
        dismiss.clicked.connect(self.clear)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 8, 8, 8)
        layout.addWidget(self._label, 1)
        layout.addWidget(dismiss)
        self.hide()

    @property
    def text(self) -> str:
        """The sentence that is shown, empty when there is none."""
        return self._label.text()

    def tell(self, text: str) -> None:
        """Show a sentence instead of any other."""
        self._label.setText(text)
        self.show()

    def clear(self) -> None:
        """Show nothing."""
        self._label.clear()
        self.hide()
