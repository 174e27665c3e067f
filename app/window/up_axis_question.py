"""The question which way is up, with a picture for each axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QObject, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from app import theme
from app.controls import picture_icon, picture_tip
from app.engines.client import EngineClient
from app.icons import IconButton
from app.state.brightness import Brightness
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.small_pictures import SmallPictures
from model.scene.axes import AXES, DEFAULT_UP
from model.scene.orientation import home_view
from model.volume_files.shipped import shipped_volumes

ICON = 56
"""Side of the pictures on the buttons, in pixels."""

PICTURE = 200
"""Side of the pictures that are shown next to the mouse."""


class UpAxisCard(QFrame):
    """Asks with six buttons, one per axis; hidden until :meth:`ask`, and after the answer."""

    chosen = Signal(str)
    """Emitted with one of :data:`~model.scene.axes.AXES`."""
    dismissed = Signal()
    """Emitted when the user does not want to say."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self._buttons: dict[str, QToolButton] = {}
        title = QLabel("Which way is up?")
        title.setProperty("role", "title")
        self.leave = IconButton(
            "close",
            "Leave it",
            tip="Keep the volume as it stands, and do not ask again",
            colors=theme.ON_IMAGE,
        )
        self.leave.clicked.connect(self._dismiss)
        head = QHBoxLayout()
        head.addWidget(title)
        head.addStretch()
        head.addWidget(self.leave)
        pictures = QHBoxLayout()
        pictures.setSpacing(4)
        for axis in AXES:
            button = QToolButton()
            button.setText(axis.replace("-", "−"))
            button.setIconSize(QSize(ICON, ICON))
            button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextUnderIcon)
            button.setAccessibleName(f"{axis} is up")
            # After a click the card is gone, and another button would have its focus.
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(partial(self._choose, axis))
            self._buttons[axis] = button
            pictures.addWidget(button)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 4, 8, 8)
        column.setSpacing(2)
        column.addLayout(head)
        column.addLayout(pictures)
        self.hide()

    def ask(self, present: str = "") -> None:
        """Show the question, without pictures until they are set.

        Parameters
        ----------
        present : str
            Axis that points up now; its button is marked. Empty for none.
        """
        self.set_pictures({})
        for axis, button in self._buttons.items():
            button.setCheckable(axis == present)
            button.setChecked(axis == present)
        self.show()

    def set_pictures(self, pictures: Mapping[str, QImage]) -> None:
        """Show on each button how the volume looks with its axis up.

        Parameters
        ----------
        pictures : mapping of str to QImage
            By axis, with sides of :data:`PICTURE`; a button without one has three dots.
        """
        for axis, button in self._buttons.items():
            picture = pictures.get(axis)
            text = f"Turn the volume so that {axis} of its file at the top"
            button.setIcon(picture_icon(picture, ICON))
            button.setToolTip(text if picture is None else picture_tip(picture, text))

    def button(self, axis: str) -> QToolButton:
        """Return an axis' button."""
        return self._buttons[axis]

    def _choose(self, axis: str, _checked: bool = False) -> None:
        self.hide()
        self.chosen.emit(axis)

    def _dismiss(self) -> None:
        self.hide()
        self.dismissed.emit()


TF_REST_MS = 300
"""Pause after an edit of the TF until the pictures follow it."""


class UpAxisQuestion(QObject):
    """Shows the six buttons once per volume.

    Parameters
    ----------
    analyst, reference : EngineClient
        Draw the buttons' pictures; see :class:`~app.window.small_pictures.SmallPictures`.
    """

    def __init__(
        self,
        bar: UpAxisCard,
        state: ViewerState,
        workspace: Workspace,
        analyst: EngineClient,
        reference: EngineClient,
        brightness: Brightness,
        preferences: Preferences,
    ) -> None:
        super().__init__(bar)
        self._bar = bar
        self._state = state
        self._workspace = workspace
        self._preferences = preferences
        self._pictures = SmallPictures("up axis", PICTURE, analyst, reference, brightness, self)
        self._pictures.drawn.connect(self._show_pictures)
        workspace.volumeStarted.connect(self._consider)
        bar.chosen.connect(state.set_up_axis)
        bar.chosen.connect(lambda _axis: self._remember())
        bar.dismissed.connect(self._remember)
        state.navigationChanged.connect(self._follow)
        self._rest = QTimer(self, singleShot=True, interval=TF_REST_MS)
        self._rest.timeout.connect(self._ask_for_pictures)
        state.tf_input.changeFinished.connect(lambda _tf: self._rest.start())
        # An analyst that was started anew knows of no question.
        workspace.reference.analystReplaced.connect(self._ask_for_pictures)

    def _consider(self) -> None:
        opened = self._workspace.opened
        if opened is None:
            return
        known = opened.volume.up or self._preferences.volume(opened.fingerprint).up_axis
        if known or opened.path.absolute() in {p.absolute() for p in shipped_volumes()}:
            self._bar.hide()
            return
        self._bar.ask(self._state.up_axis)
        self._ask_for_pictures()

    def _ask_for_pictures(self) -> None:
        opened = self._workspace.opened
        if opened is None or self._bar.isHidden():
            return
        proportions, points = opened.volume.proportions, opened.shown
        homes = [home_view(proportions, axis, points=points) for axis in AXES]
        views = [self._state.for_picture(home) for home in homes]
        traced = self._workspace.reference.settings.lighting == "path"
        self._pictures.ask([replace(self._state.inputs, view=view) for view in views], traced)

    def _show_pictures(self, images: list[QImage]) -> None:
        if not self._bar.isHidden():
            self._bar.set_pictures(dict(zip(AXES, images, strict=True)))

    def _follow(self) -> None:
        """Remember an axis that was chosen elsewhere."""
        opened = self._workspace.opened
        if opened is None:
            return
        known = self._preferences.volume(opened.fingerprint).up_axis or opened.volume.up
        if self._state.up_axis != (known or DEFAULT_UP):
            self._remember()

    def _remember(self) -> None:
        opened = self._workspace.opened
        self._pictures.trace_no_more()
        if opened is not None:
            self._bar.hide()
            self._preferences.note_volume(opened.fingerprint, up_axis=self._state.up_axis)
