"""Layers over the opacity plot: what is visible of each value, and responses with flags."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QBrush, QColor, QKeySequence, QShortcut
from PySide6.QtWidgets import QToolButton, QWidget

from app import theme
from app.number_box import short
from app.placing import freest
from app.sensitivity_view.findings import ROWS, Peaks, displayed_now, of_interest
from app.state.sensitivity_asker import SensitivityAsker
from app.tf_editor.histogram import Curve
from app.tf_editor.plot_area import PlotArea, label_font
from model.scene.ranges import value_text
from model.scene.tf_perturbation import edit_over
from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.display import FLOOR
from model.sensitivity.peaks import contributions, percentages

STALE = 0.4  # opacity of what belongs to another image
FLAG_HEIGHT = 19
FLAG_GAP = 3  # least distance between two flags, in pixels


class PeakFlag(QToolButton):
    """A numbered flag that can be clicked, or reached by Tab and pressed by Enter."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number
        self.setProperty("role", "change flag")
        self.setFixedHeight(FLAG_HEIGHT)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        # Two clicks on a dim flag are no double click in the plot.
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        for key in ("Return", "Enter"):
            QShortcut(QKeySequence(key), self, self.click).setContext(
                Qt.ShortcutContext.WidgetShortcut
            )
        self.say("", "")

    def say(self, effect: str, name: str) -> bool:
        """Show the edit's effect, in words in its name; return whether that has changed."""
        text = f"{self.number}: {effect}".rstrip(": ")
        if (text, name) == (self.text(), self.accessibleName()):
            return False
        self.setText(text)
        self.setAccessibleName(name)
        self.setToolTip(f"{name}\nClick to add a mode here".lstrip())
        self.adjustSize()
        return True


def place_flags(flags: Sequence[QWidget], centers: Sequence[int], plot: QRect) -> None:
    """Put flags at the upper edge of a plot, over their places, side by side."""
    order = sorted(range(len(flags)), key=lambda index: centers[index])
    lefts = [0] * len(flags)
    free = plot.left()
    for index in order:
        width = flags[index].width()
        lefts[index] = max(free, centers[index] - width // 2)
        free = lefts[index] + width + FLAG_GAP
    # Flags that would reach beyond the right edge move back and push their neighbours.
    end = plot.right() + 1
    for index in reversed(order):
        width = flags[index].width()
        lefts[index] = min(lefts[index], end - width)
        end = lefts[index] - FLAG_GAP
    for flag, left in zip(flags, lefts, strict=True):
        flag.move(left, plot.top())


UNIT = "change"  # above the numbers, which are changes by an edit of .01 of opacity


class ResponseLayer:
    """Draws the newest responses over the opacity plot; zero is at half of its height."""

    def __init__(
        self, area: PlotArea, asker: SensitivityAsker, add_mode: Callable[[int], object]
    ) -> None:
        self._area, self._asker = area, asker
        self._state, self._asked = asker.state, asker.asked
        self._view = area.second
        self._limit = FLOOR
        self.peaks, self.holds = Peaks(), False  # whether they keep their order
        self.curves = {name: Curve(area.second) for name in ("exact", "learned")}
        self._zero = pg.InfiniteLine(0, angle=0)
        self._cut = pg.ScatterPlotItem(size=9, pen=None)
        self._stems = pg.PlotCurveItem(connect="pairs")
        self._tops = pg.ScatterPlotItem(size=6, pen=None)
        self._shown: dict[str, tuple[NDArray[np.float64], Range]] = {}
        for item in (self._zero, self._cut, self._stems, self._tops):
            self._view.addItem(item, ignoreBounds=True)
        for curve in self.curves.values():
            curve.hide()
        self.flags = [PeakFlag(number + 1) for number in range(ROWS)]
        for number, flag in enumerate(self.flags):
            flag.clicked.connect(lambda _=False, n=number: add_mode(n))
            flag.hide()
            area.add_flag(flag)
        self._was_shown = asker.asked.shows_curve
        self.recolor()

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Return headings and rows of the curves that are drawn, a row for each scalar value."""
        scalar_range = self._state.scalar_range
        columns = ["Value", *(f"Change if opacity rises by .01, {name}" for name in self._shown)]
        curves = [values for values, _range in self._shown.values()]
        rows = []
        for i, value in enumerate(np.linspace(*scalar_range, TF_SAMPLES)):
            changes = (short(float(curve[i]), 3, signed=True) for curve in curves)
            rows.append([value_text(value, scalar_range, self._state.scale), *changes])
        return columns, rows

    def refresh(self) -> None:
        """Draw the newest responses."""
        asker = self._asker
        self._shown = {}
        for name, source in (("exact", asker.exact_source), ("learned", "learned")):
            answer, curve = asker.regions.get(source), self.curves[name]
            values = displayed_now(asker, answer)
            is_shown = values is not None and self._asked.shows_curve
            curve.setVisible(is_shown)
            if answer is not None and values is not None and is_shown:
                # The TF's range may have changed since it was asked.
                scalar_range = answer.request.inputs.opacity_tf.scalar_range
                self._area.draw(curve, values, scalar_range)
                self._shown[name] = values, scalar_range
        if not self._scale_axis():
            self._mark_cut()
        self.mark_stale()
        # Flags follow once nothing moves.
        if not self._state.live:
            before, self.peaks = self.peaks, self.peaks.of(asker, self.holds)
            if self.peaks != before:
                self._place_flags()

    def say_effects(self, effects: Sequence[tuple[str, str]]) -> None:
        """Write the effect of its edit on each flag, and in words in its name."""
        said = [flag.say(*effect) for flag, effect in zip(self.flags, effects, strict=False)]
        # The plot is not painted again with every view of a drag.
        if any(said):
            self._place_flags()

    def follow_region(self) -> None:
        """Show or hide the curve with the active region."""
        if self._asked.shows_curve != self._was_shown:
            self._was_shown = self._asked.shows_curve
            self.refresh()
            self.fit()
        else:
            self.mark_stale()

    def _scale_axis(self) -> bool:
        """Scale the axis to the highest response of interest; return whether it was scaled."""
        asker = self._asker
        inside = (np.abs(values[of_interest(asker)]) for values, _range in self._shown.values())
        highest = max((float(each.max(initial=0.0)) for each in inside), default=0.0)
        limit = max(1.15 * highest, FLOOR)
        choices = self._asked.choices
        if choices.locked and self._limit > FLOOR:
            limit = self._limit
        elif self._asked.dragging or self._state.live:
            # Only growing: if the scale shrank during a drag, a falling response would not be seen.
            limit = max(limit, self._limit)
        fits_anew = limit != self._limit or not self._state.live
        if fits_anew:
            self._limit = limit
            self.fit()
        return fits_anew

    def fit(self) -> None:
        """Align the scale's ends with those of the opacities."""
        limit, head = self._limit, self._area.headroom
        signed = self._asked.choices.measure == "signed"
        low = -limit if signed else 0.0
        self._view.setYRange(low, limit + head * (limit - low), padding=0)
        is_shown = self._asked.shows_curve and self._area.scale.logarithmic
        self._zero.setVisible(is_shown and signed)
        labels: list[tuple[float, str]] = []
        # Without a curve, there are no numbers.
        if any(curve.isVisible() for curve in self.curves.values()):
            end = round_below(limit)
            numbers = (-end, 0.0, end) if signed else (0.0, end / 2, end)
            places = [(n - low) / (limit - low) / (1.0 + head) for n in numbers]
            texts = [short(n, signed=signed) for n in numbers]
            labels = [*zip(places, texts, strict=True), (1.0 - head / 2, UNIT)]
        self._area.second_labels.set_labels(labels, theme.CHANGE)
        what = "brighter (above 0) or darker" if signed else "size of the change"
        self._area.second_labels.setToolTip(
            "How much the region's pixels (0 to 1) change if a value's opacity rises by .01: "
            f"{what}.\n"
            "An arrow marks where the curve leaves the plot."
        )
        self._mark_cut()
        if self._state.live:
            # The scale does not move the flags, so the handle's card need not move, either.
            self._draw_stems()
        else:
            self._place_flags()

    def _mark_cut(self) -> None:
        """Put an arrow where a curve leaves the plot, one for each part outside."""
        spots = []
        for values, (low, high) in self._shown.values():
            places = self._area.axis.places(np.linspace(low, high, len(values)))
            beyond = (np.abs(values) > self._limit) & (places >= 0) & (places <= 1)
            starts = np.flatnonzero(np.diff(np.concatenate([[0], beyond, [0]])))
            for first, end in starts.reshape(-1, 2):
                at = first + int(np.argmax(np.abs(values[first:end])))
                up = values[at] > 0
                place = places[at], (0.94 if up else -0.94) * self._limit
                symbol = "t1" if up else "t"
                spots.append({"pos": place, "symbol": symbol, "brush": theme.CHANGE})
        self._cut.setData(spots)
        self._cut.setVisible(bool(spots))

    def mark_stale(self) -> None:
        """Dim the curves that are not of the present image."""
        for name, source in (("exact", self._asker.exact_source), ("learned", "learned")):
            fresh = self._asker.is_fresh(self._asker.regions.get(source))
            self.curves[name].setOpacity(1.0 if fresh else STALE)
        fresh = self._asker.is_fresh(self._asker.region)
        for item in (self._stems, self._tops):
            item.setOpacity(1.0 if fresh else STALE)
        for flag in self.flags:
            flag.setEnabled(fresh)

    def recolor(self) -> None:
        """Take the colours of the theme."""
        color = theme.CHANGE
        self.curves["exact"].pen = pg.mkPen(color, width=2)
        dashed = pg.mkPen(color, width=1.6, style=Qt.PenStyle.DashLine)
        self.curves["learned"].pen = dashed
        self._zero.setPen(pg.mkPen(theme.LINE, width=1, style=Qt.PenStyle.DotLine))
        self._stems.setPen(pg.mkPen(color, width=1))
        self._tops.setBrush(pg.mkBrush(color))
        self.fit()

    def _place_flags(self) -> None:
        area = self._area
        places = [area.axis.place(interval.value) for interval in self.peaks.intervals]
        shown: dict[QWidget, int] = {}
        for number, flag in enumerate(self.flags):
            here = self._asked.shows_curve and number < len(places) and 0 <= places[number] <= 1
            flag.setVisible(here)
            if here:
                shown[flag] = area.pixel(area.opacity, places[number], 0.0).x()
        self._draw_stems()
        place_flags(list(shown), list(shown.values()), area.rect)
        area.flagsMoved.emit()

    def _draw_stems(self) -> None:
        top = self._view.viewRange()[1][1]
        pairs = zip(self.peaks.intervals, self.flags, strict=False)
        flagged = [interval for interval, flag in pairs if not flag.isHidden()]
        xs = [self._area.axis.place(interval.value) for interval in flagged]
        ys = [min(max(each.response, -self._limit), self._limit) for each in flagged]
        self._tops.setData(xs, ys)
        self._tops.setVisible(bool(xs))
        self._stems.setData(np.repeat(xs, 2), np.array([[y, top] for y in ys]).ravel())


def round_below(limit: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten well below a limit."""
    power = 10.0 ** math.floor(math.log10(limit))
    return max(
        step * power for step in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if step * power <= 0.9 * limit
    )


HEIGHT = 0.38  # height of the highest peak, as a fraction of the plot's
NAMED_FROM = 0.2  # share of the visibility from which a peak is labelled


class VisibleLayer:
    """Draws how much of the active region, or of the whole image, each value makes up."""

    def __init__(self, area: PlotArea, asker: SensitivityAsker) -> None:
        self._area, self._asker, self._state = area, asker, asker.state
        self._curve = Curve(area.back)
        self._curve.setZValue(-5)
        self._labels: list[Any] = []
        self._peaks: list[tuple[float, float]] = []
        self.recolor()

    def share_of(self, values: Range, scalar_range: Range, width: float) -> float | None:
        """Return a band's share of all that is visible, if known."""
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
                # Labels stay as they are during a drag.
                self.mark_stale()
                return
            bins = np.linspace(*scalar_range, len(heights))
            found = contributions(answer.value[0], scalar_range)
            shares = zip(found, percentages(found), strict=True)
            named = [(one, percent) for one, percent in shares if one.share >= NAMED_FROM]
            peaks = [(one.value, float(np.interp(one.value, bins, heights))) for one, _ in named]
            texts = [f"{self._state.range_text(one.reach)}: {percent} %" for one, percent in named]
            while len(self._labels) < len(texts):
                self._labels.append(self._new_label())
            for label, text in zip(self._labels, texts, strict=False):
                label.setText(text)
        self._peaks = peaks
        self.mark_stale()
        self.place_labels()

    def mark_stale(self) -> None:
        """Dim the area if it belongs to another image or region."""
        answer, outline = self._asker.visibility, self._asker.asked.outline
        fresh = (
            answer is not None
            and answer.is_of(self._state.inputs)
            and answer.request.regions[0] == outline
        )
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
        """Put each label above its peak, or higher to avoid handles, cards and other labels."""
        area = self._area
        cards, covered = area.card_boxes(), False
        taken = area.handle_boxes()
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
            lowest = at.y() - size.height()
            heights = range(lowest, min(lowest, plot.top()) - 2, -2)
            upper = round(freest([(left, y) for y in heights], size, taken, cards)[1])
            box = QRect(QPoint(left, upper), size)
            if label.isVisible():
                covered |= any(box.intersects(card) or card.contains(at) for card in cards)
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
        self._curve.brush = QBrush(fill)
        self._curve.pen = pg.mkPen(theme.VISIBLE, width=1.2)
        for label in self._labels:
            self._color_label(label)

    def _color_label(self, label: Any) -> None:
        """Write in green on a background, because areas of any colour lie behind."""
        ground = QColor(theme.PLOT)
        ground.setAlpha(170)
        label.setColor(theme.VISIBLE)
        label.fill = pg.mkBrush(ground)
