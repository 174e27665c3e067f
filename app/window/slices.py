"""The slices in the window: built when they are first shown, and linked to images and TF plot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QObject, QPointF, QRect, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPen
from PySide6.QtWidgets import QSplitter, QWidget

from app import theme
from app.engines.background import Pause
from app.state.opened_volume import OpenedVolume
from app.tf_editor.plot_area import PlotArea
from app.window.cards import CropCard
from app.window.context import Context
from app.window.help_pages import status_keys
from model.rendering.ray_places import ray_places
from model.scene.inputs import SceneInputs
from model.scene.slices import MIDDLE, usual_window, voxel_of
from model.scene.tf_perturbation import band_of_edit
from model.scene.view import NEAREST_DEPTH, Projection
from model.scene.volume import Triple

if TYPE_CHECKING:
    from app.slices.slices_column import SlicesColumn

LARGE = 0.5  # of the images' width that a large slice has
SMALL, NARROWEST = 0.4, 270  # width of three slices by their height, and at least, in pixels
HELD_MS = 500  # time for which the mouse rests before the image shows where the value is visible
ARM, GAP = 14, 4  # outer and inner end of the cross-hair's arms in an image, in pixels


class Slices(QObject):
    """Shows and hides the column of slices, and has images, plot and slices follow each other."""

    def __init__(
        self, context: Context, row: QSplitter, area: PlotArea, crop_card: CropCard
    ) -> None:
        super().__init__(context.window)
        self._context, self._row, self._area, self._crop_card = context, row, area, crop_card
        self.column: SlicesColumn | None = None
        """Built when it is first shown."""
        self._opened: OpenedVolume | None = None
        self._place: Triple = MIDDLE
        self._ray: list[tuple[Triple, float]] = []
        self._step = 0
        self._ray_of: tuple[SceneInputs, tuple[float, float]] | None = None
        self._under: float | None = None
        self._holds = False

    @property
    def is_shown(self) -> bool:
        """Whether the slices are there."""
        return self.column is not None and not self.column.isHidden()

    @property
    def areas(self) -> list[QWidget]:
        """What F6 goes to."""
        return list(self.column.views) if self.column is not None and self.is_shown else []

    def toggle(self) -> None:
        """Show the slices, or hide them."""
        shown = not self.is_shown
        self._context.preferences.set(slices=shown)
        if self._opened is None:
            self._context.status.say("There is nothing to cut yet. Open a volume first.")
        else:
            self._set_shown(shown)

    def start_volume(self, opened: OpenedVolume) -> None:
        """Show another volume, with the cross-hair where it was; slices, if they are remembered."""
        known, before = (
            self._context.preferences.volume(opened.fingerprint).cross_hair,
            self._opened,
        )
        is_next = before is not None and before.volume.series == opened.volume.series
        self._place = known or (self._place if is_next else MIDDLE)
        self._ray, self._ray_of = [], None
        self.show_volume(opened)
        self._set_shown(self._context.preferences.settings.slices)

    def show_volume(self, opened: OpenedVolume) -> None:
        """Show the open volume over another range, or on another scale."""
        self._opened = opened
        if self.column is not None and self.is_shown:
            state, context = self.column.state, self._context
            state.smooth = context.state.interpolates
            window = usual_window(opened.counts, opened.edges)
            state.show_volume(opened.volume, window, context.state.up_axis, self._place)

    def _set_shown(self, shown: bool) -> None:
        if shown == self.is_shown or self._opened is None:
            return
        if self.column is None:
            self._build()
        assert self.column is not None
        self.column.setVisible(shown)
        if shown:
            self.show_volume(self._opened)
            self._show_crop()
            self._follow_question("band")
            self._resize(self.column.large is not None)
        else:
            self._hover(None)
        self._update_images()

    def _build(self) -> None:
        from app.slices.slice_state import SliceState
        from app.slices.slices_column import SlicesColumn

        context = self._context
        state = SliceState(lambda: context.state.transfer_function, self)
        self.column = column = SlicesColumn(state, context.state, self._resize)
        column.hide()
        self._row.addWidget(column)
        self._row.setStretchFactor(1, 0)
        for view in column.views:
            view.setStatusTip(status_keys("Slices (S)"))
            view.installEventFilter(self)
        self._mark = pg.InfiniteLine(pen=pg.mkPen(theme.VISIBLE, width=1.5))
        self._mark.setZValue(60)
        self._mark.hide()
        self._area.opacity.addItem(self._mark, ignoreBounds=True)
        self._rest = Pause(self, HELD_MS, self._hold)
        for pane in context.panes:
            pane.canvas.add_decoration(self._paint)
            # After the view's keys, so that it gets them first.
            pane.canvas.installEventFilter(self)
        wires: list[tuple[Any, Any]] = [
            (state.changed, self._keep_place),
            (state.hovered, self._hover),
            (context.state.inputsChanged, self._follow_inputs),
            (context.state.navigationChanged, self._follow_axes),
            (context.sensitivity.changed, self._follow_question),
            (self._crop_card.shownChanged, lambda _shown: self._show_crop()),
        ]
        for signal, slot in wires:
            signal.connect(slot)
        self._shown_inputs = context.state.inputs

    def _resize(self, is_large: bool) -> None:
        """Make room for three slices, or for a large one."""
        whole = self._row.width()
        width = max(round(LARGE * whole if is_large else SMALL * self._row.height()), NARROWEST)
        self._row.setSizes([whole - width, width])

    def _update_images(self) -> None:
        for pane in self._context.panes:
            pane.canvas.update()

    def _keep_place(self, what: str) -> None:
        column = self.column
        if what == "place" and column is not None and self._opened is not None:
            self._place = column.state.place
            self._context.preferences.note_volume(self._opened.fingerprint, cross_hair=self._place)
            self._update_images()

    def _follow_inputs(self) -> None:
        """Show another TF, crop box or interpolation in the slices."""
        if self.column is None or not self.is_shown:
            return
        state, inputs, before = self.column.state, self._context.state, self._shown_inputs
        self._shown_inputs = now = inputs.inputs
        if now.crop != before.crop:
            self._show_crop()
        if now.interpolates != before.interpolates:
            self._follow_axes()
        elif state.colors != "gray" and (
            now.opacity_tf != before.opacity_tf or now.color_tf != before.color_tf
        ):
            inputs.calm.ask(state.recolor, state.recolor)

    def _follow_axes(self) -> None:
        if self.is_shown and self._opened is not None:
            self.show_volume(self._opened)

    def _show_crop(self) -> None:
        if self.column is not None and self.is_shown:
            self.column.state.show_crop(self._context.state.crop, self._crop_card.is_shown)

    def _follow_question(self, what: str) -> None:
        """Outline the band of values, and go to what shows at a place that was clicked."""
        if self.column is None or not self.is_shown:
            return
        asked, state = self._context.sensitivity, self._context.state
        if what in ("band", "choices"):
            band = asked.band if asked.choices.shown else None
            width, whole = asked.choices.width, state.scalar_range
            outlined = None if band is None else band_of_edit(band.values, whole, width)
            self.column.state.outline(outlined)
        elif what == "place" and asked.place is not None:
            self._look_along(asked.place)
            self._go(0)

    def _look_along(self, place: tuple[float, float]) -> None:
        """Find what shows at a place of the image, from the eye on."""
        inputs = self._context.state.inputs
        if self._opened is not None and self._ray_of != (inputs, place):
            self._ray_of = inputs, place
            x, y = place
            self._ray = ray_places(self._opened.volume, inputs, (2 * x - 1, 1 - 2 * y))

    def _go(self, step: int) -> None:
        """Put the cross-hair onto one of the places along the ray."""
        if self._ray and self.column is not None:
            self._step = min(max(step, 0), len(self._ray) - 1)
            place, share = self._ray[self._step]
            self.column.state.move(place)
            which = f"{self._step + 1} of {len(self._ray)} along the line of sight"
            self._context.status.say(f"Place {which}: {100 * share:.0f} % of the opacity.")

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Step along the ray through the clicked place by the keys up and down."""
        if event.type() not in (QEvent.Type.ShortcutOverride, QEvent.Type.KeyPress):
            return False
        key, place = cast(QKeyEvent, event), self._context.sensitivity.place
        steps = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}.get(Qt.Key(key.key()))
        plain = not key.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        if steps is None or place is None or not (plain and self.is_shown):
            return False
        if event.type() == QEvent.Type.KeyPress:
            self._look_along(place)
            self._go(self._step + steps)
        event.accept()
        return True

    def _hover(self, place: Triple | None) -> None:
        """Mark the value under the mouse in the plot; once the mouse rests, in the images."""
        asked, opened = self._context.sensitivity, self._opened
        value = None
        if place is not None and opened is not None:
            x, y, z = voxel_of(opened.volume, place)
            lowest, highest = opened.volume.scalar_range
            value = min(max(float(opened.volume.voxels[z, y, x]), lowest), highest)
        if self._holds and value != self._under:
            self._holds = False
            asked.hover(None)
        self._under = value
        self._mark.setVisible(value is not None)
        self._rest.stop()
        if value is not None:
            self._mark.setPos(self._area.axis.place(value))
            self._rest.start()

    def _hold(self) -> None:
        if self._under is not None and self._context.sensitivity.choices.shown:
            self._holds = True
            self._context.sensitivity.hover(self._under, effect=False)

    def _paint(self, painter: QPainter, square: QRect) -> None:
        """Draw the cross-hair over an image."""
        if not self.is_shown:
            return
        state, point = self._context.state, np.array([self._place])
        projection = Projection(state.view, state.proportions)
        if projection.depths(point)[0] <= NEAREST_DEPTH:
            return
        x, y = projection.places(point)[0]
        at = QPointF(
            square.left() + square.width() * (1 + x) / 2,
            square.top() + square.height() * (1 - y) / 2,
        )
        for color, width in ((theme.ON_IMAGE.window, 3.5), (theme.ON_IMAGE.attention, 1.5)):
            painter.setPen(QPen(QColor(color), width))
            for right, down in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                start, end = (QPointF(length * right, length * down) for length in (GAP, ARM))
                painter.drawLine(at + start, at + end)
