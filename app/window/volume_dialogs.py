"""Dialogs about the open volume: the file's volumes, visible labels, properties."""

from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QColor, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QScrollArea,
    QTableWidget,
    QVBoxLayout,
    QWidget,
)

from app.controls import answer_box, clicked, close_box, fill, form, label, named, table, untinted
from model.errors import VolumeError
from model.scene.volume import ChoiceKind, Content, Volume
from model.volume_files.checks import readable_size, times
from model.volume_files.choice import Choice, describe
from model.volume_files.grid import typed_spacing, typed_stretch
from model.volume_files.masks import LabelMap

TITLES: dict[ChoiceKind, str] = {
    "series": "Series",
    "array": "Arrays",
    "time": "Time step",
    "channel": "Channel",
    "component": "Component",
}
LISTED = ("series", "array")  # kinds whose contents differ in size: each has its own row

_CHECKS = Qt.CheckState.Unchecked, Qt.CheckState.Checked
SWATCH = 14  # side of a label's colour, in pixels
MARGINS = 16, 14, 16, 14
COLUMNS = ("Name", "Voxels", "Type", "Size")
FEWEST_ROWS, MOST_ROWS = 4, 12  # rows of a list visible at once


class ContentsDialog(QDialog):
    """Lists the volumes of a file or folder, and asks which of them to show."""

    def __init__(
        self,
        name: str,
        contents: Sequence[Content],
        open_it: Callable[[Choice], object],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Contents of {name}")
        self._open = open_it
        self._contents = tuple(contents)
        self._kinds = list(dict.fromkeys(content.kind for content in contents))
        self.tables: dict[str, QTableWidget] = {}
        self.boxes: dict[str, QComboBox] = {}
        self._buttons, self.open_button = answer_box(self, "Open", "Keep what is shown")
        self._buttons.accepted.connect(self._accept)
        self._lay_out(name)
        self._check()

    def choice(self) -> Choice:
        """Return the selection."""
        return Choice(**{kind: self._of(kind)[self._row(kind)].name for kind in self._kinds})

    def _of(self, kind: str) -> list[Content]:
        return [content for content in self._contents if content.kind == kind]

    def _row(self, kind: str) -> int:
        if kind in self.tables:
            return max(self.tables[kind].currentRow(), 0)
        return max(self.boxes[kind].currentIndex(), 0)

    def _lay_out(self, name: str) -> None:
        column = fill(QVBoxLayout(self), margins=MARGINS, spacing=12)
        text = f"{name} holds more than one volume. Which one do you want to see?"
        column.addWidget(QLabel(text, textFormat=Qt.TextFormat.PlainText, wordWrap=True))
        rows = form()
        for kind in self._kinds:
            if kind in LISTED:
                column.addWidget(label(TITLES[kind], "title"))
                self.tables[kind] = self._table(self._of(kind), TITLES[kind])
                column.addWidget(self.tables[kind], 1)
            else:
                self.boxes[kind] = self._box(self._of(kind), TITLES[kind])
                rows.addRow(TITLES[kind], self.boxes[kind])
                rows.addRow("", _size_label(self._of(kind)))
        column.addLayout(rows)
        column.addWidget(self._buttons)
        self.setMinimumWidth(560 if self.tables else 420)

    def _table(self, contents: list[Content], title: str) -> QTableWidget:
        sizes = [readable_size(each.nbytes) if each.nbytes else "" for each in contents]
        rows = [
            (each.name, _crossed(times(each.dimensions)), each.scalar_type, size)
            for each, size in zip(contents, sizes, strict=True)
        ]
        made = table(title, COLUMNS, rows)
        made.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        for row, content in enumerate(contents):
            if content.is_read:
                made.selectRow(row)
                made.setCurrentCell(row, 0)
        header = made.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        shown = min(len(contents), MOST_ROWS)
        made.setMinimumHeight((shown + 1) * made.verticalHeader().defaultSectionSize() + 8)
        made.currentCellChanged.connect(lambda *_: self._check())
        made.cellDoubleClicked.connect(lambda *_: self._accept())
        return made

    def _box(self, contents: list[Content], title: str) -> QComboBox:
        box = named(QComboBox(), title)
        for content in contents:
            box.addItem(content.name)
            if content.is_read:
                box.setCurrentIndex(box.count() - 1)
        box.currentIndexChanged.connect(lambda *_: self._check())
        return box

    def _is_shown(self) -> bool:
        return all(self._of(kind)[self._row(kind)].is_read for kind in self._kinds)

    def _check(self) -> None:
        self.open_button.setEnabled(not self._is_shown())

    def _accept(self) -> None:
        is_shown, choice = self._is_shown(), self.choice()
        self.accept()
        if not is_shown:
            self._open(choice)


class LabelsDialog(QDialog):
    """Lists the labels of a mask's file, and asks which of them to show."""

    def __init__(
        self,
        labels: LabelMap,
        shown: Collection[float],
        show: Callable[[list[float]], object],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Labels of {labels.name}")
        self._show, self._values = show, labels.values
        self.list = named(QListWidget(), "Labels to show")
        for value in labels.values:
            number, *name = labels.names(value)
            item = QListWidgetItem(f"{name[0]} ({number})" if name else number, self.list)
            item.setCheckState(_CHECKS[value in shown])
            if color := labels.label(value).color:
                swatch = QPixmap(SWATCH, SWATCH)
                swatch.fill(QColor.fromRgbF(*color))
                item.setIcon(untinted(swatch))
        buttons, self.show_button = answer_box(self, "&Show")
        for text, is_on in (("&All", True), ("&None", False)):
            button = buttons.addButton(text, QDialogButtonBox.ButtonRole.ActionRole)
            button.setAutoDefault(False)
            clicked(button, partial(self._check_all, is_on))
        note = label(labels.note, "dim", wraps=True)
        note.setVisible(bool(labels.note))
        parts = QLabel("Only voxels of these labels are shown:"), self.list, note, buttons
        fill(QVBoxLayout(self), *parts, margins=MARGINS, spacing=12)
        self.list.itemChanged.connect(lambda _: self._offer())
        buttons.accepted.connect(self._accept)
        self.finished.connect(self.deleteLater)
        rows = min(max(len(labels.values), FEWEST_ROWS), MOST_ROWS)
        self.list.setMinimumHeight(rows * (self.list.sizeHintForRow(0) + 2))
        self._offer()

    @property
    def chosen(self) -> list[float]:
        """The checked labels."""
        items = map(self.list.item, range(self.list.count()))
        checks = (item.checkState() == Qt.CheckState.Checked for item in items)
        return [value for value, is_on in zip(self._values, checks, strict=True) if is_on]

    def _check_all(self, is_on: bool) -> None:
        # Once for all of them: there may be thousands.
        with QSignalBlocker(self.list):
            for row in range(self.list.count()):
                self.list.item(row).setCheckState(_CHECKS[is_on])
        self._offer()
        self.list.viewport().update()

    def _offer(self) -> None:
        self.show_button.setEnabled(bool(self.chosen))

    def _accept(self) -> None:
        self.accept()
        self._show(self.chosen)


def _size_label(contents: list[Content]) -> QLabel:
    size, voxels = readable_size(contents[0].nbytes), _crossed(times(contents[0].dimensions))
    return label(f"{len(contents)} of {voxels} voxels, {size} each", "dim")


def _crossed(text: str) -> str:
    """Return a text with the sign of the window between dimensions."""
    return text.replace(" x ", " × ")


class PropertiesDialog(QDialog):
    """Lists a volume's properties as ``info`` does; spacing and stretch can be typed."""

    def __init__(
        self,
        path: Path,
        volume: Volume,
        read_again: Callable[..., object],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Properties of {volume.name}")
        self._read_again = read_again
        self.rows = [("file", str(path)), *describe(volume)]
        content, rows = QWidget(), form()
        content.setLayout(rows)
        self.spacing = QLineEdit(dict(self.rows)["spacing"].replace(" x ", ", "))
        self.spacing.setAccessibleName("Spacing along x, y and z, and its unit")
        self.stretch = QLineEdit(f"{volume.file.stretch:.6g}")
        self.stretch.setAccessibleName("Factor by which z is stretched; 1 follows its spacing")
        self.apply = clicked(QPushButton("Read again"), self._apply)
        self.apply.setEnabled(False)
        self.problem = label("", "dim", wraps=True)
        self.problem.hide()
        for box in (self.spacing, self.stretch):
            box.setCursorPosition(0)
            box.textEdited.connect(self._check)
        self._before = self.spacing.text(), self.stretch.text()
        for name, text in self.rows:
            if name == "spacing":
                parts = self.stretch, QLabel("times"), self.apply
                line = fill(QHBoxLayout(), *parts, spacing=8)
                hint = label("and unit, such as 0.5, 0.5, 2 mm", "dim")
                rows.addRow("Spacing", fill(QHBoxLayout(), self.spacing, hint, spacing=8))
                rows.addRow("Stretch z by", line)
                rows.addRow(self.problem)
            if name in ("spacing", "z is drawn"):
                continue
            text = text if name == "file" else _crossed(text)
            value = QLabel(text, textFormat=Qt.TextFormat.PlainText, wordWrap=True)
            by = Qt.TextInteractionFlag
            value.setTextInteractionFlags(by.TextSelectableByMouse | by.TextSelectableByKeyboard)
            rows.addRow(name.capitalize(), value)
        area = QScrollArea(widgetResizable=True)
        area.setFrameShape(QScrollArea.Shape.NoFrame)
        area.setWidget(content)
        fill(QVBoxLayout(self), area, close_box(self), margins=MARGINS, spacing=6)
        self.apply.setDefault(True)
        self.resize(560, 460)

    def _check(self) -> None:
        problems = []
        for box, parse in ((self.spacing, typed_spacing), (self.stretch, typed_stretch)):
            problem = ""
            try:
                parse(box.text())
            except VolumeError as error:
                problem = str(error)
            problems.append(problem)
        self.problem.setText(" ".join(filter(None, problems)))
        self.problem.setVisible(any(problems))
        is_changed = (self.spacing.text(), self.stretch.text()) != self._before
        self.apply.setEnabled(is_changed and not any(problems))

    def _apply(self) -> None:
        typed = {"spacing": self.spacing.text(), "stretch": self.stretch.text()}
        # A typed spacing is stretched only by the typed factor.
        unchanged = typed["spacing"] == self._before[0], typed["stretch"] == "1" == self._before[1]
        for name, is_left in zip([*typed], unchanged, strict=True):
            if is_left:
                del typed[name]
        self._read_again(**typed)
        self.accept()
