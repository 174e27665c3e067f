"""The window: two images in step, the editor below, and what they work on."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QMainWindow, QSplitter, QVBoxLayout, QWidget

from app.background import BackgroundCall
from app.dispatcher import NO_MODEL_SIZE, Dispatcher
from app.engine_pane import EnginePane
from app.engines import REAL_BACKENDS, Backends, ReferenceSettings
from app.gestures import ViewGestures
from app.menus import Menus
from app.messages import EngineReady
from app.notice_bar import NoticeBar
from app.opened_volume import OpenedVolume, open_volume
from app.session import Session
from app.tf_editor.editor import TransferFunctionEditor
from app.training_range import outside_training_range
from app.transfer_function_store import TransferFunctionStore
from model.errors import TransferFunctionError
from model.scene import Scene

WINDOW_SIZE = 1280, 860


class MainWindow(QMainWindow):
    """Shows a generator's image beside VTK's while the user edits view and TF.

    Parameters
    ----------
    backends : Backends
        What reads volumes and builds engines.
    store : TransferFunctionStore or None
        Where the TF of every volume is kept between runs; None keeps nothing.
    device : str
        For generators: auto, cpu or cuda.
    """

    settled = Signal()
    """Both images are final, or say why they are not there."""

    def __init__(
        self,
        backends: Backends = REAL_BACKENDS,
        store: TransferFunctionStore | None = None,
        device: str = "auto",
    ) -> None:
        super().__init__()
        self.session = Session(self)
        self.generator = EnginePane("Generator", "generator")
        self.reference = EnginePane("VTK (reference)", "reference")
        self.editor = TransferFunctionEditor(self.session)
        self.notice = NoticeBar()
        self._backends = backends
        self._store = store
        self._device = device
        self._opened: OpenedVolume | None = None
        self._scene: Scene | None = None
        self._reference_settings = ReferenceSettings()
        self._reading: BackgroundCall | None = None
        self._calls: list[BackgroundCall] = []
        self._dispatcher = Dispatcher(self.session, (self.generator, self.reference), self)
        self._view_label = QLabel()
        self._lay_out()
        self._connect()
        Menus(self)
        self._view_changed()

    @property
    def opened(self) -> OpenedVolume | None:
        """The volume that is shown."""
        return self._opened

    @property
    def is_settled(self) -> bool:
        """Whether both images are final, or say why they are not there."""
        return self._reading is None and self.generator.is_settled and self.reference.is_settled

    @property
    def errors(self) -> list[str]:
        """The errors that the two images show."""
        return [pane.error for pane in (self.generator, self.reference) if pane.error]

    def open_volume(self, path: Path) -> None:
        """Read a volume in the background, then show it; the old one stays until then."""
        if self._reading is not None:
            self._reading.abandon()
        if self._opened is None:
            self.reference.show_busy(f"Reading {path.name} …")
        self.statusBar().showMessage(f"Reading {path.name} …")
        call = BackgroundCall(
            partial(open_volume, path, self._backends.read_volume), "volume", self
        )
        call.done.connect(self._volume_opened)
        call.failed.connect(self._volume_failed)
        call.finished.connect(partial(self._forget, call))
        self._reading = call
        self._calls.append(call)
        call.start()

    def open_model(self, folder: Path | None) -> None:
        """Load a generator in the background; None says that there is no model."""
        self._scene = None
        self._choose_reference()
        if folder is None:
            self.generator.show_note(self._no_model_text())
        else:
            self.generator.start(
                partial(self._backends.generator, folder, self._device), "Loading the model …"
            )

    def tell(self, text: str) -> None:
        """Show a sentence that must not be overlooked."""
        self.notice.tell(text)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Disappear at once, then wait for the threads to end."""
        panes = (self.generator, self.reference)
        for pane in panes:
            pane.stop()
        for call in self._calls:
            call.abandon()
        self.hide()
        for pane in panes:
            pane.join()
        for call in self._calls:
            call.join()
        event.accept()

    def _lay_out(self) -> None:
        images = QWidget()
        row = QHBoxLayout(images)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(12)
        for pane in (self.generator, self.reference):
            row.addWidget(pane, 1)
            ViewGestures(pane.canvas, self.session)
        splitter = QSplitter(Qt.Orientation.Vertical)
        splitter.setHandleWidth(12)
        splitter.setChildrenCollapsible(False)
        splitter.addWidget(images)
        splitter.addWidget(self.editor)
        splitter.setStretchFactor(0, 3)
        splitter.setStretchFactor(1, 2)
        splitter.setSizes([480, 290])
        central = QWidget()
        column = QVBoxLayout(central)
        column.setContentsMargins(14, 8, 14, 4)
        column.setSpacing(8)
        column.addWidget(self.notice)
        column.addWidget(splitter, 1)
        self.setCentralWidget(central)
        self._view_label.setProperty("role", "dim")
        self.statusBar().addPermanentWidget(self._view_label)
        self.statusBar().setSizeGripEnabled(False)
        self.setWindowTitle("tfscope")
        self.resize(*WINDOW_SIZE)

    def _connect(self) -> None:
        self.session.viewChanged.connect(self._view_changed)
        self.session.transferFunctionChanged.connect(self._update_hint)
        self.session.transferFunctionChangeFinished.connect(self._keep)
        self.generator.engineReady.connect(self._generator_ready)
        self.reference.engineReady.connect(self._dispatcher.send)
        for pane in (self.generator, self.reference):
            pane.settled.connect(self._report_settled)

    def _volume_opened(self, opened: OpenedVolume) -> None:
        self._reading = None
        self._opened = opened
        self._dispatcher.hold()
        self.session.start_volume(opened.default, self._kept(opened))
        self._dispatcher.release()
        volume = opened.volume
        self.editor.set_data(opened.counts, opened.edges, volume.scalar_range, volume.units)
        shape = " × ".join(str(n) for n in volume.dimensions)
        self.setWindowTitle(f"{volume.name} ({shape}) – tfscope")
        self.statusBar().showMessage(" ".join(volume.notes))
        self._start_reference(self._wanted_settings())
        if self._scene is not None:
            self._match_generator(self._scene)

    def _volume_failed(self, text: str) -> None:
        self._reading = None
        self.statusBar().clearMessage()
        if self._opened is None:
            self.reference.show_error(text)
            self.generator.show_note("Waiting for a volume: open one with File > Open volume.")
        else:
            self.tell(text)
            self._report_settled()
