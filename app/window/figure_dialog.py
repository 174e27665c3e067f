"""The dialog that asks what a figure or movie shows and how it looks, with a preview."""

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QSignalBlocker, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QImage, QPainter, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QColorDialog,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QDoubleSpinBox,
    QHBoxLayout,
    QLabel,
    QListView,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from app.controls import WheelGuard, answer_box, fill, form, label, list_box, named, untinted
from app.number_box import WholeNumberBox, short
from app.picture import BLACK, DPI, LARGEST_SIZE, WHITE, Background, millimetres, paint_background
from app.window.figure import CONTENTS, FigureChoice, Size, Which
from model.rendering.scale_bar import DEPTH_TEXT

LEAST_SIZE, LARGEST_MOVIE = 16, 4096  # fewest pixels along a side; most that movie players show

LONGER_SIDES = (512, 1024, 1920, 2048, 4096, 8192)
"""Presets of the longer side; the figure keeps the image's proportions."""

SAMPLES = (1, 4, 16, 64, 256, 1024)  # samples of each pixel that path-traced figures may have
SHORTEST, LONGEST, HIGHEST_RATE = 0.5, 600.0, 60  # seconds, and frames per second
LONG = 5.0  # seconds from which the dialog names a figure's time
PREVIEW = 440, 260  # width and height of the preview, in pixels

_OWN_SIZE, _OTHER_COLOR = "Custom size", "Other colour…"
_COLORS: dict[str, Background | None] = {
    "Transparent": None,
    "Black": BLACK,
    "Gradient": "gradient",
    "White": WHITE,
}


class FigureDialog(QDialog):
    """Asks what a figure shows, for its size, background and marks, and whether it moves."""

    def __init__(
        self, sizes: dict[Which, Size], begin: FigureChoice, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Save figure")
        self._sizes = sizes
        self.preview: Callable[[FigureChoice], object] = lambda _choice: None
        self._present: Size = (LEAST_SIZE, LEAST_SIZE)
        self.copies = False
        self.which_box, self.size_box = list_box(), list_box()
        for which, (text, _images) in CONTENTS.items():
            if which in sizes:
                self.which_box.addItem(text, which)
        self.width_box, self.height_box = self._side("Width"), self._side("Height")
        self.keep = QCheckBox("Keep proportions")
        self.keep.setChecked(True)
        self.movie_box = QCheckBox("One full turn, as a movie")
        self._no_movie = label("No movie: a difference is saved as it is shown", "dim")
        self.seconds_box, self.rate_box = QDoubleSpinBox(), QSpinBox()
        self.seconds_box.setDecimals(1)
        self._limit(self.seconds_box, SHORTEST, LONGEST, begin.seconds or 8.0)
        self._limit(self.rate_box, 1, HIGHEST_RATE, begin.rate)
        self.background_box = BackgroundBox()
        self.legend_box, self.scale_box = QCheckBox("Colour legend"), QCheckBox("Scale bar")
        self.legend_box.setToolTip("A colour bar with the scalar values, at the lower right")
        self.scale_box.setToolTip(f"In perspective, its length holds {DEPTH_TEXT}")
        self.session_box = QCheckBox("Keep the session in the file")
        self.session_box.setToolTip(
            "A PNG figure then opens like a session. It holds TF, view, light and regions, and the "
            "name of the volume's file, which may be a patient's."
        )
        self.samples_box = _samples_box(begin.samples)
        self._cost = label("", "dim")
        widest = f"69.4 × 69.4 mm at {DPI} dpi, about 599 min"
        self._cost.setMinimumWidth(self._cost.fontMetrics().horizontalAdvance(widest))
        self._pace = 0.0  # seconds that a sample of the preview's pixels took
        self._picture = named(label("Drawing …", "dim"), "Preview")
        self._picture.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignHCenter)
        self._picture.setFixedSize(*PREVIEW)
        self._lay_out()
        self._show(begin)
        self._connect()
        self._follow()

    def choice(self) -> FigureChoice:
        """Return the choice."""
        width, height = self.width_box.value(), self.height_box.value()
        background, is_movie = self.background_box.currentData(), self.movie_box.isChecked()
        if is_movie:
            background = background or BLACK
        marks = self.legend_box.isChecked(), self.scale_box.isChecked()
        seconds = self.seconds_box.value() if is_movie else 0.0
        which, rate = self.which_box.currentData(), self.rate_box.value()
        samples, keeps = self.samples_box.currentData(), self.session_box.isChecked()
        return FigureChoice(width, height, background, *marks, which, samples, seconds, rate, keeps)

    def show_preview(self, picture: QImage, pace: float) -> None:
        """Show the figure, small; a sample of a pixel has taken so many seconds."""
        self._pace = pace
        self._show_cost()
        self._picture.setPixmap(QPixmap.fromImage(picture))

    def _side(self, name: str) -> WholeNumberBox:
        box = named(WholeNumberBox(), name, f"From {LEAST_SIZE} to {LARGEST_SIZE} pixels")
        box.setRange(LEAST_SIZE, LARGEST_SIZE)
        box.setSuffix(" px")
        # Following each key, one side would rewrite the other during typing.
        box.setKeyboardTracking(False)
        box.lineEdit().setTextMargins(6, 0, 6, 0)
        return box

    def _limit(self, box: QDoubleSpinBox | QSpinBox, low: float, high: float, value: float) -> None:
        WheelGuard(box)
        box.lineEdit().setTextMargins(6, 0, 6, 0)
        box.setRange(low, high)  # type: ignore[arg-type]
        box.setValue(value)  # type: ignore[arg-type]
        box.setToolTip(f"From {short(low)} to {short(high)}")

    def _lay_out(self) -> None:
        sides = fill(QHBoxLayout(), self.width_box, QLabel("×"), self.height_box, spacing=6)
        sides.setStretch(0, 1)
        sides.setStretch(2, 1)
        self._form = form(
            ("Show", self.which_box),
            ("", self.movie_box),
            ("", self._no_movie),
            ("Seconds", self.seconds_box),
            ("Frames per second", self.rate_box),
            ("Size", self.size_box),
            ("", sides),
            ("", self.keep),
            ("", self._cost),
            ("Samples per pixel", self.samples_box),
            ("Background", self.background_box),
            ("", self.legend_box),
            ("", self.scale_box),
            ("", self.session_box),
        )
        # Its longest name is not always shown, and the fields must not move by that.
        longest = self._form.labelForField(self.rate_box).sizeHint().width()
        self._form.labelForField(self.size_box).setMinimumWidth(longest)
        self._form.setRowVisible(self.which_box, self.which_box.count() > 1)
        buttons, self.save_button = answer_box(self, "Save…")
        self.copy_button = buttons.addButton("Copy", QDialogButtonBox.ButtonRole.ActionRole)
        self.copy_button.clicked.connect(self._copy)
        buttons.accepted.connect(self.accept)
        self.save_button.setFocus()
        both = fill(QHBoxLayout(), self._form, spacing=16)
        both.addWidget(self._picture, 0, Qt.AlignmentFlag.AlignTop)
        column = fill(QVBoxLayout(self), both, buttons, margins=(16, 14, 16, 14), spacing=14)
        column.setSizeConstraint(QVBoxLayout.SizeConstraint.SetFixedSize)

    def _show(self, begin: FigureChoice) -> None:
        self.which_box.setCurrentIndex(max(self.which_box.findData(begin.which), 0))
        self.background_box.show_background(begin.background)
        self.legend_box.setChecked(begin.legend)
        self.scale_box.setChecked(begin.scale_bar)
        self.session_box.setChecked(begin.session)
        self._set_present()
        if begin.height:
            self.keep.setChecked(False)
            self._show_size(*self._within(begin.width, begin.height))
        elif begin.width:
            width, height = self._present
            scale = begin.width / max(width, height)
            self._show_size(*self._within(round(width * scale), round(height * scale)))

    def _connect(self) -> None:
        self.which_box.currentIndexChanged.connect(self._set_present)
        self.movie_box.toggled.connect(self._set_present)
        self.size_box.activated.connect(self._take_preset)
        for side in (self.width_box, self.height_box):
            side.valueChanged.connect(partial(self._take_side, side))
        switches = self.keep, self.legend_box, self.scale_box
        for changed in (*(s.toggled for s in switches), self.background_box.currentIndexChanged):
            changed.connect(self._follow)
        for box in (self.seconds_box, self.rate_box):
            box.valueChanged.connect(self._show_cost)
        self.samples_box.currentIndexChanged.connect(self._show_cost)

    def _copy(self) -> None:
        self.copies = True
        self.accept()

    def _follow(self) -> None:
        """Enable what the choices allow, and show a preview."""
        which, is_movie = self.which_box.currentData(), self.movie_box.isChecked()
        self._form.setRowVisible(self.movie_box, which != "difference")
        self._form.setRowVisible(self._no_movie, which == "difference")
        if is_movie and which == "difference":
            self.movie_box.setChecked(False)
            return
        for box in (self.seconds_box, self.rate_box):
            self._form.setRowVisible(box, is_movie)
        self.copy_button.setVisible(not is_movie)
        self._form.setRowVisible(self.session_box, not is_movie)
        largest = LARGEST_MOVIE if is_movie else LARGEST_SIZE
        for box in (self.width_box, self.height_box):
            box.set_limits(LEAST_SIZE, largest)
        self._take_side(self.width_box, 0)
        # The difference has its own colours.
        self._form.setRowVisible(self.legend_box, which != "difference")
        # It has no samples but in path-traced light.
        has_samples = self.samples_box.currentData() and which not in ("generator", "difference")
        self._form.setRowVisible(self.samples_box, bool(has_samples))
        self._show_result()

    def _show_result(self) -> None:
        self._show_cost()
        self.preview(self.choice())

    def _show_cost(self) -> None:
        """Say how large a figure is in print and how long it takes, if that is long."""
        choice = self.choice()
        pixels = choice.width * choice.height
        # In other light, pictures take little longer than their preview.
        seconds = self._pace * pixels * choice.samples * max(choice.frame_count, 1)
        time = f"about {duration(seconds)}" if seconds >= LONG else ""
        width, height = (short(millimetres(side), 3) for side in (choice.width, choice.height))
        printed = "" if choice.frame_count else f"{width} × {height} mm at {DPI} dpi"
        self._cost.setText(", ".join(filter(None, (printed, time))))

    def _set_present(self, _row: int = 0) -> None:
        """Offer sizes of the image's proportions; the chosen row stays."""
        row = max(self.size_box.currentIndex(), 0)
        width, height = self._present = self._within(*self._sizes[self.which_box.currentData()])
        self.size_box.clear()
        rows, listed = self.size_box.view(), {self._present}
        assert isinstance(rows, QListView)
        self.size_box.addItem(f"As shown: {width} × {height}", self._present)
        for side in LONGER_SIDES:
            scale = side / max(width, height)
            size = self._within(round(width * scale), round(height * scale))
            self.size_box.addItem(f"{size[0]} × {size[1]}", size)
            rows.setRowHidden(self.size_box.count() - 1, size in listed)
            listed.add(size)
        self.size_box.addItem(_OWN_SIZE, None)
        if row == self.size_box.count() - 1:
            self._take_side(self.width_box, 0)
        else:
            self._take_preset(row)
        self._follow()

    def _take_preset(self, row: int) -> None:
        size = self.size_box.itemData(row)
        if size is None:
            self.width_box.setFocus()
            self.width_box.selectAll()
        else:
            self._show_size(*size)

    def _take_side(self, changed: WholeNumberBox, _value: int) -> None:
        """Make the other side follow the changed one, and name the preset."""
        width, height = self.width_box.value(), self.height_box.value()
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
        own = len(presets) - 1
        row = presets.index((width, height)) if (width, height) in presets else own
        with QSignalBlocker(self.size_box):
            self.size_box.setCurrentIndex(row)
        self._show_result()

    def _within(self, width: int, height: int) -> Size:
        """Scale a size down until both sides are allowed, and enlarge sides that are too short."""
        # A movie's sides are even numbers.
        largest, step = (LARGEST_MOVIE, 2) if self.movie_box.isChecked() else (LARGEST_SIZE, 1)
        scale = min(largest / max(width, height), 1.0)
        sides = (round(side * scale) // step * step for side in (width, height))
        width, height = (max(side, LEAST_SIZE) for side in sides)
        return width, height


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
        """Ask for the colour if a custom one is chosen; Cancel restores the previous choice."""
        if row == self._other:
            color = QColorDialog.getColor(QColor(*self._color), self, "Background")
            if not color.isValid():
                self.setCurrentIndex(self._shown_row)
                return
            self.show_background((color.red(), color.green(), color.blue()))
        self._shown_row = self.currentIndex()


def duration(seconds: float) -> str:
    """Return a time as text, in seconds, minutes or hours."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 90 * 60 else f"{seconds / 3600:.0f} h"


def _swatch(color: Background | None) -> QIcon:
    """Return an icon of a colour; a pattern for none."""
    pixmap = QPixmap(QSize(14, 14))
    painter = QPainter(pixmap)
    paint_background(painter, pixmap.rect(), color or (200, 200, 200))
    if color is None:
        painter.fillRect(pixmap.rect(), Qt.BrushStyle.Dense4Pattern)
    painter.end()
    return untinted(pixmap)


def _samples_box(chosen: int) -> QComboBox:
    box = list_box()
    for samples in sorted({*SAMPLES, chosen}):
        box.addItem(f"{samples}", samples)
    box.setCurrentIndex(box.findData(chosen))
    box.setToolTip("Four times the samples take four times as long, and halve the error")
    return box
