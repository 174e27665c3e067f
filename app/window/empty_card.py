"""Card of a window without a volume: opens a file, or a volume that ships with tfscope."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSize, Qt
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QToolButton, QVBoxLayout

from app.engines.client import EngineState
from app.window.context import Context
from app.window.files import Files
from model.volume_files.shipped import picture_of, shipped_volumes, title_of

PICTURE = 72
"""Side of a sample's picture, in pixels."""

EDGE = 8
"""Least distance to the edges of the image, in pixels."""


class EmptyCard(QFrame):
    """Lies in the middle of the reference's image once a first volume could not be read."""

    def __init__(self, context: Context, files: Files) -> None:
        super().__init__(context.reference.canvas)
        self._pane, self._workspace = context.reference, context.workspace
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        title = QLabel("Drop a volume here, or")
        title.setProperty("role", "title")
        self.open = QPushButton("Open…")
        self.open.setToolTip("Open a volume's file (Ctrl+O)")
        self.open.clicked.connect(files.ask_and_open)
        head = QHBoxLayout()
        head.addWidget(title)
        head.addWidget(self.open)
        head.addStretch()
        pictures = QHBoxLayout()
        self.samples: list[QToolButton] = []
        for path in shipped_volumes():
            sample = QToolButton()
            sample.setText(title_of(path))
            sample.setAccessibleName(f"Open the sample volume {title_of(path)}")
            sample.setIcon(QIcon(str(picture_of(path))))
            sample.setIconSize(QSize(PICTURE, PICTURE))
            sample.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextUnderIcon)
            sample.clicked.connect(lambda _on=False, path=path: files.open_volume(path))
            self.samples.append(sample)
            pictures.addWidget(sample)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 8, 12, 8)
        column.addLayout(head)
        column.addLayout(pictures)
        self.hide()
        self._pane.canvas.installEventFilter(self)
        self._pane.client.stateChanged.connect(self._follow)
        self._workspace.opening.reading.connect(
            lambda name: self._follow(EngineState.LOADING) if name else None
        )

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Stay in the middle of the image."""
        if event.type() == QEvent.Type.Resize and not self.isHidden():
            self._place()
        return False

    def _follow(self, state: EngineState) -> None:
        shown = state is EngineState.FAILED and self._workspace.opened is None
        self.setVisible(shown)
        self._pane.canvas.below_message = self if shown else None
        if shown:
            self._place()

    def _place(self) -> None:
        self.adjustSize()
        room = self._pane.canvas.size() - self.size()
        top = min(room.height() // 2 + self.height() // 4, room.height() - EDGE)
        self.move(max(room.width() // 2, 0), max(top, 0))
        self.raise_()
