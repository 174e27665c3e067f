"""Opening of files from dialogs, drops, recent lists and buttons, and what is offered then."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QFileDialog, QWidget

from app.controls import Action
from app.short_numbers import significant
from app.state.library import ModelCheck
from app.state.preferences import Preferences
from app.state.session import SUFFIX
from app.state.settings import RecentKind
from app.state.viewer_state import ViewerState
from app.state.volume_opening import Wanted
from app.state.workspace import Workspace
from app.window.contents_dialog import ContentsDialog
from app.window.notices import Notices
from app.window.properties_dialog import PropertiesDialog
from app.window.raw_dialog import RawDialog
from model.errors import TransferFunctionError, VolumeError
from model.networks.card import MODEL_FILE
from model.scene.range_choice import RangeChoice
from model.scene.transfer_function import TransferFunction
from model.scene.value_scale import ValueScale, values_at
from model.volume_files import SUFFIXES
from model.volume_files.choice import Choice
from model.volume_files.raw import RawLayout

VOLUME_FILTER = f"Volumes ({' '.join(f'*{s}' for s in SUFFIXES)});;All files (*)"
OPEN_FILTER = VOLUME_FILTER.replace("Volumes (", f"Volumes and sessions (*{SUFFIX} ")

RAW_SUFFIX = ".raw"
TF_SUFFIX = ".json"

VOLUME_OFFER = "volume of the model"
"""Key of the notice that offers a model's volume."""


READING, SLOW_MS = "reading", 1000
"""Key of the notice that offers to cancel a reading, and after which time it appears."""


class FileOpening(QObject):
    """Opens volumes, models and TF files that the user points at.

    Parameters
    ----------
    window : QWidget
        Parent of the dialogs.
    """

    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""
    sessionFound = Signal(object)
    """Emitted with the path of a session that is to be opened."""
    transferFunctionOpened = Signal()
    """Emitted when a TF file's TF is there."""

    def __init__(
        self,
        window: QWidget,
        state: ViewerState,
        workspace: Workspace,
        preferences: Preferences,
        notice: Notices,
    ) -> None:
        super().__init__(window)
        self._window = window
        self._state = state
        self._workspace = workspace
        self._preferences = preferences
        self._notice = notice
        self._raw_layout: tuple[Path, RawLayout] | None = None
        self._choice: tuple[Path, Choice] | None = None
        self._asking: ContentsDialog | None = None
        self._model_awaited: Path | None = None
        workspace.volumeOpened.connect(self._remember_layout)
        workspace.volumeStarted.connect(self._ask_for_content)
        workspace.volumeStarted.connect(self._offer_awaited_volume)
        self._slow = QTimer(self, singleShot=True, interval=SLOW_MS)
        self._slow.timeout.connect(self._offer_cancel)
        self._reading = ""
        workspace.opening.reading.connect(self._note_reading)

    def open(self, path: Path) -> None:
        """Open a file or folder as what it is: a volume, a model, a TF or a session."""
        if path.is_dir() and (path / MODEL_FILE).exists():
            self.open_model(path)
        elif path.suffix.lower() == TF_SUFFIX and path.is_file():
            self.open_transfer_function(path)
        elif path.suffix.lower() == SUFFIX and path.is_file():
            self.sessionFound.emit(path)
        else:
            self.open_volume(path)

    def open_recent(self, kind: RecentKind, path: Path) -> None:
        """Open a recent file, or say that it is gone."""
        if not path.exists():
            self.problem.emit(f"{path}: it is no longer there; open it from its new place.")
        elif kind == "models":
            self.open_model_and_volume(path, self._workspace.library.volume_of(path))
        elif kind == "volumes":
            self.open_volume(path)
        elif kind == "sessions":
            self.sessionFound.emit(path)
        else:
            self.open_transfer_function(path)

    def start_with(
        self,
        path: Path,
        scalar_range: RangeChoice | None,
        choice: Choice | None,
        scale: ValueScale | None = None,
    ) -> None:
        """Open the volume that the window begins with; see :meth:`open_volume`."""
        known = self._known_choice(path) if choice is None else choice
        self._choice = None if known is None else (path, known)
        wanted = Wanted(None, known, choice is None, scalar_range, scale)
        self._workspace.opening.open(path, wanted)

    def open_volume(
        self, path: Path, choice: Choice | None = None, model: Path | None = None
    ) -> None:
        """Open a volume.

        The layout of a headerless file that does not say it is asked for first. Of a file or
        folder that holds several volumes the one that was chosen before is opened, or else the
        largest, and then which one is asked for.

        Parameters
        ----------
        choice : Choice or None
            What to read of it.
        model : Path or None
            Folder of the model to open with it.
        """
        self._model_awaited = model
        layout = None
        if path.suffix.lower() == RAW_SUFFIX and path.is_file():
            layout = self._known_layout(path)
            if layout is None:
                layout = self._ask_for_layout(path)
            if layout is None:
                return
            self._raw_layout = path, layout
        known = self._known_choice(path) if choice is None else choice
        self._choice = None if known is None else (path, known)
        self._workspace.opening.open(path, Wanted(layout, known, choice is None, model=model))

    def _note_reading(self, name: str) -> None:
        """Offer to cancel a reading that takes long, until it has ended."""
        self._reading = name
        if name:
            self._slow.start()
        else:
            self._slow.stop()
            self._notice.clear(READING)

    def _offer_cancel(self) -> None:
        cancel = Action("Cancel", self._workspace.opening.cancel)
        self._notice.tell(f"{self._reading} is being read.", cancel, key=READING)

    def ask_for_content(self) -> None:
        """List what the open volume's file holds, to choose from."""
        opened = self._workspace.opened
        if opened is None or not opened.volume.file.contents:
            return
        dialog = ContentsDialog(opened.path.name, opened.volume.file.contents, self._window)
        dialog.chosen.connect(partial(self.open_volume, opened.path))
        # What is kept is not asked for again.
        kept = partial(self._preferences.note_volume, opened.fingerprint)
        dialog.rejected.connect(partial(kept, choice=dialog.choice().text))
        dialog.finished.connect(dialog.deleteLater)
        self._asking = dialog
        dialog.open()

    def show_properties(self) -> None:
        """Show all that is known of the open volume and its file."""
        opened = self._workspace.opened
        if opened is None:
            return
        dialog = PropertiesDialog(opened.path, opened.volume, self._window)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def open_model(self, folder: Path) -> None:
        """Open a model, unless something is wrong with it; offer its volume if that is not open."""
        check = self._workspace.library.check_model(folder)
        if not check.is_fine:
            self.problem.emit(check.problem)
            return
        self._workspace.open_model(folder)
        self._offer_volume(check)

    def open_transfer_function(self, path: Path) -> None:
        """Open a TF file, as an edit that can be undone."""
        try:
            loaded = TransferFunction.load(path)
        except TransferFunctionError as error:
            self.problem.emit(str(error))
            return
        fitted = self._workspace.fitted(loaded)
        self._state.tf_input.set(fitted, f"open {path.name}")
        self.transferFunctionOpened.emit()
        self._preferences.note_recent("transfer_functions", path)
        same = fitted.scalar_range == loaded.scalar_range
        lo, hi = values_at(fitted.scalar_range, fitted.scale)
        change = (
            "" if same else f"; fitted to values from {significant(lo, 5)} to {significant(hi, 5)}"
        )
        self.news.emit(f"Opened {path.name}{change}.")

    def open_model_and_volume(self, folder: Path, volume: Path | None) -> None:
        """Open a model with its volume, unless that is open or None: not there any more."""
        check = self._workspace.library.check_model(folder)
        if not check.is_fine or volume is None or self._is_open(check):
            self.open_model(folder)
            return
        self.open_volume(volume, model=folder)

    def _offer_awaited_volume(self) -> None:
        """Say so where the file that was opened with a model no longer is that model's volume."""
        folder, self._model_awaited = self._model_awaited, None
        if folder is not None and folder == self._workspace.model.folder:
            self._offer_volume(self._workspace.library.check_model(folder))

    def _offer_volume(self, check: ModelCheck) -> None:
        self._notice.clear(VOLUME_OFFER)
        if check.scene is None or self._is_open(check):
            return
        name = check.scene.volume_name
        locate = Action("Locate it…", partial(self._locate, name))
        volume = self._workspace.library.volume_of(check.folder)
        if volume is None:
            self._notice.tell(
                f"{check.folder.name} is a model of '{name}', which is not open. "
                "It draws as soon as that volume is open.",
                locate,
                key=VOLUME_OFFER,
            )
        else:
            self._notice.tell(
                f"{check.folder.name} is a model of '{name}', which is not open.",
                Action(f"Open {volume.name}", partial(self.open_volume, volume)),
                locate,
                key=VOLUME_OFFER,
            )

    def _is_open(self, check: ModelCheck) -> bool:
        """Whether a model's volume is the open one."""
        opened, scene = self._workspace.opened, check.scene
        if opened is None or scene is None:
            return False
        return opened.fingerprint == scene.volume_fingerprint

    def _locate(self, name: str) -> None:
        folder = self._preferences.settings.last_folder
        title = f"Locate the volume '{name}'"
        found, _ = QFileDialog.getOpenFileName(self._window, title, folder, VOLUME_FILTER)
        if found:
            self.open_volume(Path(found))

    def _known_layout(self, path: Path) -> RawLayout | None:
        """Layout that a raw file's name says, or that was entered for it before, if it fits."""
        for text in (self._preferences.volume_at(path).raw_layout, path.stem):
            layout = RawLayout.parse(text) if text else None
            if layout is not None and _fits(path, layout):
                return layout
        return None

    def _known_choice(self, path: Path) -> Choice | None:
        """What was chosen last of a file's volumes; None if nothing was."""
        text = self._preferences.volume_at(path).choice
        return Choice.parse(text) if text else None

    def _ask_for_content(self) -> None:
        """Ask which of a file's volumes to show, unless that was chosen."""
        opened = self._workspace.opened
        if opened is not None and (self._choice is None or self._choice[0] != opened.path):
            self.ask_for_content()

    def _ask_for_layout(self, path: Path) -> RawLayout | None:
        try:
            dialog = RawDialog(path, self._window)
        except VolumeError as error:
            self.problem.emit(str(error))
            return None
        try:
            return dialog.choice() if dialog.exec() else None
        finally:
            dialog.deleteLater()

    def _remember_layout(self) -> None:
        opened = self._workspace.opened
        if opened is not None and self._raw_layout is not None:
            path, layout = self._raw_layout
            if path == opened.path:
                self._preferences.note_volume(opened.fingerprint, raw_layout=layout.text)
        if opened is not None and self._choice is not None:
            path, choice = self._choice
            if path == opened.path:
                self._preferences.note_volume(opened.fingerprint, choice=choice.text)


def _fits(path: Path, layout: RawLayout) -> bool:
    return layout.nbytes == path.stat().st_size
