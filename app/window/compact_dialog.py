"""The dialog that asks how small a compact volume shall be, or how near to the truth."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtWidgets import QDialog, QFormLayout, QLabel, QRadioButton, QWidget

from app.number_entry import first_refused
from app.tf_editor.number_box import NumberBox
from app.window.picture_dialog import finish_dialog

USUAL_SHARE = 1 / 16
"""Bytes a voxel to begin with."""

USUAL_ERROR = 0.004


@dataclass(frozen=True)
class CompactChoice:
    """Size of a compact volume in megabytes, or its largest image error; one of them is None."""

    megabytes: float | None
    error: float | None


class CompactDialog(QDialog):
    """Asks for a size or an error.

    Parameters
    ----------
    count : int
        Number of voxels.
    nbytes : int
        Their bytes, uncompressed.
    """

    def __init__(self, count: int, nbytes: int, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Save compact volume")
        self.by_size, self.by_error = QRadioButton("&Size in MB"), QRadioButton("Image &error")
        self.size_box, self.error_box = NumberBox(), NumberBox()
        self.size_box.set_limits(count * 0.003 / 1e6, nbytes / 1e6)
        self.size_box.explain("Size of the file in millions of bytes")
        self.size_box.show_value(float(f"{count * USUAL_SHARE / 1e6:.2g}"))
        self.error_box.set_limits(1e-4, 0.5)
        self.error_box.explain(
            "Root mean square of the error of colours in 0 to 1, in the mean over random views "
            "and TFs: the file becomes as small as this allows"
        )
        self.error_box.show_value(USUAL_ERROR)
        for button, box in ((self.by_size, self.size_box), (self.by_error, self.error_box)):
            box.setAccessibleName(button.text().replace("&", ""))
            button.toggled.connect(box.setEnabled)
        self.by_error.setChecked(True)
        self.size_box.setEnabled(False)
        hint = QLabel(
            f"The voxels have {nbytes / 1e6:.3g} MB. What is saved is measured: its error over 200 "
            "random views and TFs is written into it."
        )
        hint.setWordWrap(True)
        hint.setProperty("role", "dim")
        form = QFormLayout()
        form.addRow(self.by_error, self.error_box)
        form.addRow(self.by_size, self.size_box)
        form.addRow(hint)
        finish_dialog(self, form, "Save…")

    def choice(self) -> CompactChoice:
        """Return what is chosen."""
        if self.by_size.isChecked():
            return CompactChoice(self.size_box.value(), None)
        return CompactChoice(None, self.error_box.value())

    def accept(self) -> None:
        """Close, unless a typed number cannot be taken."""
        if first_refused(self) is None:
            super().accept()
