"""Layout of the window, kept for the next start."""

from PySide6.QtCore import QByteArray, QEvent, QObject, QSize
from PySide6.QtGui import QGuiApplication, QScreen
from PySide6.QtWidgets import QMainWindow

from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from app.tf_editor.editor import DockSplitter
from app.tf_editor.handles import HandleMoves
from app.window.pane_layout import PaneLayout

SHARE = 0.8  # share of the screen's free area, along both sides

LARGEST, LEAST = QSize(1440, 900), QSize(1000, 640)
"""Largest size at which it opens, and least size at which all of it can be used."""

FRAME = 32  # height of the system's title bar, about, which is not the window's


def size_on(screen: QScreen) -> QSize:
    """Return the size at which the window opens on a screen."""
    if QGuiApplication.platformName() == "offscreen":
        # Without a display, Qt has a smaller screen than anybody.
        return LARGEST
    return first_size(screen.availableSize())


def first_size(free: QSize) -> QSize:
    """Return the size at which the window opens on a screen with this free area."""
    part = QSize(round(SHARE * free.width()), round(SHARE * free.height()))
    inside = QSize(free.width(), free.height() - FRAME)
    return part.boundedTo(LARGEST).expandedTo(LEAST).boundedTo(inside)


class WindowMemory(QObject):
    """Restores and remembers the window's size, panes and switches."""

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
        self._window, self._splitter, self.panes = window, splitter, panes
        self._moves, self._preferences = moves, preferences
        values = preferences.settings
        if values.window_geometry:
            # Qt moves a window to an existing screen.
            window.restoreGeometry(QByteArray.fromBase64(values.window_geometry.encode()))
        splitter.set_share(values.editor_share)
        moves.colors_follow = values.colors_follow_modes
        state.set_trackball(values.trackball)
        self.restore_panes()
        state.navigationChanged.connect(lambda: preferences.set(trackball=state.trackball))
        splitter.shareChanged.connect(self.note)
        window.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Remember the window's position as soon as it is moved: the process may be killed."""
        if event.type() in (QEvent.Type.Resize, QEvent.Type.Move) and self._window.isVisible():
            self.note()
        return False

    def note(self) -> None:
        """Remember the size of the window and of its parts."""
        self._preferences.set(
            window_geometry=bytes(self._window.saveGeometry().toBase64().data()).decode(),
            editor_share=self._splitter.share,
            colors_follow_modes=self._moves.colors_follow,
            swapped=self.panes.is_swapped,
        )

    def restore_panes(self) -> None:
        """Show the remembered images at their sides."""
        values = self._preferences.settings
        if values.swapped != self.panes.is_swapped:
            self.panes.swap()
        self.panes.shown = values.shown
