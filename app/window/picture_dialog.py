"""The dialog that asks for a picture's size, background and legend."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QColorDialog,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from app.controls import list_box
from app.image_view.picture import LARGEST_SIZE, Background
from app.number_entry import WholeNumberBox, first_refused
from model.volume_files.checks import readable_size

LEAST_SIZE = 16

LONGER_SIDES = (1024, 2048, 4096, 8192)
"""Presets of the longer side; the picture keeps the proportions of what is shown."""

BYTES_PER_PIXEL = 20
"""Memory of a rendering and of the picture that is made of it."""

BLACK, WHITE = (0, 0, 0), (255, 255, 255)

_OWN_SIZE, _OTHER_COLOR = "Own size", "Other colour…"


@dataclass(frozen=True)
class PictureChoice:
    """How a picture is saved or copied.

    Attributes
    ----------
    width, height : int
        In pixels, 16 to 8192.
    background : tuple of int or None
        Red, green and blue, 0..255; None for a transparent picture.
    legend : bool
        Whether the colour legend is painted over it.
    """

    width: int
    height: int
    background: Background | None = BLACK
    legend: bool = False


class PictureDialog(QDialog):
    """Asks for the size, the background and the legend of a picture.

    Parameters
    ----------
    present_size : tuple of int
        Width and height of the image as shown, in pixels.
    last : PictureChoice or None
        Choice to begin with, other than its size; None for a black background.
    button : str
        Label of the button that accepts, such as "Save…" or "Copy".
    """

    def __init__(
        self,
        present_size: tuple[int, int],
        last: PictureChoice | None = None,
        button: str = "Save…",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Copy picture" if button == "Copy" else "Save picture")
        self._present = _within(*present_size)
        self._color: Background = (128, 128, 128)
        self._shown_row = 0
        self.size_box = list_box()
        self.width_box, self.height_box = WholeNumberBox(), WholeNumberBox()
        self.keep = QCheckBox("Keep the proportions of what is shown")
        self.keep.setChecked(True)
        self.background_box = list_box()
        self.legend_box = QCheckBox("Colour legend")
        self.legend_box.setToolTip("A colour bar with the scalar values, at the lower right")
        self._memory = QLabel()
        self._memory.setProperty("role", "dim")
        self._fill_boxes()
        self._lay_out(button)
        self._connect()
        self._take_preset(0)
        if last is not None:
            self._show_background(last.background)
            self.legend_box.setChecked(last.legend)

    def choice(self) -> PictureChoice:
        """Return what is chosen."""
        return PictureChoice(
            self.width_box.value(),
            self.height_box.value(),
            self.background_box.currentData(),
            self.legend_box.isChecked(),
        )

    def accept(self) -> None:
        """Close, unless a typed size cannot be taken."""
        if first_refused(self) is None:
            super().accept()

    def _fill_boxes(self) -> None:
        width, height = self._present
        self.size_box.addItem(f"As shown: {width} × {height}", self._present)
        for side in LONGER_SIDES:
            scale = side / max(width, height)
            size = _within(round(width * scale), round(height * scale))
            self.size_box.addItem(f"{size[0]} × {size[1]}", size)
        self.size_box.addItem(_OWN_SIZE, None)
        for box in (self.width_box, self.height_box):
            box.setRange(LEAST_SIZE, LARGEST_SIZE)
            box.setSuffix(" px")
            # At every key, one side would rewrite the other while it is typed.
            box.setKeyboardTracking(False)
            box.lineEdit().setTextMargins(6, 0, 6, 0)
            box.setToolTip(f"From {LEAST_SIZE} to {LARGEST_SIZE} pixels")
        for name, color in (("Transparent", None), ("Black", BLACK), ("White", WHITE)):
            self.background_box.addItem(_swatch(color), name, color)
        self.background_box.addItem(_swatch(self._color), _OTHER_COLOR, self._color)
        self._show_background(BLACK)

    def _lay_out(self, button: str) -> None:
        sides = QHBoxLayout()
        sides.addWidget(self.width_box, 1)
        sides.addWidget(QLabel("×"))
        sides.addWidget(self.height_box, 1)
        form = QFormLayout()
        form.setVerticalSpacing(8)
        form.addRow("Size", self.size_box)
        form.addRow("", sides)
        form.addRow("", self.keep)
        form.addRow("", self._memory)
        form.addRow("Background", self.background_box)
        form.addRow("", self.legend_box)
        buttons = QDialogButtonBox()
        buttons.addButton(button, QDialogButtonBox.ButtonRole.AcceptRole).setDefault(True)
        buttons.addButton(QDialogButtonBox.StandardButton.Cancel)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 14, 16, 14)
        column.setSpacing(14)
        column.addLayout(form)
        column.addWidget(buttons)
        column.setSizeConstraint(QVBoxLayout.SizeConstraint.SetFixedSize)

    def _connect(self) -> None:
        self.size_box.activated.connect(self._take_preset)
        self.width_box.valueChanged.connect(partial(self._take_side, self.width_box))
        self.height_box.valueChanged.connect(partial(self._take_side, self.height_box))
        self.keep.toggled.connect(lambda _on: self._take_side(self.width_box, 0))
        self.background_box.activated.connect(self._take_background)

    def _take_preset(self, row: int) -> None:
        size = self.size_box.itemData(row)
        if size is None:
            self.width_box.setFocus()
            self.width_box.selectAll()
        else:
            self._show_size(*size)

    def _take_side(self, changed: WholeNumberBox, _value: int) -> None:
        """Let the other side follow the one that was changed, and name the preset."""
        width, height = self.width_box.value(), self.height_box.value()
        if self.keep.isChecked():
            shown_width, shown_height = self._present
            if changed is self.width_box:
                height = round(width * shown_height / shown_width)
            else:
                width = round(height * shown_width / shown_height)
        self._show_size(*_within(width, height))

    def _show_size(self, width: int, height: int) -> None:
        for box, value in ((self.width_box, width), (self.height_box, height)):
            box.show_value(value)
        presets = [self.size_box.itemData(row) for row in range(self.size_box.count())]
        present = (width, height)
        own = len(presets) - 1
        self.size_box.setCurrentIndex(presets.index(present) if present in presets else own)
        need = readable_size(width * height * BYTES_PER_PIXEL)
        self._memory.setText(f"{width * height / 1e6:.1f} megapixels; takes {need} of memory")

    def _take_background(self, row: int) -> None:
        """Ask for the colour if it is another one; the choice before stays if none is given."""
        if self.background_box.itemText(row) == _OTHER_COLOR:
            color = QColorDialog.getColor(QColor(*self._color), self, "Background")
            if not color.isValid():
                self.background_box.setCurrentIndex(self._shown_row)
                return
            self._show_background((color.red(), color.green(), color.blue()))
        self._shown_row = self.background_box.currentIndex()

    def _show_background(self, background: Background | None) -> None:
        box = self.background_box
        rows = [row for row in range(3) if box.itemData(row) == background]
        if not rows and background is not None:
            self._color = background
            box.setItemData(3, background)
            box.setItemIcon(3, _swatch(background))
        self._shown_row = rows[0] if rows else 3
        box.setCurrentIndex(self._shown_row)


def _within(width: int, height: int) -> tuple[int, int]:
    """Scale a size down until both sides are offered, and enlarge sides that are too short."""
    scale = min(LARGEST_SIZE / max(width, height), 1.0)
    return max(round(width * scale), LEAST_SIZE), max(round(height * scale), LEAST_SIZE)


def _swatch(color: Background | None) -> QIcon:
    """Return an icon of a colour; a pattern for none."""
    size = QSize(14, 14)
    pixmap = QPixmap(size)
    pixmap.fill(QColor(*(color or (200, 200, 200))))
    if color is None:
        painter = QPainter(pixmap)
        painter.fillRect(pixmap.rect(), Qt.BrushStyle.Dense4Pattern)
        painter.end()
    return QIcon(pixmap)
