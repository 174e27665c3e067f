"""The question which way is up, with a picture for each axis; asked once per volume."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QToolButton, QVBoxLayout

from app import theme
from app.controls import picture_icon, picture_tip
from app.icons import IconButton
from app.window.context import Context
from app.window.small_pictures import SmallPictures
from model.scene.orientation import home_view
from model.scene.view import AXES, DEFAULT_UP
from model.volume_files.shipped import shipped_volumes

ICON, PICTURE = 40, 200
"""Sides of the pictures on the buttons, and next to the mouse, in pixels."""

TF_REST_MS = 300
"""Pause after an edit of the TF until the pictures follow it."""


class UpAxisCard(QFrame):
    """Asks with six buttons, one per axis; hidden until there is a volume that does not say."""

    def __init__(self, context: Context) -> None:
        super().__init__()
        self._context, self._state, self._workspace = context, context.state, context.workspace
        self._pictures = SmallPictures("up axis", PICTURE, context, self._show_pictures)
        self._buttons: dict[str, QToolButton] = {}
        self._lay_out()
        self._rest = QTimer(self, singleShot=True, interval=TF_REST_MS)
        self._rest.timeout.connect(self._ask_for_pictures)
        self._workspace.volumeStarted.connect(self._consider)
        self._state.navigationChanged.connect(self._follow)
        self._state.tf_input.changeFinished.connect(lambda _tf: self._rest.start())
        # An analyst that was started anew knows of no question.
        self._workspace.reference.analystReplaced.connect(self._ask_for_pictures)
        self.hide()

    def ask(self, present: str = "") -> None:
        """Show the question; the button of the axis that points up now is marked."""
        self._set_pictures({})
        for axis, button in self._buttons.items():
            button.setCheckable(axis == present)
            button.setChecked(axis == present)
        self.show()

    def button(self, axis: str) -> QToolButton:
        """Return an axis' button."""
        return self._buttons[axis]

    def _lay_out(self) -> None:
        self.setProperty("role", "card")
        self.setCursor(Qt.CursorShape.ArrowCursor)
        title = QLabel("Which way is up?")
        title.setProperty("role", "title")
        tip = "Keep the volume as it is, and do not ask again"
        self.leave = IconButton("close", "Keep it", tip=tip, colors=theme.ON_IMAGE)
        self.leave.clicked.connect(self._remember)
        head = QHBoxLayout()
        head.addWidget(title)
        head.addStretch()
        head.addWidget(self.leave)
        pictures = QHBoxLayout()
        pictures.setSpacing(4)
        for axis in AXES:
            button = self._buttons[axis] = QToolButton()
            button.setText(axis.replace("-", "−"))
            button.setIconSize(QSize(ICON, ICON))
            button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextUnderIcon)
            button.setAccessibleName(f"{axis} is up")
            # After a click the card is gone, and another button would have its focus.
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(partial(self._choose, axis))
            pictures.addWidget(button)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 4, 8, 8)
        column.setSpacing(2)
        column.addLayout(head)
        column.addLayout(pictures)

    def _set_pictures(self, pictures: Mapping[str, QImage]) -> None:
        for axis, button in self._buttons.items():
            picture = pictures.get(axis)
            text = f"Turn the volume so that its {axis} axis points up"
            button.setIcon(picture_icon(picture, ICON))
            button.setToolTip(text if picture is None else picture_tip(picture, text))

    def _choose(self, axis: str, _checked: bool = False) -> None:
        self.hide()
        self._state.set_up_axis(axis)
        self._remember()

    def _consider(self) -> None:
        opened = self._workspace.opened
        if opened is None:
            return
        known = opened.volume.up or self._remembered(opened.fingerprint)
        if known or opened.path.absolute() in {p.absolute() for p in shipped_volumes()}:
            self.hide()
            return
        self.ask(self._state.up_axis)
        self._ask_for_pictures()

    def _remembered(self, fingerprint: str) -> str:
        return self._context.preferences.volume(fingerprint).up_axis

    def _ask_for_pictures(self) -> None:
        opened = self._workspace.opened
        if opened is None or self.isHidden():
            return
        proportions, points = opened.volume.proportions, opened.shown
        homes = [home_view(proportions, axis, points=points) for axis in AXES]
        views = [self._state.for_picture(home) for home in homes]
        self._pictures.ask([replace(self._state.inputs, view=view) for view in views])

    def _show_pictures(self, images: list[QImage]) -> None:
        if not self.isHidden():
            self._set_pictures(dict(zip(AXES, images, strict=True)))

    def _follow(self) -> None:
        """Remember an axis that was chosen elsewhere."""
        opened = self._workspace.opened
        if opened is not None:
            known = self._remembered(opened.fingerprint) or opened.volume.up
            if self._state.up_axis != (known or DEFAULT_UP):
                self._remember()

    def _remember(self) -> None:
        opened = self._workspace.opened
        self._pictures.stop_tracing()
        if opened is not None:
            self.hide()
            self._context.preferences.note_volume(opened.fingerprint, up_axis=self._state.up_axis)
