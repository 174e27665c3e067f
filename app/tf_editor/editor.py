"""The TF editor: header, plots, card of numbers, height in the window, and memory."""

from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QSize, Qt, Signal
from PySide6.QtGui import QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QFrame, QHBoxLayout, QSplitter, QVBoxLayout, QWidget

from app.caption_button import CaptionButton
from app.controls import fill
from app.icons import IconButton
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.tf_editor.handles import HandleMoves, Selection, handle_name
from app.tf_editor.mode_card import ModeCard
from app.tf_editor.plot_area import PINS_HEIGHT, PlotArea
from app.tf_editor.plot_gestures import EditorKeys, PlotGestures
from app.tf_editor.range_layer import RangeLayer
from app.tf_editor.tf_layers import ColorLayer, OpacityLayer
from app.tf_editor.tf_menu import TransferFunctionMenu
from app.tf_editor.unit_axis import OpacityScale, ScalarAxis
from model.scene.transfer_function import Range, TransferFunction

HEADER_HEIGHT = 34

LEAST_WIDTH = 960
LEAST_HEIGHT, GREATEST_HEIGHT = 180, 460
"""Least width, and limits of its height unless it is dragged, in pixels."""

UNLIMITED = 2**24 - 1  # Qt's largest height of a widget
CAPTIONED_FROM = 1180  # width from which a handle's card labels its numbers, in pixels


class TransferFunctionEditor(QFrame):
    """Edits a state's TF over a volume's histogram, at the bottom of the window."""

    resized = Signal()
    folded = Signal(bool)  # when the plots are folded or unfolded

    def __init__(self, state: ViewerState) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self._state = state
        self.selection = Selection(self)
        self.area = PlotArea(self)
        self.moves = HandleMoves(state, self.selection)
        self.opacity = OpacityLayer(self.area, self.moves)
        self.color = ColorLayer(self.area, self.moves)
        self.range = RangeLayer(self.area, state)
        PlotGestures(self.area, self.opacity, self.color, self.selection)
        self._keys = EditorKeys(self.area, self.moves, self.color)
        self.card = ModeCard(self.area, self.moves, self.color)
        self.menu = TransferFunctionMenu(self.area, self.range, self.moves, self)
        self._add_button = IconButton("plus", "Add mode", "Insert")
        self.pane_button = CaptionButton()  # names the edited one of A and B
        self.pane_button.hide()
        self._is_new = False
        self._range: Range | None = None  # scalar range of the last finished edit
        self._lay_out()
        self._connect()
        QShortcut(QKeySequence("F2"), self, self.card.edit)
        self.setEnabled(False)

    def set_data(self, opened: OpenedVolume) -> None:
        """Show a volume's histogram and allow editing."""
        self.area.set_data(opened)
        # The volume's TF follows.
        self._is_new = True
        self.setEnabled(True)

    def show_pane(self, name: str) -> None:
        """Name the pane whose TF is edited; empty where there is no other."""
        self.pane_button.title = f"TF of {name}"
        self.pane_button.setVisible(bool(name))

    def set_scale(self, opened: OpenedVolume) -> None:
        """Show the same volume on another scale."""
        self.set_data(opened)
        if self._state.scale == opened.volume.scale:
            # No TF follows: undo has restored this one.
            self._follow_tf(self._state.transfer_function)

    def _connect(self) -> None:
        area, tf, card, opacity = self.area, self._state.tf_input, self.card, self.opacity
        for changed, *follow in (
            (tf.exchanged, self.selection.start),
            (tf.changed, self._take_tf),
            (tf.changeFinished, self._finish_tf),
            (self.selection.changed, opacity.refresh, self.color.refresh, card.refresh),
            (area.axisChanged, self._draw, card.place, self.menu.show_scales),
            (area.heightChanged, self.range.fit_height, card.place),
            (area.flagsMoved, card.place),
            (area.recolored, opacity.recolor, self.range.recolor, card.refresh),
            (area.widget.scene().sigMouseClicked, self._click),
            (self._add_button.clicked, self._keys.add_in_the_middle),
        ):
            for each in follow:
                changed.connect(each)

    def _take_tf(self, tf: TransferFunction) -> None:
        # First, so that nothing finds a selected handle that no longer exists.
        self.selection.fit(tf)
        self._follow_tf(tf)
        self._state.refreshes.ask(self._draw, self._draw)

    def _finish_tf(self, tf: TransferFunction) -> None:
        for handle in (*self.opacity.handles, *self.color.stops, *self.range.lines):
            handle.rest()
        self._follow_range(tf)
        # Not while something moves: the plot has the numbers then.
        self.card.refresh()
        self.menu.show_colors()

    def _draw(self) -> None:
        for layer in (self.opacity, self.color, self.range):
            layer.refresh()

    def _follow_tf(self, tf: TransferFunction) -> None:
        """Show the range of a new volume's TF, and whether modes or points can be added."""
        if self._is_new:
            self._is_new = False
            self.range.show_range()
        name = f"Add {handle_name(tf.opacity)}"
        self._add_button.setAccessibleName(name)
        self._add_button.setToolTip(f"{name} (Insert)")

    def _follow_range(self, tf: TransferFunction) -> None:
        """Fit the axis to the TF's values, and show a range that is out of sight."""
        self.area.include(tf.scalar_range, tf.scale)
        is_new, self._range = self._range != tf.scalar_range, tf.scalar_range
        # A range that is dragged has a visible end.
        places = self.area.axis.places(tf.scalar_range)
        if is_new and not np.any((places >= 0.0) & (places <= 1.0)):
            self.range.show_range()

    @property
    def is_folded(self) -> bool:
        """Whether the plots are folded."""
        return self.area.widget.isHidden()

    def set_folded(self, folded: bool) -> None:
        """Fold the plots, so that only the header is left, or unfold them."""
        self.area.widget.setHidden(folded)
        self.setMinimumHeight(HEADER_HEIGHT if folded else LEAST_HEIGHT)
        self.setMaximumHeight(HEADER_HEIGHT if folded else UNLIMITED)
        self.folded.emit(folded)

    def _lay_out(self) -> None:
        header = QWidget()
        header.setFixedHeight(HEADER_HEIGHT)
        self.areas: list[QWidget] = [header, self.area.widget, self.card]
        """Parts that the Tab key visits."""
        menu = self.menu
        self.header_controls: list[QWidget] = [
            menu.presets_button, menu.colors_button, self._add_button, menu.button,
        ]  # fmt: skip
        # What changes its width is last, so that the other parts keep their places.
        parts: list[QWidget | int] = [*self.header_controls, self.pane_button, 0]
        self.header = fill(QHBoxLayout(header), *parts, margins=(8, 0, 8, 0), spacing=4)
        plots = fill(QVBoxLayout(), header)
        plots.addWidget(self.area.widget, 1)
        self.row = fill(QHBoxLayout(self))  # the panels at the right, as high as header and plots
        self.row.addLayout(plots, 1)
        self.setMinimumHeight(LEAST_HEIGHT)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fold parts for which there is no room."""
        super().resizeEvent(event)
        self.card.is_short = self.menu.is_narrow = self.width() < CAPTIONED_FROM
        self.resized.emit()

    def minimumSizeHint(self) -> QSize:
        """Return the minimum size with folded parts."""
        return super().minimumSizeHint().boundedTo(QSize(LEAST_WIDTH, LEAST_HEIGHT))

    def sizeHint(self) -> QSize:
        """Return a size at which nothing is folded."""
        return QSize(CAPTIONED_FROM, LEAST_HEIGHT)

    def _click(self, event: Any) -> None:
        """Handle a click in one of the plots; handles keep their own clicks."""
        at: QPointF = event.scenePos()
        area, left = self.area, event.button() == Qt.MouseButton.LeftButton
        if area.opacity.sceneBoundingRect().contains(at):
            place = area.opacity.mapSceneToView(at)
            value, opacity = area.axis.value(place.x()), area.scale.opacity(place.y())
            if event.button() == Qt.MouseButton.RightButton:
                text = f"Add {handle_name(self._state.transfer_function.opacity)} here"
                screen = event.screenPos()
                point = QPoint(int(screen.x()), int(screen.y()))
                area.pop_up(point, (text, lambda: self.moves.add_opacity(value, opacity), True))
            elif left and event.double():
                self.moves.add_opacity(value, opacity)
            elif left:
                self.selection.clear()
        elif left and area.strip.sceneBoundingRect().adjusted(0, 0, 0, PINS_HEIGHT).contains(at):
            self.moves.add_stop(area.axis.value(area.strip.mapSceneToView(at).x()))


SHARE = 0.25  # height of the editor, as a part of the window's, unless it is dragged
HANDLE = 1  # height of the dragged line, in pixels: the mouse has 5


class DockSplitter(QSplitter):
    """Keeps the editor's share of the window's height: the usual one, or the dragged one."""

    shareChanged = Signal()

    def __init__(self, images: QWidget, editor: TransferFunctionEditor) -> None:
        super().__init__(Qt.Orientation.Vertical)
        self.share: float | None = None
        """Share of the window's height after a drag; None for the usual one."""
        self.setHandleWidth(HANDLE)
        self.setChildrenCollapsible(False)
        self._editor = editor
        self.addWidget(images)
        self.addWidget(editor)
        self.setStretchFactor(0, 1)
        handle = self.handle(1)
        handle.installEventFilter(self)
        handle.setToolTip(
            "Drag to resize the editor; double-click for its usual height; F9 folds it"
        )
        editor.folded.connect(self._apply)
        self.splitterMoved.connect(lambda *_: self._note())

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Restore the usual height on a double click on the line."""
        if event.type() == QEvent.Type.MouseButtonDblClick:
            self.set_share(None)
            self.shareChanged.emit()
        return False

    def set_share(self, share: float | None) -> None:
        """Give the editor a part of the window's height; None for the usual one."""
        self.share = share
        self._apply()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the editor's share."""
        super().resizeEvent(event)
        self._apply()

    def _apply(self) -> None:
        whole = self.window().height()
        usual = min(max(round(SHARE * whole), LEAST_HEIGHT), GREATEST_HEIGHT)
        height = usual if self.share is None else round(self.share * whole)
        if self._editor.is_folded:
            height = HEADER_HEIGHT
        self.setSizes([max(self.height() - HANDLE - height, 0), height])

    def _note(self) -> None:
        self.share = self.sizes()[1] / max(self.window().height(), 1)
        self.shareChanged.emit()


class PlotMemory(QObject):
    """Keeps the plot's scales, and the values in sight, for the next time."""

    def __init__(self, area: PlotArea, preferences: Preferences) -> None:
        super().__init__(area)
        self._area = area
        self._preferences = preferences
        self._fingerprint = ""
        self._opening = ""
        area.axisChanged.connect(self._note)

    def start(self, opened: OpenedVolume, is_next: bool) -> None:
        """Take another volume's scales before it is shown; the next time step keeps them."""
        self._fingerprint, self._opening = "", opened.fingerprint
        known = self._preferences.volume(opened.fingerprint)
        if is_next and known.visible is None:
            return
        self._area.set_scale(OpacityScale(known.opacity_scale == "logarithmic"))
        full, is_logarithmic = self._area.axis.full, known.value_scale == "logarithmic"
        self._area.set_axis(ScalarAxis.over(full, is_logarithmic, opened.volume.scale))

    def settle(self) -> None:
        """Show the values that were last visible, once the volume is shown."""
        visible = self._preferences.volume(self._opening).visible
        if visible is not None and visible[0] < visible[1]:
            self._area.set_axis(self._area.axis.showing(visible))
        self._fingerprint = self._opening

    def _note(self) -> None:
        if self._fingerprint:
            axis = self._area.axis
            self._preferences.note_volume(
                self._fingerprint,
                value_scale="linear" if axis.scale == "linear" else "logarithmic",
                opacity_scale="logarithmic" if self._area.scale.logarithmic else "linear",
                visible=(float(axis.visible[0]), float(axis.visible[1])),
            )
