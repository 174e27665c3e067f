"""The dialog that asks what a movie shows, and for its size, length and rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from PySide6.QtWidgets import QDialog, QFormLayout, QLabel, QWidget

from app.controls import list_box
from app.number_entry import WholeNumberBox, first_refused
from app.tf_editor.number_box import NumberBox
from app.window.figure import FigureLook, Which
from app.window.picture_dialog import (
    WHICH,
    PictureChoice,
    depth_label,
    finish_dialog,
    legend_box,
    samples_box,
    scale_box,
)
from app.window.size_chooser import BackgroundBox, Size, SizeChooser

MovieKind = Literal["turntable", "path"]
"""A full turn about the up axis, or the path between named places of the map of TFs."""

LONGER_SIDES = (512, 1024, 1920)
LARGEST = 4096
"""Most pixels along a side that players show."""

SHORTEST, LONGEST = 0.5, 600.0
"""Limits of a movie's length in seconds."""

USUAL_SECONDS, USUAL_RATE, HIGHEST_RATE = 8.0, 25, 60

PATH_SIZE = 384

KINDS: dict[MovieKind, str] = {
    "turntable": "Turntable: a full turn about the up axis",
    "path": "Path between the named places of the map",
}


@dataclass(frozen=True)
class MovieChoice:
    """How a movie is saved.

    Attributes
    ----------
    kind : {"turntable", "path"}
    which : {"generator", "reference"}
        Whose images a turntable has.
    look : FigureLook
        A path's pictures are squares, of its width.
    seconds : float
        Length.
    rate : int
        Pictures a second.
    samples : int
        Of each pixel of a path-traced ground truth; 0 in other light.
    """

    kind: MovieKind
    which: Which
    look: FigureLook
    seconds: float = USUAL_SECONDS
    rate: int = USUAL_RATE
    samples: int = 0

    @property
    def count(self) -> int:
        """Number of pictures."""
        return max(round(self.seconds * self.rate), 2)


class MovieDialog(QDialog):
    """Asks what a movie shows, and for its size, length, rate, background, legend and scale bar.

    Parameters
    ----------
    kinds : tuple of {"turntable", "path"}
        What can be made into a movie now, the choice to begin with first.
    sizes : dict of tuple of int
        Width and height on the screen of "reference" and "generator", where they are there.
    begin : PictureChoice
        Image, background, legend and scale bar to begin with, and samples where they count.
    """

    def __init__(
        self,
        kinds: tuple[MovieKind, ...],
        sizes: dict[Which, Size],
        begin: PictureChoice,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Save movie")
        self._sizes = sizes
        self.kind_box, self.which_box = list_box(), list_box()
        for kind in kinds:
            self.kind_box.addItem(KINDS[kind], kind)
        self.kind_box.setEnabled(len(kinds) > 1)
        for which in ("reference", "generator"):
            if which in sizes:
                self.which_box.addItem(WHICH[which], which)
        if self.which_box.findData(begin.which) >= 0:
            self.which_box.setCurrentIndex(self.which_box.findData(begin.which))
        self.chooser = SizeChooser(self, LONGER_SIDES, LARGEST)
        self.seconds_box, self.rate_box = NumberBox(), WholeNumberBox()
        self.background_box = BackgroundBox(transparent=False)
        self.background_box.show_background(begin.background or (0, 0, 0))
        self.legend_box, self.scale_box = legend_box(), scale_box()
        self.legend_box.setChecked(begin.legend)
        self.scale_box.setChecked(begin.scale_bar)
        self.samples_box = samples_box(begin.samples) if begin.samples else None
        self._depth = depth_label()
        self._count = QLabel()
        self._count.setProperty("role", "dim")
        self._lay_out()
        self.kind_box.currentIndexChanged.connect(self._take_kind)
        self.which_box.currentIndexChanged.connect(self._take_kind)
        for box in (self.seconds_box, self.rate_box):
            box.valueChanged.connect(self._show_count)
        self._take_kind()
        self._show_count()

    def choice(self) -> MovieChoice:
        """Return what is chosen; the sides are even numbers, as movies' have to be."""
        width, height = (side // 2 * 2 for side in self.chooser.size_chosen)
        look = FigureLook(
            width,
            height,
            self.background_box.currentData(),
            self.legend_box.isChecked(),
            self.scale_box.isChecked(),
        )
        return MovieChoice(
            self.kind_box.currentData(),
            self.which_box.currentData() or "reference",
            look,
            self.seconds_box.value(),
            self.rate_box.value(),
            self.samples_box.currentData() if self.samples_box else 0,
        )

    def accept(self) -> None:
        """Close, unless a typed number cannot be taken."""
        if first_refused(self) is None:
            super().accept()

    def _lay_out(self) -> None:
        self.seconds_box.set_limits(SHORTEST, LONGEST)
        self.seconds_box.explain("Length in seconds")
        self.seconds_box.show_value(USUAL_SECONDS)
        self.rate_box.setRange(1, HIGHEST_RATE)
        self.rate_box.setValue(USUAL_RATE)
        self.rate_box.setKeyboardTracking(False)
        self.rate_box.setToolTip(f"Pictures a second, from 1 to {HIGHEST_RATE}")
        form = QFormLayout()
        form.setVerticalSpacing(8)
        form.addRow("Movie", self.kind_box)
        form.addRow("Which", self.which_box)
        self.chooser.add_to(form)
        form.addRow("Seconds", self.seconds_box)
        form.addRow("Pictures a second", self.rate_box)
        form.addRow("", self._count)
        if self.samples_box is not None:
            form.addRow("Samples of each pixel", self.samples_box)
        form.addRow("Background", self.background_box)
        form.addRow("", self.legend_box)
        form.addRow("", self.scale_box)
        form.addRow("", self._depth)
        finish_dialog(self, form, "Save…")

    def _take_kind(self) -> None:
        is_path = self.kind_box.currentData() == "path"
        # Its engine is the map's, on black, above the plot of each TF.
        for widget in (self.which_box, self.background_box, self.legend_box, self.scale_box):
            widget.setEnabled(not is_path)
        which: Which = self.which_box.currentData()
        if self.samples_box is not None:
            self.samples_box.setEnabled(which == "reference" and not is_path)
        self.chooser.set_present(*((PATH_SIZE, PATH_SIZE) if is_path else self._sizes[which]))

    def _show_count(self) -> None:
        self._count.setText(f"{self.choice().count} pictures")
