"""Asks which axis is up where a volume's file does not say, and remembers the answer."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject, QTimer
from PySide6.QtGui import QImage

from app.engines.client import EngineClient
from app.state.brightness import Brightness
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.small_pictures import SmallPictures
from app.window.up_axis_card import PICTURE, UpAxisCard
from model.scene.axes import AXES, DEFAULT_UP
from model.scene.orientation import home_view
from model.volume_files.shipped import shipped_volumes

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
        workspace.reference.analystStarted.connect(self._ask_for_pictures)

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
