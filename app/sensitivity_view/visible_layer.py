"""What is visible of each value, as an area in the plot, with values and shares at its peaks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPoint, QRect
from PySide6.QtGui import QColor

from app import theme
from app.state.sensitivity_asker import SensitivityAsker
from app.tf_editor.plot_area import PlotArea, label_font
from model.scene.tf_perturbation import edit_over
from model.scene.transfer_function import Range
from model.scene.value_text import value_text
from model.sensitivity.contributions import contributions, percentages

STALE = 0.4
"""Opacity of what is not of the present image."""

HEIGHT = 0.38
"""Height of the highest peak, as a fraction of the plot's."""

NAMED_FROM = 0.2
"""Share of what is visible from which a peak says its value."""


class VisibleLayer:
    """Draws how much of the active region, or of the whole image, each value makes up."""

    def __init__(self, area: PlotArea, asker: SensitivityAsker) -> None:
        self._area, self._asker, self._state = area, asker, asker.state
        self._curve: Any = pg.PlotCurveItem(fillLevel=0, antialias=True)
        self._curve.setZValue(-5)
        area.back.addItem(self._curve, ignoreBounds=True)
        self._labels: list[Any] = []
        self._peaks: list[tuple[float, float]] = []
        self.recolor()

    @property
    def is_marked_stale(self) -> bool:
        """Whether what is shown is known not to be of the present image."""
        return bool(self._curve.opacity() < 1)

    @property
    def peak_texts(self) -> list[str]:
        """What the named peaks say, from the strongest on."""
        return [label.toPlainText() for label in self._labels if label.isVisible()]

    def share_of(self, values: Range, scalar_range: Range, width: float) -> float | None:
        """Return the part of all that is visible that a band of values makes up, if known."""
        answer = self._asker.visibility
        if answer is None:
            return None
        part = answer.value[0].astype(np.float64)
        edit = edit_over(values, scalar_range, width)
        return float((part * edit).sum() / edit.max() / max(float(part.sum()), 1e-9))

    def refresh(self) -> None:
        """Draw the newest answer."""
        answer, choices = self._asker.visibility, self._asker.asked.choices
        is_shown = answer is not None and choices.shown and choices.visible
        self._curve.setVisible(is_shown)
        peaks: list[tuple[float, float]] = []
        if answer is not None and is_shown:
            opacity = answer.request.inputs.opacity_tf
            scalar_range = opacity.scalar_range
            part = answer.value[0].astype(np.float64)
            heights = HEIGHT * part / max(float(part.max()), 1e-9)
            self._area.draw(self._curve, heights, scalar_range)
            if self._state.live:
                # The labels rest until the hand does.
                self.mark_stale()
                return
            bins = np.linspace(*scalar_range, len(heights))
            found = contributions(answer.value[0], scalar_range)
            shares = zip(found, percentages(found), strict=True)
            named = [(one, percent) for one, percent in shares if one.share >= NAMED_FROM]
            peaks = [(one.value, float(np.interp(one.value, bins, heights))) for one, _ in named]
            texts = [
                f"{value_text(one.value, scalar_range, opacity.scale)} · {percent} %"
                for one, percent in named
            ]
            while len(self._labels) < len(texts):
                self._labels.append(self._new_label())
            for label, text in zip(self._labels, texts, strict=False):
                label.setText(text)
        self._peaks = peaks
        self.mark_stale()
        self.place_labels()

    def mark_stale(self) -> None:
        """Dim what is not of the present image."""
        answer = self._asker.visibility
        fresh = answer is not None and answer.is_of(self._state.inputs)
        for item in (self._curve, *self._labels):
            item.setOpacity(1.0 if fresh else STALE)

    def _new_label(self) -> Any:
        label = pg.TextItem(anchor=(0.5, 1.0))
        font = label_font()
        font.setBold(True)
        label.setFont(font)
        label.setZValue(85)
        self._color_label(label)
        self._area.opacity.addItem(label, ignoreBounds=True)
        return label

    def place_labels(self) -> None:
        """Put each above its peak, or higher where it would cover a handle, a card or another."""
        area = self._area
        taken = [*area.handle_boxes(), *area.card_boxes()]
        for number, label in enumerate(self._labels):
            label.setVisible(number < len(self._peaks))
            if number >= len(self._peaks):
                continue
            value, top = self._peaks[number]
            place = area.axis.place(value)
            label.setVisible(0.0 <= place <= 1.0)
            size = label.boundingRect().size().toSize()
            plot, at = area.rect, area.pixel(area.opacity, place, top)
            left = min(max(at.x() - size.width() // 2, plot.left()), plot.right() - size.width())
            box = QRect(QPoint(left, at.y() - size.height()), size)
            while any(box.intersects(other) for other in taken) and box.top() > plot.top():
                box.translate(0, -2)
            if label.isVisible():
                taken.append(box)
            corner = area.widget.mapToScene(QPoint(box.center().x(), box.bottom()))
            label.setPos(area.opacity.mapSceneToView(corner))

    def recolor(self) -> None:
        """Take the colours of the theme."""
        fill = QColor(theme.VISIBLE)
        fill.setAlphaF(0.6)
        self._curve.setBrush(fill)
        self._curve.setPen(pg.mkPen(theme.VISIBLE, width=1.2))
        for label in self._labels:
            self._color_label(label)

    def _color_label(self, label: Any) -> None:
        """Write in green on a ground of its own, as areas of any colour lie behind."""
        ground = QColor(theme.PLOT)
        ground.setAlpha(170)
        label.setColor(theme.VISIBLE)
        label.fill = pg.mkBrush(ground)
