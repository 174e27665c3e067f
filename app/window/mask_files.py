"""Masks in the window: saved to files, and opened from label volumes."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QListWidget,
    QListWidgetItem,
    QVBoxLayout,
    QWidget,
)

from app.controls import Action, fill
from app.engines.background import LatestCall
from app.window.context import VOLUME_FILTER, Context, ask_for_file, ask_for_place, proposed_name
from model.errors import TfscopeError
from model.scene.volume import Volume
from model.volume_files.masks import SUFFIXES, mask_of, read_labels, resampled, write_mask

MASK_FILTER = "NRRD (*.nrrd);;NIfTI (*.nii *.nii.gz)"
KEY = "mask"  # of notices

Labels = tuple[Volume, list[float]]


class MaskFiles(QObject):
    """Opens label volumes as the open volume's mask, and saves that."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.window)
        self._context, self._state = context, context.state
        self._reading = LatestCall("mask", self, self._take, self._fail)
        self.stop, self.join = self._reading.stop, self._reading.join

    def ask_and_save(self) -> None:
        """Ask for a file and write the mask to it."""
        opened, mask = self._context.workspace.opened, self._state.mask_input.value
        if opened is None or mask is None:
            return
        name = proposed_name(self._context, "volume", ".mask.nrrd")
        path = ask_for_place(self._context, "Save mask", MASK_FILTER, (*SUFFIXES, ".gz"), name)
        if path is None:
            return
        try:
            write_mask(path, mask, opened.volume)
        except TfscopeError as error:
            self._fail(str(error))
        else:
            self._context.status.say(f"Saved {path.absolute()}.")

    def ask_and_open(self) -> None:
        """Ask for a file of labels, and show the voxels of some of them only."""
        path = ask_for_file(self._context, "Open mask or labels", VOLUME_FILTER)
        if path is not None:
            self.open(path)

    def open(self, path: Path) -> None:
        """Read labels in the background, and show the voxels of some of them only."""
        self._context.status.say(f"Reading {path.name} …")
        self._reading.ask(partial(read_labels, path))

    def _take(self, read: Labels) -> None:
        labels, values = read
        opened = self._context.workspace.opened
        if opened is None:
            return
        if labels.dimensions != opened.volume.dimensions:
            self._offer(labels, values, opened.volume)
        elif len(values) > 1:
            dialog = LabelsDialog(labels, values, self._context.window)
            dialog.accepted.connect(lambda: self._show(labels, dialog.chosen))
            dialog.open()
        else:
            self._show(labels, values)

    def _offer(self, labels: Volume, values: list[float], volume: Volume) -> None:
        """Say that labels are of another grid, and offer to resample them where that can be."""
        try:
            found = resampled(labels, volume)
        except TfscopeError as error:
            self._fail(str(error))
            return
        self._context.notices.add(
            f"{labels.name} has another grid than {volume.name}.",
            Action("Resample it", partial(self._take, (found, values))),
            key=KEY,
        )

    def _show(self, labels: Volume, values: list[float]) -> None:
        opened = self._context.workspace.opened
        try:
            mask = None if opened is None else mask_of(labels, opened.volume, values)
        except TfscopeError as error:
            self._fail(str(error))
            return
        self._context.notices.clear(KEY)
        self._state.mask_input.set(mask, f"open {labels.name}")
        self._context.status.say(f"{labels.name} is the mask. Undo shows what was shown before.")

    def _fail(self, text: str) -> None:
        self._context.fail(text, KEY)


class LabelsDialog(QDialog):
    """Asks which labels are shown; at first all are."""

    def __init__(self, labels: Volume, values: list[float], parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Labels of {labels.name} to show")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._values, self.list = values, QListWidget()
        names = {label.value: label.name for label in labels.file.labels}
        for value in values:
            item = QListWidgetItem(f"{value:g}  {names.get(int(value), '')}".rstrip(), self.list)
            item.setCheckState(Qt.CheckState.Checked)
        kinds = QDialogButtonBox.StandardButton
        buttons = QDialogButtonBox(kinds.Ok | kinds.Cancel)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        fill(QVBoxLayout(self), self.list, buttons, margins=(9, 9, 9, 9), spacing=6)

    @property
    def chosen(self) -> list[float]:
        """The labels that are checked."""
        items = zip(self._values, map(self.list.item, range(self.list.count())), strict=True)
        return [value for value, item in items if item.checkState() == Qt.CheckState.Checked]
