"""The dialog that asks what a figure shows, and how it looks."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from app.controls import list_box
from app.window.figure import FigureLook, Which
from app.window.size_chooser import BackgroundBox, Size, SizeChooser
from model.rendering.scale_bar import DEPTH_TEXT
from model.volume_files.checks import readable_size

LONGER_SIDES = (1024, 2048, 4096, 8192)
"""Presets of the longer side; the picture keeps the proportions of what is shown."""

SAMPLES = (1, 4, 16, 64, 256, 1024)
"""Samples of each pixel that path-traced pictures may have."""

PICTURE_SAMPLES = 64
"""Those that the dialog begins with."""

BYTES_PER_PIXEL = 20
"""Memory of a rendering and of the picture that is made of it."""

WHICH: dict[Which, str] = {
    "reference": "Ground truth",
    "generator": "Generator",
    "both": "Both, side by side",
    "difference": "Difference of both",
}
"""What a figure may show, and how that is called."""


@dataclass(frozen=True)
class PictureChoice(FigureLook):
    """How a figure is saved or copied.

    Attributes
    ----------
    which : {"generator", "reference", "both", "difference"}
        What it shows.
    samples : int
        Of each pixel of a path-traced ground truth; 0 in other light.
    """

    which: Which = "reference"
    samples: int = 0


class PictureDialog(QDialog):
    """Asks what a figure shows, and for its size, background, legend and scale bar.

    Parameters
    ----------
    sizes : dict of tuple of int
        What it may show, each with its width and height on the screen, in pixels.
    begin : PictureChoice or None
        Choice to begin with; None for the first of the sizes, on black. Of its size, the longer
        side counts where it is one of the presets. Samples are asked for where it has some.
    button : str
        Label of the button that accepts, such as "Save…" or "Copy".
    """

    def __init__(
        self,
        sizes: dict[Which, Size],
        begin: PictureChoice | None = None,
        button: str = "Save…",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Copy figure" if button == "Copy" else "Save figure")
        self._sizes = sizes
        self.which_box = list_box()
        for which, text in WHICH.items():
            if which in sizes:
                self.which_box.addItem(text, which)
        self.which_box.setEnabled(self.which_box.count() > 1)
        self.chooser = SizeChooser(self, LONGER_SIDES)
        self.background_box = BackgroundBox()
        self.legend_box, self.scale_box = QCheckBox("Colour legend"), QCheckBox("Scale bar")
        self.legend_box.setToolTip("A colour bar with the scalar values, at the lower right")
        self.scale_box.setToolTip("A bar of a round length, at the lower left")
        self.samples_box = _samples_box(begin.samples) if begin and begin.samples else None
        self._memory = QLabel()
        self._memory.setProperty("role", "dim")
        self._lay_out(button)
        self.which_box.currentIndexChanged.connect(self._take_which)
        self.chooser.changed.connect(self._show_memory)
        if begin is not None:
            if begin.which in sizes:
                self.which_box.setCurrentIndex(self.which_box.findData(begin.which))
            self.background_box.show_background(begin.background)
            self.legend_box.setChecked(begin.legend)
            self.scale_box.setChecked(begin.scale_bar)
        self._take_which()
        if begin is not None:
            self.chooser.choose_side(max(begin.width, begin.height))

    def choice(self) -> PictureChoice:
        """Return what is chosen."""
        return PictureChoice(
            *self.chooser.size_chosen,
            self.background_box.currentData(),
            self.legend_box.isChecked(),
            self.scale_box.isChecked(),
            self.which_box.currentData(),
            self.samples_box.currentData() if self.samples_box else 0,
        )

    def _lay_out(self, button: str) -> None:
        form = QFormLayout()
        form.setVerticalSpacing(8)
        form.addRow("Which", self.which_box)
        self.chooser.add_to(form)
        form.addRow("", self._memory)
        if self.samples_box is not None:
            form.addRow("Samples per pixel", self.samples_box)
        form.addRow("Background", self.background_box)
        form.addRow("", self.legend_box)
        form.addRow("", self.scale_box)
        depth = QLabel(f"In perspective the bar's length holds\n{DEPTH_TEXT}.")
        depth.setProperty("role", "dim")
        form.addRow("", depth)
        finish_dialog(self, form, button)

    def _take_which(self) -> None:
        which: Which = self.which_box.currentData()
        self.chooser.set_present(*self._sizes[which])
        # The difference has colours of its own, and fills all of its image.
        self.legend_box.setEnabled(which != "difference")
        self.background_box.setEnabled(which != "difference")
        if self.samples_box is not None:
            self.samples_box.setEnabled(which in ("reference", "both"))

    def _show_memory(self, width: int, height: int) -> None:
        need = readable_size(width * height * BYTES_PER_PIXEL)
        self._memory.setText(f"{width * height / 1e6:.1f} megapixels; takes {need} of memory")


def _samples_box(chosen: int) -> QComboBox:
    box = list_box()
    for samples in sorted({*SAMPLES, chosen}):
        box.addItem(f"{samples}", samples)
    box.setCurrentIndex(box.findData(chosen))
    box.setToolTip("Four times the samples take four times as long, and halve the error")
    return box


def finish_dialog(dialog: QDialog, form: QFormLayout, button: str) -> None:
    """Lay out a form above the button that accepts and the one that does not."""
    buttons = QDialogButtonBox()
    buttons.addButton(button, QDialogButtonBox.ButtonRole.AcceptRole).setDefault(True)
    buttons.addButton(QDialogButtonBox.StandardButton.Cancel)
    buttons.accepted.connect(dialog.accept)
    buttons.rejected.connect(dialog.reject)
    column = QVBoxLayout(dialog)
    column.setContentsMargins(16, 14, 16, 14)
    column.setSpacing(14)
    column.addLayout(form)
    column.addWidget(buttons)
    column.setSizeConstraint(QVBoxLayout.SizeConstraint.SetFixedSize)
