"""The slices in the window: built when they are first shown, and linked to images and TF plot."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

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
from model.scene.slices import MIDDLE, planes_of, usual_window, voxel_of
from model.scene.tf_perturbation import band_of_edit
from model.scene.view import NEAREST_DEPTH, Projection
from model.scene.volume import Triple

if TYPE_CHECKING:
    from app.slices.slices_column import SlicesColumn

LARGE = 0.5  # of the images' width that a large slice has
SMALL, NARROWEST = 0.45, 280  # width of three slices by their height, and at least, in pixels
HELD_MS = 500  # time for which the mouse rests before the image shows where the value is visible
ARM, GAP = 14, 4  # outer and inner end of the cross-hair's arms in an image, in pixels
STEPS: dict[int, int] = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}


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
        self._ray_of: object = None
        self._step = 0
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
        if self._opened is not None:
            self._context.preferences.set(slices=not self.is_shown)
            self._set_shown(not self.is_shown)

    def start_volume(self, opened: OpenedVolume) -> None:
        """Show another volume, with the cross-hair where it was; slices, if they are remembered."""
        known, before = self._context.preferences.volume(opened.fingerprint), self._opened
        is_next = before is not None and before.volume.series == opened.volume.series
        self._place = known.cross_hair or (self._place if is_next else MIDDLE)
        self._ray, self._ray_of = [], None
        self.show_volume(opened)
        self._set_shown(self._context.preferences.settings.slices)

    def show_volume(self, opened: OpenedVolume) -> None:
        """Show the open volume over another range, or on another scale."""
        self._opened = opened
        self._refresh()

    def _set_shown(self, shown: bool) -> None:
        if shown == self.is_shown or self._opened is None:
            return
        column = self.column = self.column or self._built()
        column.setVisible(shown)
        self._hover(None)
        self._refresh()
        self._resize()
        self._update_images()

    def _built(self) -> SlicesColumn:
        from app.slices.slices_column import SlicesColumn

        context = self._context
        column = SlicesColumn(context.state, self._resize)
        column.hide()
        self._row.addWidget(column)
        self._row.setStretchFactor(1, 0)
        self._mark = pg.InfiniteLine(pen=pg.mkPen(theme.VISIBLE, width=1.5))
        self._mark.setZValue(60)
        self._area.opacity.addItem(self._mark, ignoreBounds=True)
        self._rest = Pause(self, HELD_MS, self._hold)
        for view in column.views:
            view.setStatusTip(status_keys("Slices (S)"))
            view.installEventFilter(self)
        for pane in context.panes:
            pane.canvas.add_decoration(self._paint)
            # After the view's keys, so that it gets them first.
            pane.canvas.installEventFilter(self)
        for signal, slot in (
            (column.state.changed, self._keep_place),
            (column.state.hovered, self._hover),
            (context.state.inputsChanged, context.state.calm.soon(self._refresh)),
            (context.state.navigationChanged, self._refresh),
            (context.sensitivity.changed, self._follow_question),
            (self._crop_card.shownChanged, self._refresh),
        ):
            signal.connect(slot)
        return column

    def _refresh(self, *_: object) -> None:
        """Have the slices show what the window shows."""
        if self.column is None or not self.is_shown or self._opened is None:
            return
        state, asked, shown = self._context.state, self._context.sensitivity, self.column.state
        volume, window, colors = self._opened.volume, shown.window, shown.colors
        if shown.volume is None or shown.volume.scalar_range != volume.scalar_range:
            window = usual_window(self._opened.counts, self._opened.edges)
            # Gray says nothing about labels.
            colors = "colors" if volume.file.is_labels else colors
        band = asked.band if asked.choices.shown else None
        width, whole = asked.choices.width, state.scalar_range
        shown.show(
            volume=volume,
            window=window,
            colors=colors,
            planes=planes_of(state.up_axis, state.axis_labels),
            place=self._place,
            tf=state.transfer_function,
            smooth=state.interpolates,
            band=None if band is None else band_of_edit(band.values, whole, width),
            crop=state.crop,
            edits_crop=self._crop_card.is_shown,
        )

    def _resize(self) -> None:
        """Make room for three slices, or for a large one."""
        assert self.column is not None
        whole, high = self._row.width(), self._row.height()
        width = max(round(LARGE * whole if self.column.is_large else SMALL * high), NARROWEST)
        self._row.setSizes([whole - width, width])

    def _keep_place(self) -> None:
        assert self.column is not None and self._opened is not None
        if self._place != self.column.state.place:
            self._place = self.column.state.place
            self._context.preferences.note_volume(self._opened.fingerprint, cross_hair=self._place)
            self._update_images()

    def _update_images(self) -> None:
        for pane in self._context.panes:
            pane.canvas.update()

    def _follow_question(self, what: str) -> None:
        """Outline the band of values, and go to what shows at a place that was clicked."""
        if what in ("band", "choices"):
            self._refresh()
        elif what == "place" and self.is_shown:
            self._go(0)

    def _go(self, step: int) -> None:
        """Put the cross-hair onto one of the places that show where an image was clicked."""
        place, inputs = self._context.sensitivity.place, self._context.state.inputs
        if place is None or self._opened is None or self.column is None:
            return
        if self._ray_of != (inputs, place):
            x, y = place
            self._ray_of = inputs, place
            self._ray = ray_places(self._opened.volume, inputs, (2 * x - 1, 1 - 2 * y))
        if self._ray:
            self._step = min(max(step, 0), len(self._ray) - 1)
            found, share = self._ray[self._step]
            self.column.state.move(found)
            which = f"{self._step + 1} of {len(self._ray)} along the line of sight"
            self._context.status.say(f"Place {which}: {100 * share:.0f} % of the opacity.")

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Step along the ray through the clicked place by the keys up and down."""
        if event.type() not in (QEvent.Type.ShortcutOverride, QEvent.Type.KeyPress):
            return False
        key = cast(QKeyEvent, event)
        is_plain = not key.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        is_step = key.key() in STEPS and is_plain and self.is_shown
        if not is_step or self._context.sensitivity.place is None:
            return False
        if event.type() == QEvent.Type.KeyPress:
            self._go(self._step + STEPS[key.key()])
        event.accept()
        return True

    def _hover(self, place: Triple | None) -> None:
        """Mark the value under the mouse in the plot; once the mouse rests, in the images."""
        value = None
        if place is not None and self._opened is not None:
            volume = self._opened.volume
            x, y, z = voxel_of(volume, place)
            lowest, highest = volume.scalar_range
            value = min(max(float(volume.voxels[z, y, x]), lowest), highest)
        if self._holds and value != self._under:
            self._holds = False
            self._context.sensitivity.hover(None)
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
        state, point = self._context.state, np.array([self._place])
        projection = Projection(state.view, state.proportions)
        if not self.is_shown or projection.depths(point)[0] <= NEAREST_DEPTH:
            return
        right, up = projection.places(point)[0] * square.width() / 2
        at = QPointF(square.center()) + QPointF(right, -up)
        for color, width in ((theme.ON_IMAGE.window, 3.5), (theme.ON_IMAGE.attention, 1.5)):
            painter.setPen(QPen(QColor(color), width))
            for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                start, end = (at + QPointF(length * x, length * y) for length in (GAP, ARM))
                painter.drawLine(start, end)
