"""One of the two images: its caption, its canvas and the worker behind it."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app import theme
from app.engines.messages import EngineReady, RenderRequest, RenderResult
from app.engines.worker import Engine, RenderWorker
from app.image_view.image_canvas import ImageCanvas, to_qimage


class EnginePane(QWidget):
    """Shows what one engine renders, and how long it took.

    Parameters
    ----------
    title : str
    thread_name : str
        Of the worker's thread.
    """

    engineReady = Signal(object)
    settled = Signal()
    """The newest final image is shown, or there is an error or a note instead."""

    def __init__(self, title: str, thread_name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.canvas = ImageCanvas(self)
        self._title = QLabel(title)
        self._title.setProperty("role", "title")
        self._detail = QLabel()
        self._detail.setProperty("role", "dim")
        # Wide enough for any numbers: changing digits must not move the layout.
        self._detail.setMinimumWidth(240)
        self._detail.setAlignment(Qt.AlignmentFlag.AlignRight)
        header = QHBoxLayout()
        header.setContentsMargins(2, 0, 2, 0)
        header.addWidget(self._title)
        header.addStretch()
        header.addWidget(self._detail)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(header)
        layout.addWidget(self.canvas, 1)

        self._thread_name = thread_name
        self._worker: RenderWorker | None = None
        self._retired: list[RenderWorker] = []
        self._description = ""
        self._wanted = -1
        self._error: str | None = None
        self._is_settled = False
        self._paused = False

    def set_title(self, title: str) -> None:
        """Name the engine differently."""
        self._title.setText(title)

    @property
    def title(self) -> str:
        """The engine's name, as shown."""
        return self._title.text()

    @property
    def is_settled(self) -> bool:
        """Whether nothing more is to be expected for the newest request."""
        return self._is_settled

    @property
    def error(self) -> str | None:
        """The error that is shown, one sentence."""
        return self._error

    @property
    def detail(self) -> str:
        """Size, latency and place of the last image, as shown."""
        return self._detail.text()

    def start(self, factory: Callable[[], Engine], busy_text: str) -> None:
        """Replace the engine by one that `factory` builds in a new worker thread."""
        self.stop()
        self._expect_news(busy_text)
        self._paused = False
        worker = RenderWorker(factory, self._thread_name, self)
        worker.engineReady.connect(self._engine_ready)
        worker.engineFailed.connect(self._engine_failed)
        worker.resultReady.connect(self._show_result)
        worker.finished.connect(self._clear_retired)
        self._worker = worker
        worker.start()

    def submit(self, request: RenderRequest) -> None:
        """Ask the engine for an image; paused or without an engine, nothing happens."""
        if self._worker is not None and not self._paused:
            self._wanted = request.sequence
            self._is_settled = False
            self._worker.submit(request)

    def show_busy(self, text: str) -> None:
        """Say what is being waited for."""
        self.stop()
        self._expect_news(text)

    def pause(self, text: str, settled: bool = True) -> None:
        """Say why there is no image, when that is no error; requests are ignored.

        Parameters
        ----------
        text : str
        settled : bool
            False when an image is still to come.
        """
        self._expect_news(text)
        self._paused = True
        if settled:
            self._settle()

    def resume(self) -> None:
        """Take requests again after :meth:`pause`."""
        self._paused = False

    def show_error(self, text: str) -> None:
        """Write an error over the image."""
        self._error = text
        self.canvas.show_message(text, theme.ERROR)
        self._settle()

    def stop(self) -> None:
        """Let the engine go; returns at once, whatever it is doing."""
        if self._worker is not None:
            self._worker.stop()
            self._retired.append(self._worker)
            self._worker = None

    def join(self) -> None:
        """Wait until the threads of all stopped engines have ended."""
        for worker in self._retired:
            worker.join()
            worker.deleteLater()
        self._retired.clear()

    def _engine_ready(self, ready: EngineReady) -> None:
        self._description = ready.description
        self.engineReady.emit(ready)

    def _engine_failed(self, error: str) -> None:
        # Without the worker later requests end at once, and the error stays.
        self.stop()
        self.show_error(error)

    def _show_result(self, result: RenderResult) -> None:
        if self._paused:
            return
        if result.image is None:
            self.show_error(result.error or "The engine returned no image.")
            return
        self._error = None
        image = to_qimage(result.image)
        self.canvas.show_image(image)
        facts = [
            self._description,
            f"{image.width()} × {image.height()}",
            f"{1000 * result.seconds:.0f} ms",
        ]
        self._detail.setText("   ".join(fact for fact in facts if fact))
        if not result.live and result.sequence == self._wanted:
            self._settle()

    def _expect_news(self, text: str) -> None:
        self._error = None
        self._is_settled = False
        self._detail.clear()
        self.canvas.set_hint("")
        self.canvas.show_image(None)
        self.canvas.show_message(text)

    def _settle(self) -> None:
        self._is_settled = True
        self.settled.emit()

    def _clear_retired(self) -> None:
        """Delete stopped workers once their threads have ended."""
        worker = self.sender()
        if isinstance(worker, RenderWorker) and worker in self._retired:
            self._retired.remove(worker)
            worker.join()
            worker.deleteLater()
