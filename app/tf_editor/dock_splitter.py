"""The line between the images and the TF editor, which gets a part of the window's height."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QMouseEvent, QResizeEvent
from PySide6.QtWidgets import QSplitter, QSplitterHandle, QWidget

from app.tf_editor.editor import (
    GREATEST_HEIGHT,
    HEADER_HEIGHT,
    LEAST_HEIGHT,
    TransferFunctionEditor,
)

SHARE, SMALL_SHARE = 0.35, 0.25
"""Height of the editor, as a part of the window's and of a small one's, unless it is dragged."""

SMALL_BELOW = 800
"""Height of a window that is not small, in pixels: below are those of laptops."""

HANDLE = 1
"""Height of the line that is dragged, in pixels: Qt takes the mouse next to it, too, 5 in all."""


class _Handle(QSplitterHandle):
    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Bring the usual height back."""
        event.accept()
        splitter = self.splitter()
        assert isinstance(splitter, DockSplitter)
        splitter.reset()


class DockSplitter(QSplitter):
    """Keeps the editor's share of the window's height: the usual one, or the one it is dragged to.

    A double click on the line brings the usual one back.
    """

    shareChanged = Signal()

    def __init__(self, images: QWidget, editor: TransferFunctionEditor) -> None:
        super().__init__(Qt.Orientation.Vertical)
        self.share: float | None = None
        """Part of the window's height that the editor is dragged to; None for the usual one."""
        self.setHandleWidth(HANDLE)
        self.setChildrenCollapsible(False)
        self._editor = editor
        self.addWidget(images)
        self.addWidget(editor)
        self.setStretchFactor(0, 1)
        self.setStretchFactor(1, 0)
        handle = self.handle(1)
        handle.setToolTip(
            "Drag to resize the editor; double-click for its usual height; F9 folds it"
        )
        editor.folded.connect(self._apply)
        self.splitterMoved.connect(lambda *_: self._note())

    def createHandle(self) -> QSplitterHandle:
        """Return the line, which takes double clicks."""
        return _Handle(self.orientation(), self)

    def set_share(self, share: float | None) -> None:
        """Give the editor a part of the window's height; None for the usual one."""
        self.share = share
        self._apply()

    def reset(self) -> None:
        """Give the editor its usual height."""
        self.set_share(None)
        self.shareChanged.emit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the editor's share."""
        super().resizeEvent(event)
        self._apply()

    def _apply(self) -> None:
        whole = self.window().height()
        share = SHARE if whole >= SMALL_BELOW else SMALL_SHARE
        usual = min(max(round(share * whole), LEAST_HEIGHT), GREATEST_HEIGHT)
        height = usual if self.share is None else round(self.share * whole)
        if self._editor.is_folded:
            height = HEADER_HEIGHT
        self.setSizes([max(self.height() - HANDLE - height, 0), height])

    def _note(self) -> None:
        self.share = self.sizes()[1] / max(self.window().height(), 1)
        self.shareChanged.emit()
