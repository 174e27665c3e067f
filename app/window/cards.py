"""Cards over the images: a first volume, which way is up, the crop box."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QHideEvent, QIcon, QImage
from PySide6.QtWidgets import (
    QApplication,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QToolButton,
    QVBoxLayout,
)
from superqt import QDoubleRangeSlider, QDoubleSlider

from app import theme
from app.controls import Card, WheelGuard, clicked, fill, label, named, picture_icon, picture_tip
from app.engines.background import Pause
from app.engines.client import EngineState
from app.engines.requests import Quality
from app.icons import IconButton
from app.number_box import WholeNumberBox
from app.state.viewer_state import ViewerState
from app.window.context import Context
from app.window.files import Files
from app.window.small_pictures import SmallPictures
from model.scene.crop import WITHOUT_VOLUME, CropBox, axis_name, least_length, place_of, voxel_at
from model.scene.orientation import home_view
from model.scene.view import AXES, DEFAULT_UP, View
from model.volume_files.shipped import picture_of, shipped_volumes, title_of

SAMPLE_PICTURE = 72  # side of a sample's picture, in pixels
EDGE = 8  # least distance to the edges of the image, in pixels


class EmptyCard(Card):
    """Offers a first volume in the middle of the reference's image if none could be read."""

    def __init__(self, context: Context, files: Files) -> None:
        self._pane, self._workspace = context.panes[1], context.workspace
        super().__init__(self._pane.canvas)
        button = named(QPushButton("Open…"), tip="Open a volume's file (Ctrl+O)")
        self.open = clicked(button, files.ask_and_open)
        self.samples: list[QToolButton] = []
        for path in shipped_volumes():
            title, open_it = title_of(path), partial(files.open_volume, path)
            name = f"Open the sample volume {title}"
            self.samples.append(_picture_button(title, name, SAMPLE_PICTURE, open_it))
            self.samples[-1].setIcon(QIcon(str(picture_of(path))))
        head = fill(
            QHBoxLayout(), label("Drop a volume here, or", "title"), self.open, 0, spacing=6
        )
        pictures = fill(QHBoxLayout(), *self.samples, spacing=6)
        fill(QVBoxLayout(self), head, pictures, margins=(12, 8, 12, 8), spacing=6)
        self.hide()
        self._pane.canvas.resized.connect(self._place)
        self._pane.client.stateChanged.connect(self._follow)

    def _follow(self, state: EngineState) -> None:
        self.set_shown(state is EngineState.FAILED and self._workspace.opened is None)

    def set_shown(self, shown: bool) -> None:
        """Show the card below the image's message, or hide it."""
        self.setVisible(shown)
        self._pane.canvas.below_message = self if shown else None
        if shown:
            self._place()

    def _place(self) -> None:
        self.adjustSize()
        room = self._pane.canvas.size() - self.size()
        top = min(room.height() // 2 + self.height() // 4, room.height() - EDGE)
        self.move(max(room.width() // 2, 0), max(top, 0))
        self.raise_()


def _picture_button(text: str, name: str, size: int, slot: Callable[[], object]) -> QToolButton:
    button = named(QToolButton(), name)
    button.setText(text)
    button.setIconSize(QSize(size, size))
    button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextUnderIcon)
    return clicked(button, slot)


ICON, PICTURE = 40, 200  # sides of the pictures on the buttons and next to the mouse, in pixels
TF_REST_MS = 300  # pause after an edit of the TF until the pictures follow it


class UpAxisCard(Card):
    """Asks which way is up, with one button per axis; hidden unless a file does not say."""

    def __init__(self, context: Context) -> None:
        super().__init__()
        self._context, self._state, self._workspace = context, context.state, context.workspace
        quick = Quality(PICTURE, live=True)
        self._pictures = SmallPictures("up axis", quick, context, self._show_pictures)
        self.buttons: dict[str, QToolButton] = {}
        self._views: list[View] = []  # of the pictures, one for each axis; slow to find
        self._lay_out()
        self._rest = Pause(self, TF_REST_MS, self._ask_for_pictures)
        self._state.viewChangeFinished.connect(self._follow_view)
        self._state.navigationChanged.connect(self._follow)
        self._state.tf_input.changeFinished.connect(lambda _tf: self._rest.start())
        # The first picture is drawn, or a restarted analyst has lost the request.
        self._workspace.reference.analystReplaced.connect(self._ask_for_pictures)
        self.hide()

    def ask(self) -> None:
        """Show the question again; the axis that points up now is marked."""
        self._set_pictures({})
        for axis, button in self.buttons.items():
            button.setCheckable(axis == self._state.up_axis)
            button.setChecked(axis == self._state.up_axis)
        self.show()
        self._ask_for_pictures()

    def _follow_view(self) -> None:
        # A user who turns the volume has seen the question; View > Up shows it again.
        if not (self._state.is_at_home or self.underMouse()):
            self.hide()

    def hideEvent(self, event: QHideEvent) -> None:
        """Draw no pictures."""
        super().hideEvent(event)
        self._pictures.stop_tracing()

    def _lay_out(self) -> None:
        tip = "Keep the volume as it is, and do not ask again"
        leave = IconButton("close", "Keep it", tip=tip, colors=theme.ON_IMAGE)
        self.leave = clicked(leave, self._remember)
        for axis in AXES:
            text, choose = axis.replace("-", "−"), partial(self._choose, axis)
            self.buttons[axis] = _picture_button(text, f"{axis} is up", ICON, choose)
        head = fill(QHBoxLayout(), label("Which way is up?", "title"), 0, self.leave)
        pictures = fill(QHBoxLayout(), *self.buttons.values(), spacing=4)
        note = label("The file does not say; left and right may be swapped, too.", "dim")
        fill(QVBoxLayout(self), head, note, pictures, margins=(12, 4, 8, 8), spacing=2)

    def _set_pictures(self, pictures: Mapping[str, QImage]) -> None:
        for axis, button in self.buttons.items():
            picture = pictures.get(axis)
            text = f"Turn the volume so that its {axis} axis points up"
            button.setIcon(picture_icon(picture, ICON))
            button.setToolTip(text if picture is None else picture_tip(picture, text))

    def _choose(self, axis: str) -> None:
        self._state.set_up_axis(axis)
        self._remember()

    def start_volume(self) -> None:
        """Ask about another volume, unless its file or the user has set which way is up."""
        opened = self._workspace.opened
        self._views = []
        if opened is None:
            return
        known = opened.volume.up or self._remembered(opened.fingerprint)
        # A user who has turned it before, or saved a session, has seen the question.
        is_seen = not self._state.is_at_home or self._workspace.opening.shown.memory is not None
        is_known = bool(known) or is_seen
        if is_known or opened.path.absolute() in {p.absolute() for p in shipped_volumes()}:
            self.hide()
            return
        self.ask()

    def _remembered(self, fingerprint: str) -> str:
        return self._context.preferences.volume(fingerprint).up_axis

    def _ask_for_pictures(self) -> None:
        opened = self._workspace.opened
        # The first picture comes before them.
        if opened is None or self.isHidden() or not self._workspace.reference.has_drawn:
            return
        if not self._views:
            place = opened.volume.proportions
            homes = [home_view(place, axis, points=opened.shown) for axis in AXES]
            self._views = [self._state.for_picture(home) for home in homes]
        self._pictures.ask([replace(self._state.inputs, view=view) for view in self._views])

    def _show_pictures(self, images: list[QImage]) -> None:
        if not self.isHidden():
            self._set_pictures(dict(zip(AXES, images, strict=True)))

    def _follow(self) -> None:
        """Store an axis that was chosen elsewhere."""
        opened = self._workspace.opened
        if opened is not None:
            known = self._remembered(opened.fingerprint) or opened.volume.up
            if self._state.up_axis != (known or DEFAULT_UP):
                self._remember()

    def _remember(self) -> None:
        self.hide()
        self._workspace.keep(up_axis=self._state.up_axis)


SLIDER_WIDTH = 180  # least width of a slider, in pixels
PADDING = 22  # width of a voxel's box next to its number, in pixels


class CropCard(Card):
    """Shows the state's crop box and changes it; initially hidden."""

    shownChanged = Signal(bool)  # emitted when it is shown or hidden, other than with its window

    def __init__(self, state: ViewerState) -> None:
        super().__init__()
        self._state = state
        self._dimensions = WITHOUT_VOLUME
        self.names = [QLabel() for _ in range(3)]
        self.sliders = [
            QDoubleRangeSlider(Qt.Orientation.Horizontal)  # type: ignore[no-untyped-call]
            for _ in range(3)
        ]
        self.planes = [(_voxel_box(), _voxel_box()) for _ in range(3)]
        self.offset = QDoubleSlider(Qt.Orientation.Horizontal)  # type: ignore[no-untyped-call]
        turn = "Cut by a plane across the line of sight; drag its arrow to turn it"
        self.whole = _button("Whole volume", "Show all of the volume again", state.show_whole)
        self.face = _button("Face the viewer", turn, state.face_clip)
        self.flip = _button("Flip", "Cut away the other side of the plane", state.flip_clip)
        remove = partial(state.clip_input.set, None)
        self.uncut = _button("Remove", "Remove the plane; the crop box stays", remove)
        tip = "Close this card; the volume stays cropped"
        dismiss = IconButton("close", "Close", "K", tip, colors=theme.ON_IMAGE)
        self.dismiss = clicked(dismiss, lambda: self.set_shown(False))
        self._lay_out()
        for cut in (state.crop_input, state.clip_input):
            cut.changed.connect(self._show)
        state.navigationChanged.connect(self._name)
        self.set_volume(WITHOUT_VOLUME)
        self.hide()

    @property
    def is_shown(self) -> bool:
        """Whether the card is shown when its window is."""
        return not self.isHidden()

    def set_shown(self, shown: bool) -> None:
        """Show or hide the card; the crop box stays as it is."""
        focus = QApplication.focusWidget()
        if not shown and focus is not None and self.isAncestorOf(focus):
            # Otherwise the next number box would get the focus.
            self.window().setFocus()
        if shown != self.is_shown:
            for slider in (*self.sliders, self.offset):
                # A hidden slider does not get the mouse's release.
                slider.setSliderDown(False)
            self.setVisible(shown)
            self.shownChanged.emit(shown)

    def set_volume(self, dimensions: tuple[int, int, int]) -> None:
        """Set the number of voxels along x, y and z."""
        self._dimensions = dimensions
        for axis, count in enumerate(dimensions):
            # The ends cannot get closer to each other than this.
            self.sliders[axis].setSingleStep(least_length(count))
            for box in self.planes[axis]:
                box.setFixedWidth(box.fontMetrics().horizontalAdvance(f"{count}") + PADDING)
        self._name()
        self._show()

    def _lay_out(self) -> None:
        head = fill(QHBoxLayout(), label("Crop", "title"), 0, self.whole, self.dismiss, spacing=6)
        rows = QGridLayout()
        rows.setHorizontalSpacing(8)
        rows.setVerticalSpacing(4)
        rows.setColumnStretch(2, 1)
        for axis, (first, last) in enumerate(self.planes):
            slider = self.sliders[axis]
            slider.setToolTip("Drag an end, or the middle to move the slab")
            slider.setMinimumWidth(SLIDER_WIDTH)
            slider.setRange(0.0, 1.0)
            # The keyboard uses the number boxes instead.
            slider.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            WheelGuard(slider)
            for column, widget in enumerate((self.names[axis], first, slider, last)):
                rows.addWidget(widget, axis, column)
            slider.valueChanged.connect(partial(self._drag, axis))
            slider.sliderReleased.connect(self._state.crop_input.finish)
            for side, box in enumerate((first, last)):
                box.valueChanged.connect(partial(self._type, axis, side))
        offset = self.offset
        offset.setRange(-1.0, 1.0)
        name = "Place of the clipping plane along its normal"
        named(offset, name, "Move the plane along its normal")
        offset.setSingleStep(0.01)
        offset.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        WheelGuard(offset)
        offset.valueChanged.connect(self._move_plane)
        # A press beside the handle moves it first.
        finish = partial(self._state.clip_input.finish, merge_key="clipping plane")
        offset.sliderReleased.connect(finish)
        rows.addWidget(QLabel("Plane"), 3, 0)
        rows.addWidget(offset, 3, 1, 1, 3)
        buttons = fill(QHBoxLayout(), 0, self.face, self.flip, self.uncut, spacing=6)
        fill(QVBoxLayout(self), head, rows, buttons, margins=(12, 6, 8, 8), spacing=4)

    def _name(self) -> None:
        for axis, count in enumerate(self._dimensions):
            name = axis_name(axis, self._state.axis_labels)
            self.names[axis].setText(name)
            self.sliders[axis].setAccessibleName(f"Shown part along {name}")
            for end, box in zip(("First", "Last"), self.planes[axis], strict=True):
                meaning = f"{end} voxel along {name}"
                box.setAccessibleName(meaning)
                box.setToolTip(f"{meaning}\nVoxels are numbered from 1 to {count}")

    def _show(self) -> None:
        crop, clip = self._state.crop or CropBox(), self._state.clip
        self.whole.setEnabled(self._state.crop is not None or clip is not None)
        for widget in (self.offset, self.flip, self.uncut):
            widget.setEnabled(clip is not None)
        with QSignalBlocker(self.offset):
            self.offset.setValue(0.0 if clip is None else clip.offset)
        for axis, count in enumerate(self._dimensions):
            span = crop.low[axis], crop.high[axis]
            with QSignalBlocker(self.sliders[axis]):
                self.sliders[axis].setValue(span)
            first, last = (1 + voxel_at(place, count) for place in span)
            apart = math.ceil(least_length(count) * (count - 1) - 1e-9)
            self.planes[axis][0].set_limits(1, max(last - apart, first))
            self.planes[axis][1].set_limits(min(first + apart, last), count)
            for box, voxel in zip(self.planes[axis], (first, last), strict=True):
                box.show_value(voxel)

    def _drag(self, axis: int, span: tuple[float, float]) -> None:
        crop = self._state.crop or CropBox()
        self._state.crop_input.move(crop.with_span(axis, *span))

    def _move_plane(self, offset: float) -> None:
        if self._state.clip is not None:
            self._state.clip_input.move(replace(self._state.clip, offset=offset))
            if not self.offset.isSliderDown():
                # A key has moved it, so no release ends the change.
                self._state.clip_input.finish(merge_key="clipping plane")

    def _type(self, axis: int, side: int, voxel: int) -> None:
        crop, count = self._state.crop or CropBox(), self._dimensions[axis]
        place, least = place_of(voxel - 1, count), least_length(count)
        self._state.crop_input.set(crop.with_plane(axis, side, place, least))
        self._show()


def _button(text: str, tip: str, slot: Callable[[], object]) -> QPushButton:
    """A button that takes no focus, so that keys such as W stay the window's."""
    button = clicked(named(QPushButton(text), tip=tip), slot)
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button


def _voxel_box() -> WholeNumberBox:
    """A box for the number of a voxel; typed numbers apply on Enter or focus loss."""
    box = WholeNumberBox()
    box.setKeyboardTracking(False)
    box.setAlignment(Qt.AlignmentFlag.AlignRight)
    return box
