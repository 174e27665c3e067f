"""The card with the numbers of the selected handle, near it in the plot."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QWidget

from app import theme
from app.controls import Painted, fill, label, named, text_button
from app.icons import IconButton
from app.number_box import NumberBox
from app.placing import freest
from app.tf_editor.handles import KINDS, HandleMoves
from app.tf_editor.plot_area import PIN_PLACE, PlotArea
from app.tf_editor.tf_layers import ColorLayer
from app.tf_editor.unit_axis import WIDTHS
from model.scene import tf_editing as edits
from model.scene.transfer_function import ColorTF, OpacityTF

HEIGHT = 28
GAP = 18  # distance from the handle, in pixels
ROOM = 3  # least distance from the plot's edges and from flags, in pixels
STEP, REACH, DOWN = 12, 300, 4
"""Distance between tried positions to the side, the farthest, and distance between heights."""

OWN = 9  # half the side of the square that the card keeps free around its handle, in pixels
CURVE_PLACES = 129  # points of the opacity curve that the card avoids
PIN_GAP = 8  # distance to the side of a colour pin, which is also below the card
FIELDS = "value", "width", "opacity"
VALUE_MEANING = "Scalar value (F2)"

WIDTH_MEANING = "Distance from the mean at which the opacity has fallen to 37 %"
OPACITY_MEANING = "Light lost over one voxel length: 0 is transparent, 1 is opaque"


class ModeCard(QFrame):
    """Value, width, opacity and colour of the selected handle, which can be typed."""

    is_short = Painted(False, "refresh")  # without captions

    def __init__(self, area: PlotArea, moves: HandleMoves, color: ColorLayer) -> None:
        super().__init__(area.widget.viewport())
        self._area, self._moves = area, moves
        self._state, self._selection = moves.state, moves.selection
        self.heading = ""  # the selected handle, in words
        self.setProperty("role", "mode card")
        self.setFixedHeight(HEIGHT)
        # The mouse between its fields does not reach the plot.
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation)
        self.value, self.width_box, self.height_box = self.fields = tuple(
            NumberBox(meaning=text) for text in (VALUE_MEANING, WIDTH_MEANING, OPACITY_MEANING)
        )
        self._captions: dict[QWidget, QLabel] = {}
        self.color_button = text_button("", "Colour at this value", color.choose_selected)
        self.color_button.setFixedSize(24, 24)
        self.color_button.setAccessibleName("Colour")
        self.remove_button = IconButton("delete", "Delete", "Delete")
        # Within the card's frame.
        self.remove_button.setFixedSize(24, 24)
        self.controls: tuple[QWidget, ...] = *self.fields, self.color_button, self.remove_button
        self._lay_out()
        for box, what in zip(self.fields, FIELDS, strict=True):
            box.valueChanged.connect(partial(self._typed, what))
        self.remove_button.clicked.connect(moves.remove)
        self.refresh()

    def _lay_out(self) -> None:
        self._row = row = fill(QHBoxLayout(self), margins=(8, 0, 4, 0), spacing=4)
        for box, text in zip(self.fields, FIELDS, strict=True):
            named(box, text.capitalize()).setProperty("role", "card")
            box.setFixedHeight(22)
            box.lineEdit().setTextMargins(0, 0, 0, 0)
            self._captions[box] = named(label(text, "dim"), tip=box.meaning)
            row.addWidget(self._captions[box])
            row.addWidget(box)
        row.addWidget(self.color_button)
        row.addWidget(self.remove_button)

    def edit(self) -> None:
        """Take the focus, so that the value can be typed."""
        self.refresh()
        if self.isVisible():
            # The value of an end is fixed.
            free = next(each for each in self.controls if each.isVisible() and each.isEnabled())
            free.setFocus(Qt.FocusReason.TabFocusReason)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Return the focus to the plot on Escape, or on Enter, whose number is set already."""
        if event.key() in (Qt.Key.Key_Escape, Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._area.widget.setFocus(Qt.FocusReason.OtherFocusReason)
        else:
            super().keyPressEvent(event)

    def refresh(self) -> None:
        """Show the present numbers of the selected handle."""
        tf = self._state.transfer_function
        mode_or_point = self._selection.index("opacity")
        stop = self._selection.index("color")
        if mode_or_point is not None:
            self._show_opacity_handle(tf.opacity, mode_or_point)
            color = tf.color(edits.opacity_handles(tf.opacity)[mode_or_point][0])
            self._show_color(tuple(float(part) for part in color))
        elif stop is not None:
            self._show_stop(tf.color, stop)
        else:
            self.heading = "Nothing selected"
            self.remove_button.setEnabled(False)
        named(self, self.heading, self.heading)
        said = [self.heading]
        if self._selection.current is not None:
            shown = [box for box in self.fields if not box.isHidden()]
            said += [f"{box.accessibleName().lower()} {box.text()}" for box in shown]
        self._area.widget.setAccessibleDescription(", ".join(said))
        self.place()

    def _show_opacity_handle(self, opacity: OpacityTF, index: int) -> None:
        handles = edits.opacity_handles(opacity)
        lo, hi = opacity.scalar_range
        value, height = handles[index]
        self._name("Point" if opacity.points else "Mode", index, len(handles))
        self._set_value(edits.opacity_limits(opacity, index), value)
        self.height_box.show_value(height)
        if opacity.points:
            self._show_fields(self.value, self.height_box)
        else:
            self.width_box.set_limits(opacity.bin_width, hi - lo)
            self.width_box.show_value(opacity.modes[index].width)
            self._captions[self.width_box].setText(WIDTHS[opacity.scale])
            self.width_box.setAccessibleName(WIDTHS[opacity.scale].capitalize())
            self._show_fields(self.value, self.width_box, self.height_box)
        self.remove_button.setEnabled(edits.can_remove_opacity_handle(opacity, index))

    def _show_stop(self, color: ColorTF, index: int) -> None:
        value, *rgb = color.stops[index]
        self._name("Colour stop", index, len(color.stops))
        self._set_value(edits.stop_limits(color, index), value)
        self._show_color(tuple(rgb))
        self._show_fields(self.value)
        self.remove_button.setEnabled(not edits.is_end_stop(color, index))

    def _name(self, name: str, index: int, count: int) -> None:
        selected = len(self._selection.indices(self._selection.kind))
        more = f", {selected} selected" if selected > 1 else ""
        self.heading = f"{name} {index + 1} of {count}{more}"

    def _show_color(self, rgb: tuple[float, ...]) -> None:
        red, green, blue = (round(255 * part) for part in rgb)
        self.color_button.setStyleSheet(
            f"background: rgb({red}, {green}, {blue}); border: 3px solid {theme.FIELD};"
        )

    def _set_value(self, limits: tuple[float, float], value: float) -> None:
        # An end is fixed.
        self.value.setEnabled(limits[0] < limits[1])
        ends = limits if self.value.isEnabled() else self._state.scalar_range
        self.value.set_limits(*ends, self._state.scale)
        self.value.numbers = self._state.file.label_numbers or {}
        self.value.show_value(value)
        units = self._state.units
        self._captions[self.value].setText(f"value ({units})" if units else "value")

    def _show_fields(self, *shown: NumberBox) -> None:
        for box in self.fields:
            box.setVisible(box in shown)
            self._captions[box].setVisible(box in shown and not self.is_short)
            typed = box.lineEdit().text()
            # As wide as the present and the next number.
            width = box.fontMetrics().horizontalAdvance(f"{typed}0") + 14
            box.setFixedWidth(max(width, 30))

    def _handle_at(self) -> QPoint | None:
        """Place of the selected handle, in pixels of the plots; None if it is not visible."""
        area, tf = self._area, self._state.transfer_function
        index, stop = self._selection.index("opacity"), self._selection.index("color")
        handles = edits.opacity_handles(tf.opacity)
        # While another TF arrives, the plot may have it before the selection is updated.
        if index is not None and index < len(handles):
            value, opacity = handles[index]
            low, high = tf.scalar_range
            value, height = min(max(value, low), high), area.scale.height(opacity)
            view = area.opacity
        elif stop is not None and stop < len(tf.color.stops):
            value, height, view = tf.color.stops[stop][0], PIN_PLACE, area.strip
        else:
            return None
        place = area.axis.place(value)
        return area.pixel(view, place, height) if 0.0 <= place <= 1.0 else None

    def _curve_boxes(self) -> list[QRect]:
        """Places of the opacity curve and its highest values, in pixels of the plots."""
        area, tf = self._area, self._state.transfer_function
        places = np.linspace(0.0, 1.0, CURVE_PLACES)
        opacities = tf.opacity(area.axis.values(places).clip(*tf.scalar_range))
        corners = area.pixel(area.opacity, 0.0, 0.0), area.pixel(area.opacity, 1.0, 1.0)
        (left, bottom), (right, top) = ((corner.x(), corner.y()) for corner in corners)
        xs = left + (right - left) * places
        ys = bottom + (top - bottom) * area.scale.heights(opacities)
        return [QRect(round(x) - 2, round(y) - 2, 4, 4) for x, y in zip(xs, ys, strict=True)]

    def place(self) -> None:
        """Move to the handle, or hide."""
        at = self._handle_at()
        if at is None or self._area.readout:
            self.hide()
            return
        self._row.activate()
        size = QSize(self.sizeHint().width(), HEIGHT)
        is_pin = self._selection.index("opacity") is None
        area = self._area
        flags = [flag.geometry() for flag in area.flags if not flag.isHidden()]
        kept_clear = [flag.adjusted(-ROOM, -ROOM, ROOM, ROOM) for flag in flags]
        own = QRect(at.x() - OWN, at.y() - OWN, 2 * OWN, 2 * OWN)
        marks = [*area.handle_boxes(), *area.label_boxes(), own]
        layers = kept_clear, marks, [*self._curve_boxes(), *area.peak_boxes()]
        corner = _free_corner(at, size, PIN_GAP if is_pin else GAP, area.rect, layers)
        self.setGeometry(QRect(corner, size))
        self.show()
        self.raise_()

    def _typed(self, what: str, number: float) -> None:
        """Apply a typed number to the selected handle: one undo step."""
        tf, index, stop = self._moves.tf, *map(self._selection.index, KINDS)
        if index is not None:
            value, height = edits.opacity_handles(tf.opacity)[index]
            if what == "width":
                opacity = edits.resize_mode(tf.opacity, index, number)
            else:
                place = (number, height) if what == "value" else (value, number)
                opacity = edits.move_opacity_handle(tf.opacity, index, *place)
            after = self._moves.with_opacity(tf, opacity)
            self._state.tf_input.set(after, f"set {what}", f"{what} {index}")
        elif stop is not None:
            color = edits.move_stop(tf.color, stop, number)
            self._state.tf_input.set(replace(tf, color=color), "move colour stop", f"stop {stop}")
        # Even if the edit changed nothing, so that a number outside the limits is replaced.
        self.refresh()


def _free_corner(
    at: QPoint, size: QSize, gap: int, plot: QRect, layers: Sequence[Sequence[QRect]]
) -> QPoint:
    """Upper left corner of a card inside the plot, as near to its handle as may be."""
    inside = plot.adjusted(ROOM, ROOM, -ROOM, -ROOM)
    rightmost = max(inside.right() + 1 - size.width(), inside.left())
    lowest = max(inside.bottom() + 1 - size.height(), inside.top())
    steps = np.arange(0, REACH, STEP)
    sides = [at.x() + gap + steps, at.x() - gap - size.width() - steps]
    sides.append(at.x() - np.arange(0, size.width(), STEP))
    xs = np.unique(np.concatenate(sides).clip(inside.left(), rightmost))
    x, y = (each.ravel() for each in np.meshgrid(xs, np.arange(inside.top(), lowest + 1, DOWN)))
    right, bottom = x + size.width() - 1, y + size.height() - 1
    aside = np.maximum(np.maximum(x - at.x(), at.x() - right), 0)
    above = np.maximum(np.maximum(y - at.y(), at.y() - bottom), 0)
    off_middle = np.abs((y + bottom) / 2 - at.y())
    nearest = np.lexsort((off_middle, np.hypot(aside, above)))
    left, top = freest(zip(x[nearest], y[nearest], strict=True), size, *layers)
    return QPoint(round(left), round(top))
