"""The slices in the window: built when first shown, and linked to images and TF plot."""

import math
from typing import Any, cast

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QObject, QPointF, QRect, Qt, QTimer
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPen
from PySide6.QtWidgets import QSplitter, QWidget

from app import theme
from app.controls import RightClick
from app.engines.background import Pause
from app.slices.slice_view import SlicesColumn, SliceState, SliceView
from app.state.opened_volume import OpenedVolume
from app.tf_editor.plot_area import PlotArea
from app.window.cards import CropCard
from app.window.context import Context
from model.rendering.ray_places import ray_places, values_at
from model.scene.crop import CropBox
from model.scene.orientation import corners
from model.scene.slices import MIDDLE, SliceColors, gray_window, usual_window, voxel_of
from model.scene.tf_perturbation import band_of_edit
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import Range
from model.scene.view import NEAREST_DEPTH, Projection, from_middle
from model.scene.volume import Triple

LARGE = 0.5  # share of the images' width that a large slice has
SMALL, NARROWEST = 0.45, 280  # three slices' width relative to their height; least width
HELD_MS = 500  # time for which the mouse must rest before the image marks the value
ARM, GAP = 14, 4  # outer and inner end of the cross-hair's arms in an image, in pixels
STEPS: dict[int, int] = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}


class Slices(QObject):
    """Shows and hides the column of slices, and links images, plot and slices."""

    def __init__(
        self, context: Context, row: QSplitter, area: PlotArea, crop_card: CropCard
    ) -> None:
        super().__init__(context.window)
        self._context, self._row, self._area = context, row, area
        self.state = SliceState(context.state, self)
        self.column: SlicesColumn | None = None  # built when it is first shown
        self._step = self._width = 0  # the user's width of the slices, if any
        self._before = self.state.place  # before the mouse was pressed
        self._restored: tuple[float, float] | None = None  # clicked place before a double click
        self._pointed: Triple | None = None  # place under the mouse
        self._under: float | None = None
        self._holds = False
        self.filters: list[QObject] = []  # of the mouse's events on the slices
        self.state.moved.connect(self._keep_place)
        self.state.painted.connect(self._keep_paint)
        self.state.hovered.connect(self._hover)
        context.sensitivity.changed.connect(self._follow_question)
        context.workspace.pieces.located.connect(self._go_to_click)
        crop_card.shownChanged.connect(lambda *_: self.state.show(edits_crop=crop_card.is_shown))

    @property
    def is_shown(self) -> bool:
        """Whether the slices are shown."""
        return self.column is not None and not self.column.isHidden()

    @property
    def areas(self) -> list[QWidget]:
        """The widgets that F6 goes to."""
        return list(self.column.views) if self.column is not None and self.is_shown else []

    def toggle(self) -> None:
        """Show or hide the slices."""
        if self.state.volume is not None:
            self._context.preferences.set(slices=not self.is_shown)
            self._set_shown(not self.is_shown)

    def fit(self) -> None:
        """Show the whole slice under the mouse, or without one all that is not hidden."""
        under = [view for view in cast(list[SliceView], self.areas) if view.underMouse()]
        for view in under:
            view.fit()
        volume, state = self.state.volume, self._context.state
        if under or volume is None:
            return
        inputs, shape = state.inputs, state.proportions
        box = inputs.crop or CropBox()
        box = box if inputs.mask is None else inputs.mask.within(box)
        shown = ThinnedVolume.of(volume).shown_points(inputs.opacity_tf).clip(box.low, box.high)
        if inputs.clip is not None:
            section = inputs.clip.outline(box, shape)
            section = section.clip(shown.min(axis=0), shown.max(axis=0))
            shown = np.vstack([shown[inputs.clip.depths(shown, shape) > 0], section])
        state.view_whole(shown if len(shown) else corners(box))

    def take_piece(self, alone: bool) -> None:
        """Show a piece alone, or cut it away: under the mouse in a slice, or at the cross-hair."""
        pieces = self._context.workspace.pieces
        if self._pointed is not None or any(view.hasFocus() for view in self.areas):
            pieces.take_at(self._pointed or self.state.place, alone)
        else:
            pieces.take(0, alone)

    def start_volume(self, opened: OpenedVolume) -> None:
        """Show another volume, with its remembered cross-hair and slices."""
        known = self._context.preferences.volume(opened.fingerprint)
        is_next = self._context.workspace.is_next
        self.state.place = known.cross_hair or (self.state.place if is_next else MIDDLE)
        self._show_volume(opened, known.slice_colors, known.gray_window, is_other=not is_next)
        self._set_shown(self._context.preferences.settings.slices)
        self._context.update_images()

    def show_range(self, opened: OpenedVolume) -> None:
        """Show the open volume over another range, or on another scale."""
        self._show_volume(opened)
        # It may be another one than what the user had chosen.
        self._context.workspace.keep(gray_window=self.state.window)

    def _show_volume(
        self,
        opened: OpenedVolume,
        colors: SliceColors | None = None,
        window: Range | None = None,
        is_other: bool = False,
    ) -> None:
        """Show a volume, in remembered colours and grey window if there are any."""
        volume, before, changes = opened.volume, self.state.volume, dict[str, Any]()
        if is_other or before is None or before.scalar_range != volume.scalar_range:
            changes["window"] = usual_window(opened.counts, opened.edges)
            if volume.file.is_labels:
                # Grey is useless for labels.
                changes["colors"] = "colors"
        if colors is not None:
            changes["colors"] = colors
        if window is not None:
            # Within its limits, whatever the file says.
            changes["window"] = gray_window(window, volume.scalar_range, 1.0, 0.0)
        self.state.show(volume=volume, **changes)
        self._follow_question("band")

    def _set_shown(self, shown: bool) -> None:
        large = self._context.preferences.settings.large_slice
        if shown == self.is_shown and (self.column is None or self.column.large == large):
            return
        column = self.column = self.column or self._built()
        if not shown and any(view.hasFocus() for view in column.views):
            # Qt would give the focus to the volume's name in the bar.
            self._context.window.setFocus()
        column.enlarge(large)
        column.setVisible(shown)
        self._hover(None)
        column.refresh()
        self._resize()
        self._context.update_images()

    def _enlarge(self, number: int) -> None:
        assert self.column is not None
        self._context.preferences.set(large_slice=number if self.column.large is None else None)
        self._set_shown(True)

    def _built(self) -> SlicesColumn:
        column = SlicesColumn(self.state, self._enlarge)
        column.hide()
        self._row.addWidget(column)
        self._row.splitterMoved.connect(self._keep_width)
        self._mark = pg.InfiniteLine(pen=pg.mkPen(theme.VISIBLE, width=1.5))
        self._mark.setZValue(60)
        self._area.opacity.addItem(self._mark, ignoreBounds=True)
        self._rest = Pause(self, HELD_MS, self._hold)
        for view in column.views:
            view.setStatusTip("Slices (S)")
            view.installEventFilter(self)
            RightClick(view.viewport(), column.button.menu())
            for each in self.filters:
                view.viewport().installEventFilter(each)
        for pane in self._context.panes:
            pane.canvas.decorations.append(self._paint)
            # After the view's keys, so that this filter is called first.
            pane.canvas.installEventFilter(self)
        return column

    def _resize(self) -> None:
        assert self.column is not None
        whole, high = self._row.width(), self._row.height()
        width = self._width or max(round(SMALL * high), NARROWEST)
        if self.column.large is not None:
            width = max(width, round(LARGE * whole))
        self._row.setSizes([whole - width, width])

    def _keep_width(self) -> None:
        if self.column is not None and self.column.large is None:
            self._width = self.column.width()

    def _keep_place(self) -> None:
        self._context.workspace.keep(cross_hair=self.state.place)
        self._context.update_images()

    def _keep_paint(self) -> None:
        self._context.workspace.keep(slice_colors=self.state.colors, gray_window=self.state.window)

    def _follow_question(self, what: str) -> None:
        """Outline the band of values."""
        asked, volume = self._context.sensitivity, self.state.volume
        if what in ("band", "choices") and volume is not None:
            band = asked.band if asked.choices.shown else None
            width, whole = asked.choices.width, volume.scalar_range
            # Nothing covers the slice in which the mouse rests.
            if band is None or (self._holds and not band.kept):
                self.state.show(band=None)
            else:
                self.state.show(band=band_of_edit(band.values, whole, width))

    def _go_to_click(self) -> None:
        if self.is_shown and self._context.sensitivity.place != self._restored:
            self._go(None)

    def _go_back(self) -> None:
        self._restored = self._context.sensitivity.place
        self.state.move(self._before)

    def _go(self, step: int | None) -> None:
        """Put the cross-hair onto a surface under a click in an image, if None the most visible."""
        place, volume = self._context.sensitivity.place, self.state.volume
        if place is None or volume is None:
            return
        inputs, point = self._context.state.inputs, self._context.workspace.pieces.point
        found = ray_places(volume, inputs, from_middle(place))
        if not found:
            self._context.status.say("Nothing shows there, so the cross-hair stays.")
            return
        if step is None and point is not None:
            away = [math.dist(point, each) for each, _share in found]
            self._step, there = away.index(min(away)), point
        else:
            self._step = min(max(step or 0, 0), len(found) - 1)
            there = found[self._step][0]
        self.state.move(there)
        # The values of voxels may be others, at the surface of a material.
        (value,) = values_at(volume, np.array([there]), inputs.is_nearest(volume), inputs.mask)
        what = self._context.state.value_text(float(value))
        share = f"{100 * found[self._step][1]:.0f} % of the pixel's opacity"
        which = f"{self._step + 1} of {len(found)} along the line of sight"
        self._context.status.say(f"Place {which}, interpolated value {what}: {share}.")

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Step along the ray through the clicked point with the keys up and down."""
        if event.type() == QEvent.Type.MouseButtonPress:
            self._before = self.state.place
        elif event.type() == QEvent.Type.MouseButtonDblClick and watched not in self.areas:
            # It returns to the first view; once its first click is undone, so is this.
            QTimer.singleShot(0, self, self._go_back)
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
        value, own, volume, self._pointed = None, None, self.state.volume, place
        if place is not None and volume is not None:
            x, y, z = voxel_of(volume, place)
            lowest, highest = volume.scalar_range
            own = float(volume.shown[z, y, x])
            value = min(max(own, lowest), highest)
        if self._holds and value != self._under:
            self._holds = False
            self._context.sensitivity.hover(None)
        self._under = value
        self._mark.setVisible(value is not None)
        self._rest.stop()
        if value is not None:
            self._mark.setPos(self._area.axis.place(value))
            # Beyond the range, the end's field would be that of other voxels, too.
            if value == own:
                self._rest.start()

    def _hold(self) -> None:
        if self._under is not None and self._context.sensitivity.choices.shown:
            self._holds = True
            self._context.sensitivity.hover(self._under, effect=False)

    def _paint(self, painter: QPainter, square: QRect) -> None:
        state, point = self._context.state, np.array([self.state.place])
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
