"""The path through named places as it is played: its frames, and taking one of them."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from app.latent_browser.map_view import MapView
from app.latent_browser.preview import Preview
from app.latent_browser.tf_taking import TFTaking
from app.state.latent_path import Frame, LatentPath
from model.errors import LatentError


class PathControl(QObject):
    """Plays a path, shows its frames, and makes one the present TF.

    Parameters
    ----------
    path : LatentPath
    map_view : MapView
        Marks where the path has got to.
    preview : Preview
    taking : TFTaking
    parent : QObject
    """

    changed = Signal()
    """Emitted when a path has started, got on or ended."""
    told = Signal(str)
    """Emitted with how far it has got; empty when it ends."""
    problem = Signal(str)
    news = Signal(str)

    def __init__(
        self,
        path: LatentPath,
        map_view: MapView,
        preview: Preview,
        taking: TFTaking,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._path, self._map, self._preview, self._taking = path, map_view, preview, taking
        self._frame: Frame | None = None
        path.frameDrawn.connect(self._show_frame)
        path.ended.connect(self._end)

    @property
    def is_playing(self) -> bool:
        """Whether a frame is shown that can be taken."""
        return self._path.is_running and not self._path.is_movie and self._frame is not None

    def play(self) -> None:
        """Play the path through all named places."""
        try:
            self._path.play()
        except LatentError as error:
            self.problem.emit(str(error))
        self.changed.emit()

    def take_frame(self) -> None:
        """Make the frame's TF the present one, and stop."""
        frame = self._frame
        self._path.cancel()
        if frame is not None:
            self._taking.take(frame.tf, "TF of the path", frame.place)

    def _show_frame(self, frame: Frame | None) -> None:
        self._frame = frame
        self.changed.emit()
        if frame is None:
            self._preview.show_tf(None)
            self._preview.show_picture(None)
            self._map.mark_path(None)
            self.told.emit("Writing the movie …" if self._path.is_movie else "")
            return
        self._map.mark_path(frame.place)
        self._preview.show_tf(frame.tf)
        text = f"Path: picture {frame.number + 1} of {frame.count}"
        self._preview.show_picture(frame.image, text, self._path.engine)
        self.told.emit(text)

    def _end(self, text: str) -> None:
        if text.startswith("Saved "):
            self.news.emit(text)
        elif text:
            self.problem.emit(text)
        self.changed.emit()
        self.told.emit("")
