"""The dialog with all that is known of the open volume and its file."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from model.errors import VolumeError
from model.scene.volume import Volume
from model.volume_files.description import describe
from model.volume_files.frame import typed_spacing


class PropertiesDialog(QDialog):
    """Lists a volume's properties in the words of ``info``; the spacing can be typed."""

    spacingTyped = Signal(str)
    """Emitted with another spacing and its unit, see :func:`typed_spacing`."""

    def __init__(self, path: Path, volume: Volume, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Properties of {volume.name}")
        self.rows = [("file", str(path)), *describe(volume)]
        content = QWidget()
        form = QFormLayout(content)
        form.setVerticalSpacing(6)
        form.setHorizontalSpacing(16)
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self.spacing = QLineEdit(dict(self.rows)["spacing"].replace(" x ", ", "))
        self.spacing.setAccessibleName("Spacing along x, y and z, and its unit")
        self.apply = QPushButton("Read with this spacing")
        self.apply.setEnabled(False)
        self.apply.clicked.connect(self._take_spacing)
        self.spacing.textEdited.connect(self._check_spacing)
        for name, text in self.rows:
            if name == "spacing":
                line = QHBoxLayout()
                line.setSpacing(8)
                line.addWidget(self.spacing, 1)
                line.addWidget(self.apply)
                form.addRow("Spacing", line)
                continue
            label = QLabel(text)
            label.setTextFormat(Qt.TextFormat.PlainText)
            label.setWordWrap(True)
            label.setTextInteractionFlags(
                Qt.TextInteractionFlag.TextSelectableByMouse
                | Qt.TextInteractionFlag.TextSelectableByKeyboard
            )
            form.addRow(name.capitalize(), label)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFrameShape(QScrollArea.Shape.NoFrame)
        area.setWidget(content)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        buttons.rejected.connect(self.reject)
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 14, 16, 14)
        column.addWidget(area, 1)
        column.addWidget(buttons)
        self.resize(560, 460)

    def _check_spacing(self, text: str) -> None:
        problem = ""
        try:
            typed_spacing(text)
        except VolumeError as error:
            problem = str(error)
        self.apply.setEnabled(not problem)
        self.spacing.setToolTip(problem)

    def _take_spacing(self) -> None:
        self.spacingTyped.emit(self.spacing.text())
        self.accept()
