"""Panel of findings: values of a region or place, edits that show most, what if, the source."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app.controls import ElidedLabel, text_button
from app.icons import IconButton
from app.number_box import NumberBox
from app.sensitivity_view.edit_actions import EditActions, Emphasis
from app.sensitivity_view.panel_rows import HEIGHT, LOW_HEIGHT, AddButton, PanelRow
from app.sensitivity_view.response_layer import ResponseLayer
from app.sensitivity_view.what_if import WhatIfQuestion
from app.short_numbers import short
from app.state.sensitivity_answers import VisibilityAnswer
from app.state.sensitivity_asker import SensitivityAsker
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.editor import HEADER_HEIGHT
from model.scene.region import ImageRegion
from model.scene.value_text import range_text, value_text
from model.sensitivity.contributions import Contribution, contributions, follow, percentages


class ListedValues(QObject):
    """Finds the values, and keeps their order as long as they are listed."""

    changed = Signal()

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        asker: SensitivityAsker,
        count: int,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._asker = asker
        self._count = count
        self._place: ImageRegion | None = None
        self._holds = False
        self.found: tuple[Contribution, ...] = ()
        asker.visibilityAnswered.connect(self._find)
        sensitivity.placeChanged.connect(lambda _place: self._find())
        sensitivity.regionsChanged.connect(self._find)

    @property
    def is_fresh(self) -> bool:
        """Whether they are of the present image."""
        answer = self._answer
        return answer is not None and answer.is_of(self._state.inputs)

    def hold(self, holds: bool) -> None:
        """Keep values in their order, and those that no longer show, or list what shows now.

        Whoever clicks the same button twice means the same value.
        """
        if holds != self._holds:
            self._holds = holds
            self._find()

    def leave(self) -> bool:
        """List the region's values again; return False if they are."""
        if self._sensitivity.place is None:
            return False
        self._sensitivity.pick(None)
        return True

    @property
    def _answer(self) -> VisibilityAnswer | None:
        """Visibility of the values that are listed; None while it is not known."""
        if self._sensitivity.place is not None:
            return self._asker.pick
        answer, outline = self._asker.visibility, self._sensitivity.outline
        return answer if answer is not None and answer.request.regions[0] == outline else None

    def _find(self) -> None:
        answer = self._answer
        if answer is None:
            self.found = ()
        else:
            scalar_range, place = self._state.scalar_range, answer.request.regions[0]
            before = self.found if self._holds and place == self._place else ()
            found = contributions(answer.value[0], scalar_range)
            self._place, self.found = place, follow(before, found, scalar_range)[: self._count]
        self.changed.emit()


PANEL_WIDTH = 276
ROWS = 3
HEADING_HEIGHT = 22

LOW_BELOW = 266
"""Height of the panel below which its rows are lower, and *What if* is in a heading."""

OPEN_FROM = 1600
"""Width of the editor from which the panel is open unless it was closed."""


class FindingsPanel(QFrame):
    """Lists what is visible in the region or at the clicked place, and edits that show most."""

    renameRequested = Signal()
    openChanged = Signal(bool)

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        asker: SensitivityAsker,
        layer: ResponseLayer,
        actions: EditActions,
        what_if: WhatIfQuestion,
        source: QWidget,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._asker = asker
        self._layer = layer
        self._actions = actions
        self._what_if = what_if
        self._wanted: bool | None = None
        """Whether the user wants it open; None for where there is room."""
        self._has_room = False
        self.values = ListedValues(state, sensitivity, asker, ROWS, self)
        self.setProperty("role", "side")
        self.setFixedWidth(PANEL_WIDTH)
        self.heading, self.values_heading, self.edits_heading = ElidedLabel(), QLabel(), QLabel()
        self.values_note, self.edits_note = QLabel(), QLabel()
        self.rename = IconButton("rename", "Rename the region")
        self.close_button = IconButton("close", "Close", "Esc")
        self.adds = [AddButton("this value") for _ in range(ROWS)]
        self.raises, self.lowers, self.isolates = (
            [_row_button(text, width, tip) for _ in range(ROWS)]
            for text, width, tip in (
                ("▲", 24, "Double the opacity of these values"),
                ("▼", 24, "Halve the opacity of these values"),
                ("Isolate", 52, "Show these values alone"),
            )
        )
        trios = zip(self.raises, self.lowers, self.isolates, strict=True)
        self.value_rows = [PanelRow((0, 40), trio) for trio in trios]
        self.edit_rows = [PanelRow((44, 50, 0), (add,)) for add in self.adds]
        for rows in (self.value_rows, self.edit_rows):
            for row in rows:
                row.set_siblings(rows)
        self.height_box = _height_box(sensitivity.choices.height)
        self.result = QLabel()
        self.result.setWordWrap(True)
        self.result.setProperty("role", "dim")
        self._said = QStackedWidget()
        self._lay_out(source)
        self._connect()
        self.refresh()
        self._show_open()

    @property
    def is_open(self) -> bool:
        """Whether it is to be seen."""
        asked = self._sensitivity.choices.shown
        return asked and (self._has_room if self._wanted is None else self._wanted)

    @property
    def is_asked_for(self) -> bool:
        """Whether it is open because somebody opened it."""
        return self.is_open and bool(self._wanted)

    def set_open(self, is_open: bool) -> None:
        """Open or close it."""
        self._wanted = is_open
        if is_open and not self._sensitivity.choices.shown:
            self._sensitivity.choose(shown=True)
        self._show_open()

    def fold(self, width: int, height: int) -> None:
        """Take less room in a low editor, and open by itself in a wide one."""
        self._has_room = width >= OPEN_FROM
        is_low = height < LOW_BELOW
        for row in (*self.value_rows, *self.edit_rows):
            row.setFixedHeight(LOW_HEIGHT if is_low else HEIGHT)
        target = self._edits_line if is_low else self._foot
        if target.indexOf(self._what_if.button) < 0:
            target.insertWidget(1 if is_low else 0, self._what_if.button)
        self.edits_heading.setText("Edits" if is_low else "Edits at the peaks")
        self.refresh()
        self._show_open()

    def leaveEvent(self, event: QEvent) -> None:
        """List what shows by now, once nobody is about to click a row again."""
        super().leaveEvent(event)
        self.values.hold(False)

    def _show_open(self) -> None:
        if self.isHidden() == self.is_open:
            self.setVisible(self.is_open)
            self.openChanged.emit(self.is_open)

    def refresh(self) -> None:
        """Show the present values and edits; what is not up to date is dim.

        While something moves it rests: nobody reads it, and the images have the time.
        """
        if self._state.live:
            return
        asked = self._sensitivity
        self.heading.set_full_text(asked.region_name)
        self.rename.setEnabled(asked.active is not None)
        self.values_heading.setText("Values visible" if asked.place is None else "Values here")
        fresh = self.values.is_fresh
        for index, row in enumerate(self.value_rows):
            row.setVisible(index < len(self.values.found))
            row.setEnabled(fresh)
            if index < len(self.values.found):
                self._show_value(index)
        self._note(self.values_note, "" if self.values.found else self._no_value_text(fresh))
        fresh = self._asker.is_fresh(self._asker.region)
        effects = []
        for index, row in enumerate(self.edit_rows):
            row.setVisible(index < len(self._layer.intervals))
            row.setEnabled(fresh)
            if index < len(self._layer.intervals):
                effects.append(self._show_edit(index))
        self._note(self.edits_note, self._edits_note(fresh))
        self._layer.say_effects(effects)
        self._what_if.enable()

    def _note(self, label: QLabel, text: str) -> None:
        label.setText(text)
        label.setVisible(bool(text))

    def _no_value_text(self, fresh: bool) -> str:
        if fresh:
            return "nothing visible"
        return "computing …" if self._asker.engines else ""

    def _edits_note(self, fresh: bool) -> str:
        """Sentence about peaks without a flag, or about there being none; or nothing."""
        layer, state = self._layer, self._state
        if layer.intervals:
            if layer.left_out is None:
                return ""
            value = value_text(layer.left_out, state.scalar_range, state.scale)
            return f"no flag at {value} (background)"
        if fresh:
            # Or it only rises towards values that hardly any voxel has: see the curve.
            return "no edit changes this region" if layer.is_flat else "no peak: see the curve"
        if not self._asker.is_waiting:
            return ""
        return "computing …"

    def _lay_out(self, source: QWidget) -> None:
        head = QHBoxLayout()
        head.setContentsMargins(12, 0, 4, 0)
        head.setSpacing(0)
        self.heading.setProperty("role", "title")
        self.heading.setFixedHeight(HEADER_HEIGHT)
        head.addWidget(self.heading, 1)
        for button in (self.rename, self.close_button):
            head.addWidget(button)
        page = QWidget()
        page.setProperty("role", "side page")
        column = QVBoxLayout(page)
        column.setContentsMargins(8, 0, 8, 4)
        column.setSpacing(0)
        self._edits_line = QHBoxLayout()
        opacity = QLabel("opacity")
        opacity.setToolTip(self.height_box.toolTip())
        self._edits_line.setSpacing(6)
        self._edits_line.addWidget(self.edits_heading)
        self._edits_line.addStretch()
        self._edits_line.addWidget(opacity)
        self._edits_line.addWidget(self.height_box)
        for label in (self.values_heading, self.values_note, self.edits_heading, opacity):
            label.setProperty("role", "dim")
        self.edits_note.setProperty("role", "dim")
        for label in (self.values_heading, self.values_note, self.edits_heading, self.edits_note):
            label.setContentsMargins(4, 0, 0, 0)
            label.setFixedHeight(HEADING_HEIGHT)
        self._foot = QHBoxLayout()
        self._foot.setContentsMargins(4, 6, 0, 0)
        self._foot.setSpacing(8)
        # A result takes the place of the source, so that nothing else moves.
        for line in (source, self.result):
            self._said.addWidget(line)
        self._foot.addWidget(self._said, 1)
        column.addWidget(self.values_heading)
        column.addWidget(self.values_note)
        for row in self.value_rows:
            column.addWidget(row)
        column.addLayout(self._edits_line)
        for row in self.edit_rows:
            column.addWidget(row)
        column.addWidget(self.edits_note)
        column.addLayout(self._foot)
        column.addStretch()
        scroll = QScrollArea()
        scroll.setProperty("role", "side")
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        scroll.setWidget(page)
        scroll.setMinimumHeight(60)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(1, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(head)
        layout.addWidget(scroll, 1)

    def _connect(self) -> None:
        sensitivity, what_if = self._sensitivity, self._what_if
        for index in range(ROWS):
            self.adds[index].addRequested.connect(
                lambda striking, i=index: self._actions.add_mode(i, striking)
            )
            by_how: tuple[tuple[Emphasis, list[QToolButton]], ...] = (
                ("raise", self.raises), ("lower", self.lowers), ("isolate", self.isolates),
            )  # fmt: skip
            for how, buttons in by_how:
                buttons[index].clicked.connect(partial(self._emphasize, index, how))
        self._layer.peakClicked.connect(self._actions.add_mode)
        for changed in (
            self._layer.intervalsChanged, self.values.changed,
            self._asker.regionAnswered, self._state.inputsChangeFinished,
            sensitivity.regionsChanged, sensitivity.choicesChanged,
        ):  # fmt: skip
            changed.connect(lambda *_: self.refresh())
        sensitivity.choicesChanged.connect(lambda _choices: self._show_open())
        self.height_box.valueChanged.connect(lambda height: sensitivity.choose(height=height))
        self.rename.clicked.connect(self.renameRequested)
        self.close_button.clicked.connect(lambda: self.set_open(False))
        what_if.resultChanged.connect(self._show_result)

    def _show_result(self, result: str) -> None:
        self.result.setText(result)
        self._said.setCurrentIndex(1 if result else 0)

    def _emphasize(self, index: int, how: Emphasis, _checked: bool = False) -> None:
        if index < len(self.values.found):
            self.values.hold(True)
            self._actions.emphasize(self.values.found[index], how)

    def _show_value(self, index: int) -> None:
        found = self.values.found[index]
        reach = range_text(found.reach, self._state.scalar_range, self._state.scale)
        texts = (reach, f"{percentages(self.values.found)[index]} %")
        tip = "Values, and their share of what is visible"
        self.value_rows[index].say(texts, tip, share=found.share)
        for button, what in (
            (self.raises[index], "Raise"),
            (self.lowers[index], "Lower"),
            (self.isolates[index], "Isolate"),
        ):
            button.setAccessibleName(f"{what} {reach}")

    def _show_edit(self, index: int) -> tuple[str, str]:
        """Fill a row, and return the edit's effect as a number and as words."""
        interval, state = self._layer.intervals[index], self._state
        value, low, high = (
            value_text(each, state.scalar_range, state.scale)
            for each in (interval.value, interval.low, interval.high)
        )
        number, word = self._effect(interval.predicted(self._sensitivity.choices.height))
        tip = (
            f"A mode of this opacity at {low} to {high} changes the region's pixels by about this\n"
            "much (1 is from black to white), and by less where the image saturates.\n"
            "What if renders the edit."
        )
        self.edit_rows[index].say((value, number, word), tip, badge=str(index + 1))
        by = f", {word} by {number.lstrip('+−')}"
        name = f"Edit {index + 1} at {value}{by}; Enter adds it"
        self.adds[index].setAccessibleName(f"Add edit {index + 1} at {value}{by}")
        return number, name

    def _effect(self, change: float) -> tuple[str, str]:
        """Return a change as a number and in a word."""
        if self._sensitivity.choices.measure == "change":
            return short(change), "changes"
        return short(change, signed=True), "brighter" if change > 0 else "darker"


def _row_button(text: str, width: int, tip: str) -> QToolButton:
    button = text_button(text, tip)
    button.setFixedWidth(width)
    button.setProperty("role", "chip")
    # After a click, keys such as W are the window's again.
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button


def _height_box(height: float) -> NumberBox:
    """Return the box with the opacity of modes whose effect is listed."""
    box = NumberBox()
    box.setFixedSize(44, 22)
    box.setAccessibleName("Opacity of the edits")
    box.show_value(height)
    box.setToolTip("Opacity of the modes that the list adds")
    return box
