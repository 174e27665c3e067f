"""The dialog that asks for a headerless file's layout, with previews."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QSize, QSizeF, Qt
from PySide6.QtGui import QImage, QPixmap, QResizeEvent
from PySide6.QtWidgets import (
    QDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from app import theme
from app.controls import answer_box, fill, form, label, list_box, named
from app.engines.background import LatestCall
from app.number_box import NumberBox, WholeNumberBox
from model.volume_files.checks import readable_size
from model.volume_files.raw import (
    SCALAR_TYPES,
    ByteOrder,
    RawLayout,
    file_size,
    fit_sentence,
    guess_layout,
    preview,
)

SIZE = 220  # least side of a picture, in pixels: three fit side by side on a laptop's screen


class SlicePreview(QLabel):
    """Shows a slice as large as possible in its true proportions."""

    def __init__(self) -> None:
        super().__init__(alignment=Qt.AlignmentFlag.AlignCenter)
        self.image: QImage | None = None
        self._proportions = QSizeF(1.0, 1.0)
        self.setMinimumSize(SIZE, SIZE)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setStyleSheet(f"background: {theme.CANVAS}; border-radius: 6px")

    def show_slice(self, levels: NDArray[np.uint8], width: float, height: float) -> None:
        """Show a slice of uint8 (H, W) with its width and height in any unit."""
        rows, columns = levels.shape
        stored, gray = np.ascontiguousarray(levels), QImage.Format.Format_Grayscale8
        # The copy makes the image own its pixels.
        self.image = QImage(stored.data, columns, rows, columns, gray).copy()
        self._proportions = QSizeF(width, height)
        self._draw()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Draw the slice as large as possible."""
        super().resizeEvent(event)
        self._draw()

    def _draw(self) -> None:
        if self.image is not None:
            keep = Qt.AspectRatioMode.KeepAspectRatio
            size = self._proportions.scaled(QSizeF(self.size()), keep).toSize()
            how = Qt.AspectRatioMode.IgnoreAspectRatio, Qt.TransformationMode.SmoothTransformation
            shown = self.image.scaled(size.expandedTo(QSize(1, 1)), *how)
            self.setPixmap(QPixmap.fromImage(shown))


MOST_VOXELS = 100_000  # largest dimension that can be typed
MOST_SKIPPED = 2**31 - 1  # most bytes that can be skipped
ORDERS: dict[ByteOrder, str] = {"little": "Little endian", "big": "Big endian"}
UNKNOWN = RawLayout((256, 256, 256), "uint8")  # if neither name nor size gives a layout
Previews = tuple[RawLayout, list[NDArray[np.uint8]]]


class RawDialog(QDialog):
    """Asks for a headerless file's layout; raises VolumeError if there is no file.

    The middle slices follow the entries: under a wrong layout they look torn or noisy. Only a
    layout of exactly the file's size can be opened.
    """

    def __init__(self, path: Path, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Open raw file {path.name}")
        self._path = path
        self._present = file_size(path)
        self.dimension_boxes = [WholeNumberBox() for _ in range(3)]
        self.type_box, self.order_box = list_box(), list_box()
        self.spacing_boxes = [NumberBox() for _ in range(3)]
        self.offset_box = WholeNumberBox()
        self.slices = [SlicePreview() for _ in "xyz"]
        self.fit = QLabel(wordWrap=True, textFormat=Qt.TextFormat.PlainText)
        self._buttons, self.open_button = answer_box(self, "Open")
        self._buttons.accepted.connect(self.accept)
        self._fill_boxes()
        self._lay_out()
        self._show_layout(guess_layout(path, self._present) or UNKNOWN)
        self._previews = LatestCall("raw previews", self, self._show_previews, self._show_problem)
        self._connect()
        self._check()

    def choice(self) -> RawLayout:
        """Return the layout as entered; its spacing is None if it was left at 1."""
        nx, ny, nz = (box.value() for box in self.dimension_boxes)
        x, y, z = (box.value() for box in self.spacing_boxes)
        spacing = None if x == y == z == 1 else (x, y, z)
        kind = self.type_box.currentText(), self.order_box.currentData()
        return RawLayout((nx, ny, nz), *kind, spacing, self.offset_box.value())

    def done(self, result: int) -> None:
        """Close, and end the thread."""
        self._previews.stop()
        self._previews.join()
        super().done(result)

    def _fill_boxes(self) -> None:
        for axis, box in zip("xyz", self.dimension_boxes, strict=True):
            box.setRange(2, MOST_VOXELS)
            name = f"Voxels along {axis}"
            named(box, name, name + ("; x is fastest" if axis == "x" else ""))
            box.lineEdit().setTextMargins(6, 0, 6, 0)
        for axis, spacing_box in zip("xyz", self.spacing_boxes, strict=True):
            spacing_box.set_limits(1e-6, 1e6)
            spacing_box.setSingleStep(0.1)
            spacing_box.show_value(1.0)
            tip = f"Distance between voxels along {axis}, in any unit"
            named(spacing_box, f"Spacing along {axis}", tip)
        self.offset_box.setRange(0, min(self._present, MOST_SKIPPED))
        named(self.offset_box, "Header bytes", "Bytes before the first voxel, such as a header")
        self.offset_box.lineEdit().setTextMargins(6, 0, 6, 0)
        self.type_box.addItems(list(dict.fromkeys(SCALAR_TYPES.values())))
        for order, text in ORDERS.items():
            self.order_box.addItem(text, order)
        self.order_box.setToolTip("Which byte of a value comes first in the file")

    def _lay_out(self) -> None:
        rows = form(
            ("Dimensions", _row(self.dimension_boxes)),
            ("Type", self.type_box),
            ("Byte order", self.order_box),
            ("Header bytes", self.offset_box),
            ("Spacing", _row(self.spacing_boxes)),
        )
        size = label(f"{self._path.name}, {readable_size(self._present)}", "title")
        slices = QGridLayout()
        slices.setSpacing(8)
        slices.setRowStretch(0, 1)
        for place, (axis, widget) in enumerate(zip("xyz", self.slices, strict=True)):
            caption = label(f"Middle slice across {axis}", "dim")
            slices.addWidget(widget, 0, place)
            slices.addWidget(caption, 1, place, Qt.AlignmentFlag.AlignHCenter)
        # Room for two lines, so that nothing moves while numbers are entered.
        self.fit.setMinimumHeight(2 * self.fit.fontMetrics().lineSpacing() + 2)
        self.fit.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
        column = fill(QVBoxLayout(self), size, rows, margins=(16, 14, 16, 14), spacing=12)
        column.addLayout(slices, 1)
        column.addWidget(self.fit)
        column.addWidget(self._buttons)

    def _connect(self) -> None:
        numbers = *self.dimension_boxes, self.offset_box
        changes = *(box.valueChanged for box in numbers), self.type_box.activated
        spacing = (box.valueChanged for box in self.spacing_boxes)
        for changed in (*changes, self.order_box.activated, *spacing):
            changed.connect(lambda _value: self._check())

    def _show_layout(self, layout: RawLayout) -> None:
        boxes = [*self.dimension_boxes, self.offset_box]
        for box, count in zip(boxes, (*layout.dimensions, layout.offset), strict=True):
            box.show_value(count)
        self.type_box.setCurrentText(SCALAR_TYPES[layout.scalar_type])
        self.order_box.setCurrentText(ORDERS[layout.byte_order])

    def _check(self) -> None:
        path, layout = self._path, self.choice()
        self.order_box.setEnabled(layout.dtype.itemsize > 1)
        fits = layout.nbytes == self._present
        self.open_button.setEnabled(fits)
        self.fit.setText(fit_sentence(layout, self._present))
        self.fit.setStyleSheet(f"color: {theme.DIM if fits else theme.ATTENTION}")
        self._previews.ask(lambda: (layout, [preview(path, layout, axis) for axis in range(3)]))

    def _show_previews(self, previews: Previews) -> None:
        layout, levels = previews
        spacing = layout.spacing or (1, 1, 1)
        lengths = [n * s for n, s in zip(layout.dimensions, spacing, strict=True)]
        for axis, (widget, picture) in enumerate(zip(self.slices, levels, strict=True)):
            width, height = (length for k, length in enumerate(lengths) if k != axis)
            widget.show_slice(picture, width, height)

    def _show_problem(self, problem: str) -> None:
        for widget in self.slices:
            widget.image = None
            widget.clear()
        self.fit.setText(problem)
        self.fit.setStyleSheet(f"color: {theme.ERROR}")
        self.open_button.setEnabled(False)


def _row(boxes: list[WholeNumberBox] | list[NumberBox]) -> QHBoxLayout:
    row = QHBoxLayout()
    for number, box in enumerate(boxes):
        if number:
            row.addWidget(QLabel("×"))
        row.addWidget(box, 1)
    return row
