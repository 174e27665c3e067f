"""What the window looks like, kept for the next start."""

from __future__ import annotations

from PySide6.QtCore import QByteArray, QEvent, QObject
from PySide6.QtGui import QCursor, QGuiApplication
from PySide6.QtWidgets import QMainWindow

from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.tf_editor.dock_splitter import DockSplitter
from app.tf_editor.moves import HandleMoves
from app.window.pane_layout import PaneLayout, Shown
from app.window.window_place import fitting_place

IMAGES: dict[tuple[str, ...], Shown] = {
    (): "both",
    ("reference",): "generator",
    ("generator",): "reference",
}
"""Images to show, by what is hidden."""


PARTS = 1000
"""Parts of the window's height in which the TF editor's is kept, once it was dragged."""


class WindowMemory(QObject):
    """Restores the window's size, its panes and its switches, and remembers them.

    Parameters
    ----------
    splitter : DockSplitter
        Between the images and the TF editor.
    """

    def __init__(
        self,
        window: QMainWindow,
        splitter: DockSplitter,
        panes: PaneLayout,
        state: ViewerState,
        moves: HandleMoves,
        preferences: Preferences,
    ) -> None:
        super().__init__(window)
        self._window, self._splitter, self._panes = window, splitter, panes
        self._state, self._moves = state, moves
        self._preferences = preferences
        self._restore()
        state.navigationChanged.connect(lambda: preferences.set(trackball=state.trackball))
        panes.wanted.connect(lambda _shown: self._note_panes())
        splitter.shareChanged.connect(self.note)
        window.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Remember the window's place as soon as it is moved: it may never be closed in order."""
        if event.type() in (QEvent.Type.Resize, QEvent.Type.Move) and self._window.isVisible():
            self.note()
        return False

    def note(self) -> None:
        """Remember the size of the window and of its parts."""
        geometry = bytes(self._window.saveGeometry().toBase64().data()).decode()
        self._preferences.set(
            window_geometry=geometry,
            splitters={"editor": self._editor_share()},
            colors_follow_modes=self._moves.colors_follow,
            swapped=self._panes.is_swapped,
        )

    def _editor_share(self) -> tuple[int, ...]:
        share = self._splitter.share
        return () if share is None else (round(PARTS * share),)

    def _note_panes(self) -> None:
        hidden = next(hidden for hidden, shown in IMAGES.items() if shown == self._panes.shown)
        self._preferences.set(hidden_panes=hidden)

    def _restore(self) -> None:
        values = self._preferences.values
        if values.window_geometry:
            self._window.restoreGeometry(QByteArray.fromBase64(values.window_geometry.encode()))
            self._bring_back()
        share = values.splitters.get("editor", ())
        if len(share) == 1 and 0 < share[0] < PARTS:
            self._splitter.set_share(share[0] / PARTS)
        self._moves.colors_follow = values.colors_follow_modes
        self._state.set_trackball(values.trackball)
        self.restore_panes()

    def restore_panes(self) -> None:
        """Show the images that are remembered, where they were."""
        values = self._preferences.values
        if values.swapped != self._panes.is_swapped:
            self._panes.swap()
        shown = IMAGES.get(values.hidden_panes)
        if shown is not None:
            self._panes.show_images(shown)

    def _bring_back(self) -> None:
        """Move the window to a screen that is there, if the one that it was on is gone."""
        window = self._window
        if QGuiApplication.platformName() == "offscreen":
            # There nothing is seen, and the screen is smaller than any.
            return
        here = QGuiApplication.screenAt(QCursor.pos()) or QGuiApplication.primaryScreen()
        screens = [screen.availableGeometry() for screen in QGuiApplication.screens()]
        place = fitting_place(window.geometry(), screens, here.availableGeometry())
        if place != window.geometry() and not (window.isMaximized() or window.isFullScreen()):
            window.setGeometry(place)
