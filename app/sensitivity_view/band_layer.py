"""The band of values in question: drawn over the plot, and chosen there with the mouse."""

from collections.abc import Callable
from typing import cast

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QGraphicsRectItem, QHBoxLayout, QLabel

from app import theme
from app.controls import CLICK_REACH, Card, Painted, fill
from app.icons import IconButton
from app.placing import freest
from app.sensitivity_view.findings_panel import AddButton
from app.sensitivity_view.response_layer import VisibleLayer
from app.state.sensitivity_asker import SensitivityAsker
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.plot_area import PlotArea
from model.scene.tf_perturbation import band_of_edit
from model.scene.transfer_function import Range


class PlotMouse(QObject):
    """Chooses the band with the mouse over the opacity plot; handles keep their events."""

    def __init__(self, area: PlotArea, state: ViewerState, asked: SensitivityState) -> None:
        super().__init__(area)
        self._area, self._state, self._asked = area, state, asked
        self._pressed: QPointF | None = None
        self._edits = False  # whether a handle was moved since the mouse entered the plot
        viewport = area.widget.viewport()
        viewport.setMouseTracking(True)
        viewport.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the mouse, and leave its events to the plot."""
        kind = event.type()
        if not self._asked.choices.shown:
            self._pressed = None
            return False
        if kind == QEvent.Type.Leave:
            self._edits = False
            self._asked.hover(None)
        elif kind == QEvent.Type.Wheel:
            wheel = cast(QWheelEvent, event)
            position = wheel.position()
            # With Ctrl, the wheel zooms the plots' axis.
            zooms = bool(wheel.modifiers() & Qt.KeyboardModifier.ControlModifier)
            if not zooms and self._value_at(position) is not None:
                self._asked.widen(wheel.angleDelta().y() / 120)
                return True
        elif kind == QEvent.Type.MouseButtonPress:
            mouse = cast(QMouseEvent, event)
            left = mouse.button() == Qt.MouseButton.LeftButton
            # With Shift, a drag selects handles.
            plain = left and not mouse.modifiers() & Qt.KeyboardModifier.ShiftModifier
            self._edits = self._area.has_handle_at(mouse.position().toPoint())
            self._pressed = mouse.position() if plain and not self._edits else None
            if self._edits:
                self._asked.hover(None)
        elif kind == QEvent.Type.MouseMove:
            self._move(cast(QMouseEvent, event))
        elif kind == QEvent.Type.MouseButtonRelease:
            if self._asked.dragging and self._pressed is not None:
                self._asked.finish("band")
            elif self._pressed is not None:
                # A click next to the handles.
                self._asked.release()
                self._asked.hover(
                    self._value_at(self._pressed), _asks_effect(cast(QMouseEvent, event))
                )
            self._pressed = None
        return False

    def _move(self, event: QMouseEvent) -> None:
        if event.buttons() and self._pressed is None:
            return
        value = self._value_at(event.position())
        if not event.buttons():
            # While users move a handle, they look at the picture.
            is_editing = self._edits or self._area.has_handle_at(event.position().toPoint())
            self._asked.hover(None if is_editing else value, _asks_effect(event))
        elif self._pressed is not None:
            start = self._value_at(self._pressed)
            moved = abs(event.position().x() - self._pressed.x()) > CLICK_REACH
            if start is not None and value is not None and moved:
                self._asked.drag_band(start, value, _asks_effect(event))

    def _value_at(self, position: QPointF) -> float | None:
        """Scalar value under the mouse; None outside the opacity plot."""
        at = self._area.widget.mapToScene(position.toPoint())
        if not self._area.opacity.sceneBoundingRect().contains(at):
            return None
        place = self._area.opacity.mapSceneToView(at).x()
        lo, hi = self._state.scalar_range
        return min(max(self._area.axis.value(min(max(place, 0.0), 1.0)), lo), hi)


def _asks_effect(event: QMouseEvent) -> bool:
    """Whether the mouse asks about an edit, instead of where values are visible."""
    return bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)


TAG_HEIGHT, KEPT_HEIGHT = 20, 26  # heights of the tag: without its buttons, and with them


class BandTag(Card):
    """Tag that says what a band shows; if the band is kept, with buttons for it."""

    def __init__(self, area: PlotArea, add: Callable[[bool], object]) -> None:
        super().__init__(area.widget.viewport(), "tag")
        self.text = QLabel()
        self.add = AddButton("the kept values", add)
        self.release = IconButton("close", "Release these values", "Esc")
        parts = self.text, self.add, self.release
        self._row = fill(QHBoxLayout(self), *parts, margins=(8, 0, 4, 0), spacing=4)
        for button in (self.add, self.release):
            button.setFixedHeight(KEPT_HEIGHT - 2)
        self.hide()

    def show_band(self, text: str, color: str, is_kept: bool) -> None:
        """Show a text on the colour of its meaning."""
        self.text.setText(text)
        self.text.setStyleSheet(f"color: {color};")
        for button in (self.add, self.release):
            button.setVisible(is_kept)
        # Under the mouse, it would block the plot.
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents, not is_kept)
        self.setFixedHeight(KEPT_HEIGHT if is_kept else TAG_HEIGHT)
        self._row.activate()
        self.adjustSize()
        self.show()
        self.raise_()


class BandLayer:
    """Draws the band: green where it is visible, blue what an edit of it would change."""

    asks_edit = Painted(False, "refresh")  # whether it is an edit, whatever the mouse asks

    def __init__(
        self,
        area: PlotArea,
        asker: SensitivityAsker,
        visible: VisibleLayer,
        add: Callable[[bool], object],
    ) -> None:
        self._area, self._visible = area, visible
        self._state, self._asked = asker.state, asker.asked
        self._rect = QGraphicsRectItem()
        self._rect.setZValue(50)
        self._rect.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
        area.opacity.addItem(self._rect, ignoreBounds=True)
        self.tag = BandTag(area, add)
        self.tag.release.clicked.connect(lambda: asker.asked.release())
        self.refresh()

    def refresh(self) -> None:
        """Draw the present band, or none."""
        band, choices = self._asked.band, self._asked.choices
        is_shown = band is not None and choices.shown
        self._rect.setVisible(is_shown)
        if band is None or not is_shown:
            self.tag.hide()
            return
        values = band_of_edit(band.values, self._state.scalar_range, choices.width)
        left, right = self._area.axis.places(values).clip(0.0, 1.0).tolist()
        color = QColor(theme.CHANGE if band.effect or self.asks_edit else theme.VISIBLE)
        self._rect.setPen(pg.mkPen(color, width=1))
        color.setAlpha(50)
        self._rect.setBrush(color)
        self._rect.setRect(left, 0.0, right - left, 1.0 + self._area.headroom)
        self._show_tag(values, (left + right) / 2)

    def _show_tag(self, drawn: Range, place: float) -> None:
        band = self._asked.band
        assert band is not None
        asks_edit = band.effect or self.asks_edit
        if asks_edit:
            text = f"edit at {self._state.range_text(band.values)}"
        else:
            width = self._asked.choices.width
            share = self._visible.share_of(band.values, self._state.scalar_range, width)
            text = self._state.range_text(drawn if band.low == band.high else band.values)
            if share is not None:
                percent = "under 1" if 0.0005 <= share < 0.005 else f"{100 * share:.0f}"
                text += f": {percent} % of what is visible"
        color = theme.CHANGE if asks_edit else theme.VISIBLE
        self.tag.show_band(text, color, band.kept and not self._asked.dragging)
        plot, width = self._area.rect, self.tag.width()
        left = self._area.pixel(self._area.opacity, place, 0.0).x() - width // 2
        left = min(max(left, plot.left()), max(plot.right() - width, plot.left()))
        self.tag.move(left, self._free_height(left))

    def _free_height(self, left: int) -> int:
        """Distance from the plot's top at which the tag covers neither flags nor the card."""
        plot, size = self._area.rect, self.tag.size()
        others = [box for box in self._area.card_boxes() if box != self.tag.geometry()]
        taken = [*others, *self._area.handle_boxes(), *self._area.label_boxes()]
        lowest = plot.bottom() + 1 - size.height()
        heights = range(plot.top(), max(lowest, plot.top()) + 1, 4)
        return round(freest([(left, y) for y in heights], size, taken)[1])
