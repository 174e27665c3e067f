"""The choice of pane A or B for editing, and the wipe line between both in one image."""

from typing import cast

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QFocusEvent, QMouseEvent
from PySide6.QtWidgets import QWidget

from app.controls import BY_KEYS, Painted
from app.image_view.engine_pane import EnginePane
from app.image_view.image_canvas import ImageCanvas
from app.state.edited_tf import EditedTF, PaneName

GRIP = 9  # width next to the wipe line that takes the mouse, in pixels
LEAST_SHARE = 0.02  # of the width that is left to either image


class WipeLine(QWidget):
    """The draggable wipe line in A's image: B's image is to its right."""

    is_shown = Painted(False, "_place")  # B's image is to its right; without it, A's is everywhere

    def __init__(self, tf_input: EditedTF, pane: EnginePane, pane_b: EnginePane) -> None:
        super().__init__(pane.canvas)
        self._tf_input, self._canvas = tf_input, pane.canvas
        self._pane, self._pane_b = pane, pane_b
        self._of_b = pane_b.canvas, pane_b.caption
        self.share = 0.5  # of the width that is A's
        self.setCursor(Qt.CursorShape.SplitHCursor)
        self.setToolTip("Drag to see more of A or of B")
        self.hide()
        pane.canvas.resized.connect(self._place)
        # B's own canvas is hidden.
        pane_b.statusShown.connect(self._canvas.update)
        for widget in (pane.canvas, pane.caption, *self._of_b):
            widget.installEventFilter(self)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the line with the mouse."""
        self.put(self.mapTo(self._canvas, event.position()).x() / max(self._canvas.width(), 1))

    def put(self, share: float) -> None:
        """Give A this share of the width, within limits."""
        self.share = min(max(share, LEAST_SHARE), 1 - LEAST_SHARE)
        self._place()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take the mouse, which would otherwise turn the view."""
        event.accept()

    def _place(self) -> None:
        canvas = self._canvas
        self.setVisible(self.is_shown)
        at = round(self.share * canvas.width())
        self.setGeometry(at - GRIP // 2, 0, GRIP, canvas.height())
        canvas.wiped = (self._pane_b.canvas, at) if self.is_shown else None
        self._pane.place_caption(canvas)
        self._pane_b.place_caption(canvas if self.is_shown else self._pane_b.canvas)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Note which pane is meant, and pass the event on."""
        kind = event.type()
        by_keys = kind == QEvent.Type.FocusIn and cast(QFocusEvent, event).reason() in BY_KEYS
        if isinstance(watched, ImageCanvas) and kind == QEvent.Type.MouseButtonPress:
            watched.gave_focus = False
        if self._tf_input.compares and (kind == QEvent.Type.MouseButtonPress or by_keys):
            is_b = watched in self._of_b
            if watched is self._canvas and not by_keys and self.is_shown:
                x = cast(QMouseEvent, event).position().x()
                is_b = x > self.share * self._canvas.width()
            pane: PaneName = "B" if is_b else "A"
            if isinstance(watched, ImageCanvas):
                watched.gave_focus = pane != self._tf_input.pane
            self._tf_input.focus(pane)
        return False
