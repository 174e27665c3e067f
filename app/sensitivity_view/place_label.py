"""A label at the clicked place of an image, with the values that show there."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel

from app import theme
from app.icons import IconButton
from app.image_view.image_canvas import ImageCanvas
from app.state.sensitivity_answers import VisibilityAnswer
from app.state.sensitivity_asker import SensitivityAsker
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.scene.value_text import range_text
from model.sensitivity.contributions import contributions, percentages

AWAY = 14
"""Distance from the place to the right and downwards, in pixels."""

EDGE = 4
"""Least distance from the canvas's edges, in pixels."""


class PlaceLabel(QFrame):
    """Names the values at the place that was clicked in this canvas; it moves nothing else."""

    openRequested = Signal()
    """Emitted when the panel with these values is to be opened."""

    def __init__(
        self,
        canvas: ImageCanvas,
        state: ViewerState,
        sensitivity: SensitivityState,
        asker: SensitivityAsker,
    ) -> None:
        super().__init__(canvas)
        self._canvas, self._state = canvas, state
        self._sensitivity, self._asker = sensitivity, asker
        self._is_here = False
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.text = QLabel()
        self.button = IconButton("panel", "Values and edits", "F8", colors=theme.ON_IMAGE)
        self.button.clicked.connect(self.openRequested)
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 3, 3, 3)
        row.setSpacing(8)
        row.addWidget(self.text)
        row.addWidget(self.button, 0, Qt.AlignmentFlag.AlignTop)
        self.hide()
        canvas.installEventFilter(self)
        sensitivity.placeChanged.connect(lambda _place: self.refresh())
        sensitivity.choicesChanged.connect(lambda _choices: self.refresh())
        asker.visibilityAnswered.connect(self.refresh)

    def come(self, is_here: bool) -> None:
        """Say whether this canvas is the one that was clicked."""
        self._is_here = is_here
        self.refresh()

    def refresh(self) -> None:
        """Show the values at the place; until they are known, say so."""
        has_place = self._is_here and self._sensitivity.place is not None
        if not (has_place and self._sensitivity.choices.shown):
            self.hide()
            return
        answer = self._asker.pick
        lines = [] if answer is None else self._lines(answer)
        rows = "".join(
            f"<tr><td>{values}</td><td align='right' style='padding-left: 12px'>{part}</td></tr>"
            for values, part in lines
        )
        nothing = "computing …" if answer is None else "Nothing shows here"
        self.text.setText(f"<table>{rows}</table>" if rows else nothing)
        said = ", ".join(" ".join(line) for line in lines)
        self.setAccessibleName(f"Values here: {said or nothing}")
        self._place()
        self.show()
        self.raise_()

    def _lines(self, answer: VisibilityAnswer) -> list[tuple[str, str]]:
        """Return values and shares, in words."""
        scalar_range, scale = self._state.scalar_range, self._state.scale
        found = contributions(answer.value[0], scalar_range)
        return [
            (range_text(one.reach, scalar_range, scale), f"{percent} %")
            for one, percent in zip(found, percentages(found), strict=True)
        ]

    def eventFilter(self, _canvas: QObject, event: QEvent) -> bool:
        """Stay at the place when the canvas has another size."""
        if event.type() == QEvent.Type.Resize and not self.isHidden():
            self._place()
        return False

    def _place(self) -> None:
        place = self._sensitivity.place
        if place is None:
            return
        self.adjustSize()
        rect, canvas = self._canvas.image_rect, self._canvas
        x = round(rect.left() + place[0] * rect.width()) + AWAY
        y = round(rect.top() + place[1] * rect.height()) + AWAY
        self.move(
            max(min(x, canvas.width() - self.width() - EDGE), EDGE),
            max(min(y, canvas.height() - self.height() - EDGE), EDGE),
        )
