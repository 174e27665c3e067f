"""Opening and saving of volumes, models, TFs and sensitivities."""

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject

from app.controls import Action
from app.engines.background import LatestCall, Pause
from app.figures.sensitivity_figure import save_figure
from app.number_box import significant
from app.state.session import FIGURE_SUFFIX, SUFFIX
from app.state.settings import RecentKind
from app.state.volume_opening import Wanted
from app.window.context import OPEN_FILTER, VOLUME_FILTER, Context, ask_for_file, ask_for_place
from app.window.raw_dialog import RawDialog
from app.window.sessions import Sessions
from app.window.volume_dialogs import ContentsDialog, LabelsDialog, PropertiesDialog
from model.errors import TfscopeError, TransferFunctionError, VolumeError
from model.networks.card import MODEL_FILE
from model.rendering.pieces import mask_of
from model.rendering.scale_bar import volume_text
from model.scene.mask import Mask
from model.scene.scene import Scene
from model.scene.transfer_function import TransferFunction
from model.scene.value_scale import values_at
from model.sensitivity.result import NUMBER_SUFFIXES, SensitivityResult, save_numbers
from model.volume_files.choice import Choice
from model.volume_files.masks import SUFFIXES as MASK_SUFFIXES
from model.volume_files.masks import LabelMap, read_labels, write_mask
from model.volume_files.raw import RawLayout

TF_FILTER = "Transfer functions (*.json);;All files (*)"
SENSITIVITY_FILTER = "Figures (*.png);;Arrays (*.npz);;Tables (*.csv)"
MASK_FILTER = "NRRD (*.nrrd);;NIfTI (*.nii.gz *.nii)"
RAW_SUFFIX, TF_SUFFIX = ".raw", ".json"

KEY, VOLUME_OFFER, READING = "files", "volume of the model", "reading"
"""Keys of notices: errors, the offer of a model's volume, a volume being read."""

SLOW_MS = 1000  # time after which the window offers to cancel reading


class Files(QObject):
    """Opens what the user chooses, asks for what its file leaves open, and saves TFs."""

    def __init__(
        self, context: Context, sessions: Sessions, show_small_range: Callable[[], object]
    ) -> None:
        super().__init__(context.window)
        self._context, self._window = context, context.window
        self._workspace, self._preferences = context.workspace, context.preferences
        self._notices, self._status = context.notices, context.status
        self._sessions, self._show_small_range = sessions, show_small_range
        self._model_awaited: Path | None = None
        self._replaced: Path | None = None  # volume to be replaced by a model's own
        self._slow = Pause(self, SLOW_MS, self._offer_cancel)
        self._reading = ""
        # Each call returns an action for the window's thread.
        self._masks = LatestCall("masks", self, lambda go_on: go_on(), self._fail, at_once=True)
        # Reading of masks ends with their volume; writing does not.
        self._writes = LatestCall("mask", self, lambda go_on: go_on(), self._fail, at_once=True)

    def open(self, path: Path) -> None:
        """Open a file or folder by its kind: volume, model, TF, session or figure."""
        if path.is_dir() and (path / MODEL_FILE).exists():
            self.open_model(path)
        elif path.suffix.lower() == TF_SUFFIX and path.is_file():
            self.open_transfer_function(path)
        elif path.suffix.lower() in (SUFFIX, FIGURE_SUFFIX) and path.is_file():
            self._sessions.open(path)
        else:
            self.open_volume(path)

    def open_recent(self, kind: RecentKind, path: Path) -> None:
        """Open a recent file, or report that it is gone."""
        if not path.exists():
            self._fail(f"{path} does not exist any more. Open it from its new place.")
        elif kind == "models":
            self.open_model(path, self._workspace.library.volume_of(path))
        elif kind == "transfer_functions":
            self.open_transfer_function(path)
        else:
            self.open(path)

    def ask(self, title: str, filters: str, open_it: Callable[[Path], object]) -> None:
        """Ask for a file, or without filters for a folder, and open it."""
        path = ask_for_file(self._context, title, filters)
        if path is not None:
            open_it(path)

    def ask_and_open(self) -> None:
        """Ask for a file with a volume or a session and open it."""
        self.ask("Open volume or session", OPEN_FILTER, self.open)

    def open_volume(
        self, path: Path, choice: Choice | None = None, model: Path | None = None
    ) -> None:
        """Open a volume, and a model with it.

        First ask for a headerless file's layout if its name does not give it. Of several volumes in
        a file, open the one chosen before, or the largest; then ask which one to show.
        """
        self._model_awaited = model
        layout = None
        if path.suffix.lower() == RAW_SUFFIX and path.is_file():
            layout = self._known_layout(path) or self._ask_for_layout(path)
            if layout is None:
                return
        self.read(path, choice, Wanted(layout, model=model))

    def open_model(self, folder: Path, volume: Path | None = None) -> None:
        """Open a valid model, with its volume if that exists.

        If no volume is given and another one is open, offer the model's volume.
        """
        opened = self._workspace.opened
        try:
            scene = self._workspace.library.check_model(folder)
        except TfscopeError as error:
            self._fail(str(error))
            return
        if volume is None or self._is_open(scene):
            reference = self._workspace.reference
            if self._is_open(scene) and reference.wanted.lighting == "path" != scene.lighting:
                # The model does not draw this light: it is opened to be seen.
                reference.choose(lighting="auto")
            self._workspace.open_model(folder)
            # B would take the place of the model's image.
            self._context.state.tf_input.compare(False)
            self._offer_volume(folder, scene)
        else:
            self._replaced = None if opened is None else opened.path
            self.open_volume(volume, model=folder)

    def open_transfer_function(self, path: Path) -> None:
        """Open a TF file, as an edit that can be undone."""
        try:
            loaded = TransferFunction.load(path)
        except TransferFunctionError as error:
            self._fail(str(error))
            return
        fitted = self._workspace.fitted(loaded)
        self._context.state.tf_input.exchange(fitted, f"open {path.name}")
        self._show_small_range()
        self._preferences.note_recent("transfer_functions", path)
        text = f"Opened {path.name}."
        if fitted.scalar_range != loaded.scalar_range:
            lo, hi = values_at(fitted.scalar_range, fitted.scale)
            text = f"Opened {path.name}, fitted to {significant(lo, 5)} to {significant(hi, 5)}."
        self._status.say(text)

    def save_transfer_function(self) -> None:
        """Ask for a file and write the TF to it."""
        path = ask_for_place(self._context, "Save TF", TF_FILTER, (TF_SUFFIX,), "tf")
        save = self._context.state.transfer_function.save
        if path is not None and self._context.saved(KEY, save, path):
            self._preferences.note_recent("transfer_functions", path)

    def save_sensitivity(self, result: SensitivityResult | None) -> None:
        """Ask for a file and write a sensitivity to it: a figure, or all numbers."""
        if result is None:
            self._fail("This image has no sensitivity to save yet. Wait until one is shown.")
            return
        suffixes = (".png", *NUMBER_SUFFIXES)
        path = ask_for_place(self._context, "Save sensitivity", SENSITIVITY_FILTER, suffixes)
        if path is None:
            return
        is_figure = path.suffix.lower() == ".png"
        self._context.saved(KEY, save_figure if is_figure else save_numbers, path, result)

    def open_mask(self, path: Path) -> None:
        """Read labels in the background, and ask which ones to show if there are several."""
        opened, present = self._workspace.opened, self._context.state.mask_input.value
        if opened is None:
            return
        self._status.say(f"Reading {path.name} …")

        def read() -> Callable[[], object]:
            labels = read_labels(path, opened.volume)
            if len(labels.values) > 1 or labels.note:
                return partial(self._ask_for_labels, labels, labels.shown_by(present))
            return partial(self._show_labels, labels, labels.values)

        self._masks.ask(read)

    def _ask_for_labels(self, labels: LabelMap, shown: Collection[float]) -> None:
        self._status.say("")
        LabelsDialog(labels, shown, partial(self._show_labels, labels), self._window).open()

    def _show_labels(self, labels: LabelMap, chosen: Collection[float]) -> None:
        opened, tf = self._workspace.opened, self._context.state.transfer_function

        def make() -> Callable[[], object]:
            mask = None if opened is None else mask_of(labels, chosen, opened.volume, tf.opacity)
            return partial(self._take_mask, labels, len(chosen), mask)

        self._masks.ask(make)

    def _take_mask(self, labels: LabelMap, count: int, mask: Mask | None) -> None:
        self._context.state.mask_input.set(mask, f"open {labels.name}")
        of_all = f"{count} of {len(labels.values)} labels of " if len(labels.values) > 1 else ""
        only = f"Only voxels in {of_all}{labels.name} are shown."
        self._status.say(only if mask else f"{labels.name} shows all voxels, so it hides nothing.")

    def save_mask(self) -> None:
        """Ask for a file and write the mask to it, without its edge: its voxels are measured."""
        opened, shown = self._workspace.opened, self._context.state.mask_input.value
        name = "volume", f".mask{MASK_SUFFIXES[0]}"
        path = ask_for_place(self._context, "Save mask", MASK_FILTER, MASK_SUFFIXES, *name)
        if path is not None and opened is not None and shown is not None:

            def write() -> Callable[[], object]:
                mask = shown.exact
                write_mask(path, mask, opened.volume)
                size = volume_text(int(np.count_nonzero(mask.shown)), opened.volume)
                return partial(self._status.say, f"Saved {path.absolute()}: {size}.")

            # An earlier one may use the same file.
            self._writes.join()
            self._writes.ask(write)

    def join(self) -> None:
        """Wait until masks are read and written."""
        for call in (self._masks, self._writes):
            call.stop()
            call.join()

    def ask_for_content(self) -> None:
        """List the volumes in the open volume's file, to choose from."""
        opened = self._workspace.opened
        if opened is None or not opened.volume.file.contents:
            return
        path, contents = opened.path, opened.volume.file.contents
        dialog = ContentsDialog(path.name, contents, partial(self.open_volume, path), self._window)
        # A remembered choice is not asked for again.
        kept = partial(self._preferences.note_volume, opened.fingerprint)
        dialog.rejected.connect(partial(kept, choice=dialog.choice().text))
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def show_properties(self) -> None:
        """Show the properties of the open volume and its file."""
        opened = self._workspace.opened
        if opened is not None:
            PropertiesDialog(opened.path, opened.volume, self._respace, self._window).open()

    def _respace(self, **typed: str) -> None:
        """Read the open volume again with a typed spacing or stretch; its TF and view stay."""
        opened, state = self._workspace.opened, self._context.state
        if opened is not None:
            shown = self._workspace.opening.shown
            choice = replace(shown.choice or Choice(), **typed)
            memory = self._preferences.volume(opened.fingerprint)
            memory = replace(memory, tf=state.transfer_function, view=state.view)
            self._workspace.opening.open(opened.path, Wanted(shown.raw, choice, memory=memory))

    def _fail(self, text: str) -> None:
        self._status.say("")  # nothing is read any more
        self._context.fail(text, KEY)

    def read(self, path: Path, choice: Choice | None, wanted: Wanted) -> None:
        """Open a volume, or of several in a file the one that is chosen or was before."""
        last = self._preferences.volume_at(path).choice
        known = Choice.parse(last) if choice is None and last else choice
        wanted = replace(wanted, choice=known, is_remembered=choice is None)
        self._workspace.opening.open(path, wanted)

    def note_reading(self, name: str) -> None:
        """Offer to cancel reading that takes long."""
        self._reading = name
        if name:
            self._slow.start()
        else:
            self._slow.stop()
            self._notices.clear(READING)

    def _offer_cancel(self) -> None:
        cancel = Action("Cancel", self._workspace.opening.cancel)
        self._notices.add(f"Reading {self._reading} …", cancel, key=READING)

    def start_volume(self) -> None:
        """Ask which of a file's volumes to show, and report a model of another volume."""
        # Labels being read were meant for the previous volume.
        self._masks.forget()
        for dialog in self._window.findChildren(LabelsDialog):
            dialog.reject()
        opened = self._workspace.opened
        if self._workspace.opening.shown.choice is None:
            self.ask_for_content()
        folder, self._model_awaited = self._model_awaited, None
        before, self._replaced = self._replaced, None
        if folder is not None and folder == self._workspace.model.folder:
            # The file opened with it may have changed.
            self._offer_volume(folder, self._workspace.library.scene_of(folder))
            if before is not None and opened is not None:
                text = f"{opened.volume.name} was opened because the model was trained on it."
                back = Action("Go back", partial(self.open_volume, before))
                self._notices.add(text, back, key=VOLUME_OFFER)

    def _offer_volume(self, folder: Path, scene: Scene | None) -> None:
        self._notices.clear(VOLUME_OFFER)
        if scene is None or self._is_open(scene):
            return
        name = scene.volume_name
        locate = f"Locate the volume '{name}'", VOLUME_FILTER
        text = f"{folder.name} is a model of '{name}', which is not open."
        actions = [Action("Locate it…", partial(self.ask, *locate, self.open_volume))]
        volume = self._workspace.library.volume_of(folder)
        if volume is None:
            text += " Open that volume to see the model's images."
        else:
            actions.insert(0, Action("Open both", partial(self.open_model, folder, volume)))
        self._notices.add(text, *actions, key=VOLUME_OFFER)

    def _is_open(self, scene: Scene) -> bool:
        opened = self._workspace.opened
        return opened is not None and opened.fingerprint == scene.volume_fingerprint

    def _known_layout(self, path: Path) -> RawLayout | None:
        """Layout of a raw file from its name, or as entered before, if it fits."""
        for text in (self._preferences.volume_at(path).raw_layout, path.stem):
            layout = RawLayout.parse(text) if text else None
            if layout is not None and layout.nbytes == path.stat().st_size:
                return layout
        return None

    def _ask_for_layout(self, path: Path) -> RawLayout | None:
        try:
            dialog = RawDialog(path, self._window)
        except VolumeError as error:
            self._fail(str(error))
            return None
        try:
            return dialog.choice() if dialog.exec() else None
        finally:
            dialog.deleteLater()
