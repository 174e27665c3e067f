"""A bar at the top of the window for errors and important notices."""

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
        """The displayed sentence; empty if there is none."""
        return self._label.text()

    def tell(self, text: str) -> None:
        """Show a sentence, replacing the present one."""
        self._label.setText(text)
        self.show()

    def clear(self) -> None:
        """Clear and hide the bar."""
        self._label.clear()
        self.hide()
