"""What is visible of each value, as an area in the plot, and the band that is asked about."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QFrame, QGraphicsRectItem, QHBoxLayout, QLabel

from app import theme
from app.icons import IconButton
from app.sensitivity_view.findings_panel import AddButton
from app.sensitivity_view.response_layer import STALE
from app.state.sensitivity_asker import SensitivityAsker
from app.tf_editor.plot_area import PlotArea, label_font
from model.scene.ranges import value_text
from model.scene.tf_perturbation import edit_over
from model.scene.transfer_function import Range
from model.sensitivity.peaks import contributions, percentages

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
        cards, covered = area.card_boxes(), False
        taken = [*area.handle_boxes(), *cards]
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
                covered |= any(box.intersects(card) for card in cards)
                taken.append(box)
            corner = area.widget.mapToScene(QPoint(box.center().x(), box.bottom()))
            label.setPos(area.opacity.mapSceneToView(corner))
        if covered:
            # No room was left above the peak, so the card of numbers gives way.
            area.flagsMoved.emit()

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


TAG_HEIGHT, KEPT_HEIGHT = 20, 26
"""Heights of the tag: without its buttons, and with them."""


class BandTag(QFrame):
    """Says what a band shows; once it is kept, it has buttons to add a mode and to let it go."""

    def __init__(self, area: PlotArea, add: Callable[[bool], object]) -> None:
        super().__init__(area.widget.viewport())
        self.setProperty("role", "tag")
        # Between its buttons, the mouse is not the plot's.
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.text = QLabel()
        self.add = AddButton("the kept values", add)
        self.release = IconButton("close", "Release these values", "Esc")
        self._row = row = QHBoxLayout(self)
        row.setContentsMargins(8, 0, 4, 0)
        row.setSpacing(4)
        for button in (self.add, self.release):
            button.setFixedHeight(KEPT_HEIGHT - 2)
        for part in (self.text, self.add, self.release):
            row.addWidget(part)
        self.hide()

    def show_band(self, text: str, color: str, is_kept: bool) -> None:
        """Show a text, on the colour of what it means."""
        self.text.setText(text)
        self.text.setStyleSheet(f"color: {color};")
        for button in (self.add, self.release):
            button.setVisible(is_kept)
        # Under the mouse, it would take the plot's place.
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents, not is_kept)
        self.setFixedHeight(KEPT_HEIGHT if is_kept else TAG_HEIGHT)
        self._row.activate()
        self.adjustSize()
        self.show()
        self.raise_()


class BandLayer:
    """Draws the band: green where it is visible, blue what an edit of it would change."""

    def __init__(
        self,
        area: PlotArea,
        asker: SensitivityAsker,
        visible: VisibleLayer,
        add: Callable[[bool], object],
    ) -> None:
        self._area, self._visible = area, visible
        self._state, self._asked = asker.state, asker.asked
        self._asks_edit = False
        self._rect = QGraphicsRectItem()
        self._rect.setZValue(50)
        self._rect.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
        area.opacity.addItem(self._rect, ignoreBounds=True)
        self.tag = BandTag(area, add)
        self.tag.release.clicked.connect(lambda: asker.asked.unpin())
        self.refresh()

    @property
    def text(self) -> str:
        """The tag's text; empty without a band."""
        return "" if self.tag.isHidden() else self.tag.text.text()

    def ask_edit(self, asks: bool) -> None:
        """Say that an edit at the band is asked for, as by What if, whatever the mouse asks."""
        if asks != self._asks_edit:
            self._asks_edit = asks
            self.refresh()

    def refresh(self) -> None:
        """Draw the present band, or none."""
        band, choices = self._asked.band, self._asked.choices
        is_shown = band is not None and choices.shown
        self._rect.setVisible(is_shown)
        if band is None or not is_shown:
            self.tag.hide()
            return
        scalar_range = self._state.scalar_range
        # From where the edit has half of its height, to where it has so again.
        edit = edit_over(band.values, scalar_range, choices.width)
        inside = np.flatnonzero(edit >= edit.max() / 2)
        values = np.linspace(*scalar_range, len(edit))[inside[[0, -1]]]
        left, right = self._area.axis.places(values).clip(0.0, 1.0).tolist()
        color = QColor(theme.CHANGE if band.effect or self._asks_edit else theme.VISIBLE)
        self._rect.setPen(pg.mkPen(color, width=1))
        color.setAlpha(50)
        self._rect.setBrush(color)
        self._rect.setRect(left, 0.0, right - left, 1.0 + self._area.headroom)
        self._show_tag((left + right) / 2)

    def _show_tag(self, place: float) -> None:
        band, scalar_range = self._asked.band, self._state.scalar_range
        assert band is not None
        one, other = (value_text(v, scalar_range, self._state.scale) for v in band.values)
        text = one if one == other else f"{one} to {other}"
        asks_edit = band.effect or self._asks_edit
        if asks_edit:
            text = f"edit at {text}"
        else:
            width = self._asked.choices.width
            share = self._visible.share_of(band.values, scalar_range, width)
            text += "" if share is None else f" · {_percent(share)} of what is visible"
        color = theme.CHANGE if asks_edit else theme.VISIBLE
        self.tag.show_band(text, color, band.pinned and not self._asked.dragging)
        plot, width = self._area.rect, self.tag.width()
        left = self._area.pixel(self._area.opacity, place, 0.0).x() - width // 2
        left = min(max(left, plot.left()), max(plot.right() - width, plot.left()))
        self.tag.move(left, self._free_height(left))

    def _free_height(self, left: int) -> int:
        """Height, from the plot's top on, at which the tag covers neither flags nor the card."""
        plot, size = self._area.rect, self.tag.size()
        others = [box for box in self._area.card_boxes() if box != self.tag.geometry()]
        taken = [*others, *self._area.handle_boxes(), *self._area.label_boxes()]
        lowest = plot.bottom() + 1 - size.height()
        heights = range(plot.top(), lowest + 1, 4)
        return next(
            (
                y
                for y in heights
                if not any(QRect(QPoint(left, y), size).intersects(box) for box in taken)
            ),
            plot.top(),
        )


def _percent(share: float) -> str:
    """Whole percent; what shows a little is not said to show nothing."""
    return "under 1 %" if 0.0005 <= share < 0.005 else f"{100 * share:.0f} %"
