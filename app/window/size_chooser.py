"""Fields for the size of a picture or movie, and for a picture's background."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject, QSize, Qt, Signal
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QColorDialog,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
)

from app.controls import list_box
from app.image_view.picture import BLACK, LARGEST_SIZE, WHITE, Background, paint_background
from app.number_box import WholeNumberBox
from app.wheel_guard import WheelGuard

LEAST_SIZE = 16

_OWN_SIZE, _OTHER_COLOR = "Own size", "Other colour…"

_COLORS: dict[str, Background | None] = {
    "Transparent": None,
    "Black": BLACK,
    "Gradient": "gradient",
    "White": WHITE,
}

Size = tuple[int, int]


class SizeChooser(QObject):
    """Fields for a size in pixels: as on the screen, one of some round ones, or any.

    Parameters
    ----------
    longer_sides : tuple of int
        Presets of the longer side, in the proportions of what is shown.
    largest : int
        Of both sides.
    """

    changed = Signal(int, int)
    """Emitted with another width and height."""

    def __init__(
        self, parent: QObject, longer_sides: tuple[int, ...], largest: int = LARGEST_SIZE
    ) -> None:
        super().__init__(parent)
        self._longer_sides, self._largest = longer_sides, largest
        self._present: Size = (LEAST_SIZE, LEAST_SIZE)
        self.size_box = list_box()
        self.width_box, self.height_box = WholeNumberBox(), WholeNumberBox()
        self.keep = QCheckBox("Keep the proportions of what is shown")
        self.keep.setChecked(True)
        for box, name in ((self.width_box, "Width"), (self.height_box, "Height")):
            box.setAccessibleName(name)
            box.setRange(LEAST_SIZE, largest)
            box.setSuffix(" px")
            # At every key, one side would rewrite the other while it is typed.
            box.setKeyboardTracking(False)
            box.lineEdit().setTextMargins(6, 0, 6, 0)
            box.setToolTip(f"From {LEAST_SIZE} to {largest} pixels")
        self.size_box.activated.connect(self._take_preset)
        self.width_box.valueChanged.connect(partial(self._take_side, self.width_box))
        self.height_box.valueChanged.connect(partial(self._take_side, self.height_box))
        self.keep.toggled.connect(lambda _on: self._take_side(self.width_box, 0))

    @property
    def size_chosen(self) -> Size:
        """Width and height in pixels."""
        return self.width_box.value(), self.height_box.value()

    def add_to(self, form: QFormLayout) -> None:
        """Add the fields to a form."""
        sides = QHBoxLayout()
        sides.addWidget(self.width_box, 1)
        sides.addWidget(QLabel("×"))
        sides.addWidget(self.height_box, 1)
        form.addRow("Size", self.size_box)
        form.addRow("", sides)
        form.addRow("", self.keep)

    def set_present(self, width: int, height: int) -> None:
        """Offer sizes of these proportions, as on the screen; what was chosen is the same row."""
        row = max(self.size_box.currentIndex(), 0)
        self._present = self._within(width, height)
        self.size_box.clear()
        width, height = self._present
        self.size_box.addItem(f"As shown: {width} × {height}", self._present)
        for side in self._longer_sides:
            scale = side / max(width, height)
            size = self._within(round(width * scale), round(height * scale))
            self.size_box.addItem(f"{size[0]} × {size[1]}", size)
        self.size_box.addItem(_OWN_SIZE, None)
        if row == self.size_box.count() - 1:
            self._take_side(self.width_box, 0)
        else:
            self._take_preset(row)

    def choose_side(self, longer: int) -> None:
        """Choose the preset with a longer side; without one, nothing changes."""
        for row in range(1, self.size_box.count()):
            size = self.size_box.itemData(row)
            if size is not None and max(size) == longer:
                self._take_preset(row)
                return

    def _take_preset(self, row: int) -> None:
        size = self.size_box.itemData(row)
        if size is None:
            self.width_box.setFocus()
            self.width_box.selectAll()
        else:
            self._show_size(*size)

    def _take_side(self, changed: WholeNumberBox, _value: int) -> None:
        """Let the other side follow the one that was changed, and name the preset."""
        width, height = self.size_chosen
        if self.keep.isChecked():
            shown_width, shown_height = self._present
            if changed is self.width_box:
                height = round(width * shown_height / shown_width)
            else:
                width = round(height * shown_width / shown_height)
        self._show_size(*self._within(width, height))

    def _show_size(self, width: int, height: int) -> None:
        for box, value in ((self.width_box, width), (self.height_box, height)):
            box.show_value(value)
        presets = [self.size_box.itemData(row) for row in range(self.size_box.count())]
        present = (width, height)
        own = len(presets) - 1
        self.size_box.setCurrentIndex(presets.index(present) if present in presets else own)
        self.changed.emit(width, height)

    def _within(self, width: int, height: int) -> Size:
        """Scale a size down until both sides are offered, and enlarge sides that are too short."""
        scale = min(self._largest / max(width, height), 1.0)
        return max(round(width * scale), LEAST_SIZE), max(round(height * scale), LEAST_SIZE)


class BackgroundBox(QComboBox):
    """A background: transparent, black, a gradient, white or any colour."""

    def __init__(self) -> None:
        super().__init__()
        WheelGuard(self)
        self._color: tuple[int, int, int] = (128, 128, 128)
        for name, color in _COLORS.items():
            self.addItem(_swatch(color), name, color)
        self.addItem(_swatch(self._color), _OTHER_COLOR, self._color)
        self._other = self.count() - 1
        self._shown_row = 0
        self.show_background(BLACK)
        self.activated.connect(self._take)

    def show_background(self, background: Background | None) -> None:
        """Choose a background."""
        rows = [row for row in range(self._other) if self.itemData(row) == background]
        if not rows and background is not None and background != "gradient":
            self._color = background
            self.setItemData(self._other, background)
            self.setItemIcon(self._other, _swatch(background))
        self._shown_row = rows[0] if rows else self._other
        self.setCurrentIndex(self._shown_row)

    def _take(self, row: int) -> None:
        """Ask for the colour if it is another one; the choice before stays if none is given."""
        if self.itemText(row) == _OTHER_COLOR:
            color = QColorDialog.getColor(QColor(*self._color), self, "Background")
            if not color.isValid():
                self.setCurrentIndex(self._shown_row)
                return
            self.show_background((color.red(), color.green(), color.blue()))
        self._shown_row = self.currentIndex()


def _swatch(color: Background | None) -> QIcon:
    """Return an icon of a colour; a pattern for none."""
    size = QSize(14, 14)
    pixmap = QPixmap(size)
    painter = QPainter(pixmap)
    paint_background(painter, pixmap.rect(), color or (200, 200, 200))
    if color is None:
        painter.fillRect(pixmap.rect(), Qt.BrushStyle.Dense4Pattern)
    painter.end()
    return QIcon(pixmap)
