"""A label at the clicked place of an image, with the values that show there."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel

from app import theme
from app.icons import IconButton
from app.image_view.image_canvas import ImageCanvas
from app.state.sensitivity_asker import SensitivityAsker
from model.scene.ranges import range_text
from model.sensitivity.peaks import contributions, percentages

AWAY = 14
"""Distance from the place to the right and downwards, in pixels."""

EDGE = 4
"""Least distance from the canvas's edges, in pixels."""


class PlaceLabel(QFrame):
    """Names the values at the place that was clicked in this canvas; it moves nothing else."""

    def __init__(
        self, canvas: ImageCanvas, asker: SensitivityAsker, open_panel: Callable[[], object]
    ) -> None:
        super().__init__(canvas)
        self._canvas, self._asker = canvas, asker
        self.is_here = False
        """Whether it was this canvas that was clicked."""
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.text = QLabel()
        self.button = IconButton("panel", "Values and edits", "F8", colors=theme.ON_IMAGE)
        self.button.clicked.connect(lambda: open_panel())
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 3, 3, 3)
        row.setSpacing(8)
        row.addWidget(self.text)
        row.addWidget(self.button, 0, Qt.AlignmentFlag.AlignTop)
        self.hide()
        canvas.installEventFilter(self)

    def refresh(self) -> None:
        """Show the values at the place; until they are known, say so."""
        asker, place = self._asker, self._asker.asked.place
        # A place that was clicked in a wider image has no values in this one.
        is_seen = self.is_here and place is not None and self._canvas.has_place(place)
        if not (is_seen and asker.asked.choices.shown):
            self.hide()
            return
        lines: list[tuple[str, str]] = []
        if asker.pick is not None:
            scalar_range, scale = asker.state.scalar_range, asker.state.scale
            found = contributions(asker.pick.value[0], scalar_range)
            lines = [
                (range_text(one.reach, scalar_range, scale), f"{percent} %")
                for one, percent in zip(found, percentages(found), strict=True)
            ]
        rows = "".join(
            f"<tr><td>{values}</td><td align='right' style='padding-left: 12px'>{part}</td></tr>"
            for values, part in lines
        )
        nothing = "computing …" if asker.pick is None else "Nothing visible here"
        self.text.setText(f"<table>{rows}</table>" if rows else nothing)
        said = ", ".join(" ".join(line) for line in lines)
        self.setAccessibleName(f"Values here: {said or nothing}")
        self._place()
        self.show()
        self.raise_()

    def eventFilter(self, _canvas: QObject, event: QEvent) -> bool:
        """Stay at the place when the canvas has another size."""
        if event.type() == QEvent.Type.Resize and self.is_here:
            self.refresh()
        return False

    def _place(self) -> None:
        place = self._asker.asked.place
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
