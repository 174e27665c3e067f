"""A row of controls: region, measure and engine."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QSignalBlocker, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap, QPolygonF
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QInputDialog,
    QToolButton,
    QWidget,
)

from app import theme
from app.controls import combo, list_box, text_button
from app.state.sensitivity_state import EngineChoice, SensitivityState
from model.sensitivity.measure import Measure

MEASURES: dict[str, tuple[Measure, str]] = {
    "Any change": (
        "change",
        "How much the region's pixels change, in any direction: also where the picture is black "
        "now (norm of dI).",
    ),
    "Brightness": (
        "signed",
        "Whether the region becomes brighter (above 0) or darker: the derivative of its norm "
        "(Eq. 11 of the paper). A black region has none.",
    ),
}

ENGINES: dict[str, tuple[EngineChoice, str]] = {
    "Automatic": (
        "automatic",
        "The ray caster's exact derivative where it is fast enough, the model's otherwise; "
        "at rest both, so that they can be compared.",
    ),
    "Exact": ("exact", "The ray caster: exact, or by differences under global light."),
    "Learned": ("learned", "The model of this volume."),
}


class ChoiceBar(QWidget):
    """Controls of the sensitivity plot, in one row.

    Parameters
    ----------
    state : SensitivityState
    """

    def __init__(
        self,
        state: SensitivityState,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self.shown = QCheckBox("Sensitivity")
        self.shown.setChecked(True)
        self.shown.setToolTip(
            "Show where in the TF an edit changes the picture, and where in the picture it shows"
        )
        self.region = list_box()
        # After a click, keys such as W are the window's again.
        self.region.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.region.setMinimumWidth(84)
        self.region.setToolTip("The part of the picture whose reaction is plotted")
        self.rectangle = _tool_button("rectangle", "Draw a rectangle in either image (R)")
        self.lasso = _tool_button("lasso", "Draw around something in either image (L)")
        self.rename = text_button("✎", "Rename the region")
        self.remove = text_button("✕", "Remove the region")
        self.measure = combo({name: tip for name, (_, tip) in MEASURES.items()})
        self.engine = combo({name: tip for name, (_, tip) in ENGINES.items()})
        for box in (self.measure, self.engine):
            # Narrower than its longest entry where the window is small.
            box.setMinimumWidth(84)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(6)
        for widget in (
            self.shown, self.region, self.rectangle, self.lasso, self.rename, self.remove,
            self.measure, self.engine,
        ):  # fmt: skip
            row.addWidget(widget)
        row.addStretch()
        self._connect()
        self._show_regions()
        self._show_choices()

    def _connect(self) -> None:
        state = self._state
        self.shown.toggled.connect(lambda on: state.choose(shown=on))
        self.region.activated.connect(lambda i: state.activate(i - 1 if i else None))
        self.rectangle.clicked.connect(lambda on: state.set_tool("rectangle" if on else None))
        self.lasso.clicked.connect(lambda on: state.set_tool("lasso" if on else None))
        self.rename.clicked.connect(self._ask_name)
        self.remove.clicked.connect(state.remove_region)
        self.measure.activated.connect(
            lambda i: state.choose(measure=list(MEASURES.values())[i][0])
        )
        self.engine.activated.connect(lambda i: state.choose(engine=list(ENGINES.values())[i][0]))
        state.regionsChanged.connect(self._show_regions)
        state.toolChanged.connect(self._show_tool)
        state.choicesChanged.connect(lambda _choices: self._show_choices())

    def _ask_name(self) -> QInputDialog | None:
        if self._state.active is None:
            return None
        dialog = QInputDialog(self)
        dialog.setWindowTitle("Rename region")
        dialog.setLabelText("Name of the region:")
        dialog.setTextValue(self._state.region_name)
        dialog.textValueSelected.connect(self._state.rename_region)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()
        return dialog

    def _show_regions(self) -> None:
        names = ["Whole image", *(region.name for region in self._state.regions)]
        if [self.region.itemText(i) for i in range(self.region.count())] != names:
            self.region.clear()
            self.region.addItems(names)
        active = self._state.active
        self.region.setCurrentIndex(0 if active is None else active + 1)
        for button in (self.rename, self.remove):
            button.setEnabled(active is not None)

    def _show_tool(self, tool: object) -> None:
        self.rectangle.setChecked(tool == "rectangle")
        self.lasso.setChecked(tool == "lasso")

    def _show_choices(self) -> None:
        choices = self._state.choices
        with QSignalBlocker(self.shown):
            self.shown.setChecked(choices.shown)
        self.measure.setCurrentIndex([m for m, _ in MEASURES.values()].index(choices.measure))
        self.engine.setCurrentIndex([e for e, _ in ENGINES.values()].index(choices.engine))
        for widget in (self.region, self.rectangle, self.lasso, self.measure, self.engine):
            widget.setEnabled(choices.shown)


def _tool_button(shape: str, tip: str) -> QToolButton:
    button = text_button("", tip)
    button.setCheckable(True)
    button.setIcon(_icon(shape))
    return button


def _icon(shape: str) -> QIcon:
    """Draw a small outline."""
    picture = QPixmap(32, 32)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(theme.TEXT), 2.5))
    if shape == "rectangle":
        painter.drawRect(5, 8, 22, 16)
    else:
        painter.drawPolygon(_loop())
    painter.end()
    return QIcon(picture)


def _loop() -> QPolygonF:
    places = ((6, 18), (8, 9), (16, 6), (25, 9), (27, 17), (22, 23), (16, 20), (11, 26))
    return QPolygonF([QPointF(x, y) for x, y in places])
