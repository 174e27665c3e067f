"""Panel of findings: values of a region or place, strongest edits, *What if*, the source."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import zip_longest

from PySide6.QtCore import QEvent, QObject, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QEnterEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QFrame,
    QHBoxLayout,
    QLabel,
    QMenu,
    QScrollArea,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app import theme
from app.controls import ElidedLabel, add_action, fill, label, named, text_button
from app.glosses import explain, without_links
from app.icons import IconButton
from app.number_box import NumberBox
from app.sensitivity_view.findings import ROWS, Row, Values, edits_found, source_text, values_found
from app.sensitivity_view.response_layer import ResponseLayer
from app.sensitivity_view.what_if import EditActions, Emphasis, WhatIfQuestion
from app.state.sensitivity_asker import SensitivityAsker
from app.state.workspace import Workspace
from app.tf_editor.editor import HEADER_HEIGHT

WIDTH = 296
HEADING_HEIGHT = 22
ROW_HEIGHT, LOW_ROW_HEIGHT = 26, 19  # of a row, in pixels: usually, and where there is little room
BAR = 2

LOW_BELOW = 266  # height of the editor below which rows are lower
OPEN_FROM = 1600  # width of the editor from which the panel is open unless it was closed

EMPHASES: tuple[tuple[Emphasis, str, int, str], ...] = (
    ("raise", "▲", 24, "Double the opacity of these values"),
    ("lower", "▼", 24, "Halve the opacity of these values"),
    ("isolate", "Isolate", 52, "Show these values alone"),
)
"""Buttons of a value: what they do, their text, width and tooltip."""


class AddButton(QToolButton):
    """Adds a mode when clicked; the menu next to it has the same in another colour."""

    def __init__(self, place: str, add: Callable[[bool], object]) -> None:
        super().__init__()
        self.setText("Add")
        self.setToolTip(
            f"Add a mode at {place}: with the listed opacity and the colour of the TF there"
        )
        self.setPopupMode(QToolButton.ToolButtonPopupMode.MenuButtonPopup)
        menu = QMenu(self)
        add_action(menu, "In a colour that stands out", partial(add, True))
        self.setMenu(menu)
        self.clicked.connect(lambda: add(False))


class PanelRow(QWidget):
    """A line of texts, and buttons that are drawn while the mouse or the focus is on the row."""

    def __init__(self, widths: tuple[int, int], buttons: Sequence[QAbstractButton]) -> None:
        super().__init__()
        self.buttons = list(buttons)
        self.siblings: Sequence[PanelRow] = (self,)  # the rows of its list
        self._shown = Row((), "")
        self._labels = [QLabel() if width else ElidedLabel() for width in widths]
        self._row = row = QHBoxLayout(self)
        row.setSpacing(4)
        for text, width in zip(self._labels, widths, strict=True):
            text.setMinimumWidth(width)
            text.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            row.addWidget(text, 0 if width else 1)
        for button in self.buttons:
            button.installEventFilter(self)
            row.addWidget(button)
        self.set_height(ROW_HEIGHT)

    def set_height(self, height: int) -> None:
        """Set the height in pixels, and nearly the same for the buttons."""
        self.setFixedHeight(height)
        for button in self.buttons:
            button.setFixedHeight(min(height - BAR, 22))

    @property
    def is_lit(self) -> bool:
        """Whether its buttons are drawn."""
        pointed = [
            row
            for row in self.siblings
            if row.underMouse() or any(button.hasFocus() for button in row.buttons)
        ]
        return self in (pointed or self.siblings[:1])

    def show_row(self, row: Row | None, is_fresh: bool) -> None:
        """Show a row, dim if it is not fresh; or none."""
        self.setVisible(row is not None)
        self.setEnabled(is_fresh)
        if row is None:
            return
        if row != self._shown:
            self._shown = row
            for shown, text in zip(self._labels, row.texts, strict=True):
                if isinstance(shown, ElidedLabel):
                    shown.full_text = text
                else:
                    shown.setText(text)
            self._row.setContentsMargins(28 if row.badge else 4, 0, 2, BAR)
            self.setToolTip(row.tip)
            self.setAccessibleName(" ".join(row.texts))
        self.update()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Draw the buttons only while the row is lit."""
        kind = event.type()
        if kind in (QEvent.Type.FocusIn, QEvent.Type.FocusOut):
            self._update_all()
        return kind == QEvent.Type.Paint and not self.is_lit

    def enterEvent(self, event: QEnterEvent) -> None:
        """Light the row."""
        super().enterEvent(event)
        self._update_all()

    def leaveEvent(self, event: QEvent) -> None:
        """Let the row be as the others."""
        super().leaveEvent(event)
        self._update_all()

    def _update_all(self) -> None:
        for row in self.siblings:
            row.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint ground, badge and bar."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        if self.is_lit:
            painter.setBrush(QColor(theme.FIELD))
            painter.drawRoundedRect(QRectF(self.rect()), 4, 4)
        if self._shown.badge:
            painter.setBrush(QColor(theme.CHANGE if self.isEnabled() else theme.DISABLED))
            box = QRectF(4, (self.height() - 18) / 2, 18, 18)
            painter.drawRoundedRect(box, 3, 3)
            painter.setPen(QColor(theme.WINDOW))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, self._shown.badge)
        if self._shown.share is not None:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.VISIBLE))
            painter.drawRect(QRectF(0, self.height() - BAR, self._shown.share * self.width(), BAR))


class SourceLabel(QLabel):
    """Names the engines of the curves, with the curves' colours."""

    def __init__(self, workspace: Workspace) -> None:
        super().__init__(textFormat=Qt.TextFormat.RichText, wordWrap=True)
        self._workspace = workspace
        self.setProperty("role", "dim")
        explain(self)
        flags = Qt.TextInteractionFlag
        self.setTextInteractionFlags(flags.LinksAccessibleByMouse | flags.LinksAccessibleByKeyboard)
        self.refresh()

    @property
    def plain_text(self) -> str:
        """The line as plain text."""
        return without_links(self.text())

    def refresh(self) -> None:
        """Name the present sources."""
        text = source_text(self._workspace)
        if text != self.text():
            self.setText(text)
        # By Tab, too, where there is a text; Enter opens the glossary.
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus if text else Qt.FocusPolicy.NoFocus)


class FindingsPanel(QFrame):
    """Lists what is visible in the region or at the clicked place, and the strongest edits."""

    fitted = Signal()  # it has opened or closed

    def __init__(
        self,
        asker: SensitivityAsker,
        layer: ResponseLayer,
        actions: EditActions,
        what_if: WhatIfQuestion,
        source: QWidget,
        plot: QWidget,
    ) -> None:
        super().__init__()
        self._asker, self._layer, self._actions, self._what_if = asker, layer, actions, what_if
        self._plot = plot
        plot.installEventFilter(self)
        self._has_room = self._is_folded = self._is_low = False
        self.values = Values()
        self.setProperty("role", "side")
        self.setFixedWidth(WIDTH)
        self.title = ElidedLabel()
        self.title.setProperty("role", "title")
        self.title.setFixedHeight(HEADER_HEIGHT)
        self.values_note, self.edits_note = _heading(), _heading()
        self.edits = QWidget()  # what is about them
        self.rename = IconButton("rename", "Rename the region")
        self.close_button = IconButton("close", "Close", "Esc")
        self.close_button.clicked.connect(lambda: asker.asked.open_panel(False))
        tip = "Opacity of the modes that the list adds"
        self.height_box = named(NumberBox(), "Opacity of the modes to add", tip)
        self.height_box.setFixedSize(44, 22)
        self.height_box.show_value(asker.asked.choices.height)
        self.height_box.valueChanged.connect(lambda height: asker.asked.choose(height=height))
        self.value_rows = [
            PanelRow((0, 40), [self._emphasis(index, *each) for each in EMPHASES])
            for index in range(ROWS)
        ]
        self.edit_rows = [
            PanelRow((50, 0), [AddButton("this value", partial(self._add, index))])
            for index in range(ROWS)
        ]
        for row in self.value_rows:
            row.siblings = self.value_rows
        for row in self.edit_rows:
            row.siblings = self.edit_rows
        self.result = label("", "dim", wraps=True)
        # A result replaces the source line, so that nothing else moves.
        self._said = QStackedWidget()
        for line in (source, self.result):
            self._said.addWidget(line)
        self._lay_out()
        self.show_open()

    @property
    def controls(self) -> list[QWidget]:
        """Widgets that Tab reaches, in its order."""
        values = [button for row in self.value_rows for button in row.buttons]
        adds = [button for row in self.edit_rows for button in row.buttons]
        head = [self._what_if.button, self.rename, self.close_button]
        return [*head, *values, self.height_box, *adds]

    @property
    def is_open(self) -> bool:
        """Whether the panel is visible."""
        choices = self._asker.asked.choices
        is_wanted = self._has_room if choices.panel is None else choices.panel
        return is_wanted and choices.shown and not self._is_folded

    @property
    def is_asked_for(self) -> bool:
        """True if it is open in a window that is too small for it to open by itself."""
        return self.is_open and not self._has_room

    def show_open(self) -> None:
        """Show or hide the panel."""
        focus = QApplication.focusWidget()
        if not self.is_open and focus is not None and self.isAncestorOf(focus):
            # Otherwise Qt would move the focus to the volume's name in the bar.
            self.window().setFocus()
        if self.isHidden() == self.is_open:
            self.keep_room(self._plot.underMouse())
            self.setVisible(self.is_open)
            self.raise_()
            self.fitted.emit()

    def fold(self, width: int, height: int) -> None:
        """Take less room in a low editor, and open by itself in a wide one."""
        self._has_room, self._is_folded = width >= OPEN_FROM, height <= HEADER_HEIGHT
        is_low = self._is_low = height < LOW_BELOW
        for row in (*self.value_rows, *self.edit_rows):
            row.set_height(LOW_ROW_HEIGHT if is_low else ROW_HEIGHT)
        self.show_open()

    def eventFilter(self, _plot: QObject, event: QEvent) -> bool:
        """Share the room with the plot again once the mouse has left that."""
        if event.type() == QEvent.Type.Leave:
            self.keep_room(False)
        return False

    def keep_room(self, keeps: bool) -> None:
        """Set whether the plot keeps its width while the panel opens, over it, or closes."""
        editor = self.parentWidget()
        row = None if editor is None else editor.layout()
        if editor is None or row is None:
            return
        row.setEnabled(not keeps)
        row.activate()
        if keeps:
            self.setGeometry(editor.rect().adjusted(editor.width() - WIDTH, 0, 0, 0))

    def leaveEvent(self, event: QEvent) -> None:
        """List the present values and edits, once the mouse has left the rows."""
        super().leaveEvent(event)
        if self._layer.holds:
            self._layer.holds = False
            self._layer.refresh()
        self.refresh()

    def refresh(self) -> None:
        """Show the present values and edits, unless something moves: images come first."""
        asker, layer = self._asker, self._layer
        if asker.state.live:
            # In a drag the mouse is elsewhere; from the menu, it may not have come back.
            layer.holds = False
            return
        # Under the mouse, rows stay where they are.
        self.values = self.values.of(asker, layer.holds or self.underMouse())
        values = values_found(asker, self.values.found)
        edits, effects = edits_found(asker, layer.peaks, values)
        name, is_place = asker.asked.region_name, asker.asked.place is not None
        self.title.full_text = "Clicked place" if is_place else name
        # Edits are those of the region.
        self.edits.setVisible(not is_place)
        self.rename.setEnabled(asker.asked.active is not None)
        for note, rows, found in (
            (self.values_note, self.value_rows, values),
            (self.edits_note, self.edit_rows, edits),
        ):
            note.setText(found.note)
            # In a low panel, the note is left out if there are rows.
            note.setVisible(bool(found.note) and not (self._is_low and found.rows))
            for row, shown in zip_longest(rows, found.rows):
                row.show_row(shown, found.is_fresh)
        for row, value in zip(self.value_rows, values.rows, strict=False):
            for button, (how, *_) in zip(row.buttons, EMPHASES, strict=True):
                button.setAccessibleName(f"{how.capitalize()} {value.texts[0]}")
        for row, (_flag, name) in zip(self.edit_rows, effects, strict=False):
            row.buttons[0].setAccessibleName(f"Add {name.partition(';')[0].lower()}")
        layer.say_effects(effects)
        self._what_if.enable()

    def show_result(self) -> None:
        """Show what an edit changes, or the source of what is listed."""
        self.result.setText(self._what_if.result)
        self._said.setCurrentIndex(1 if self._what_if.result else 0)

    def _lay_out(self) -> None:
        head = QHBoxLayout()
        head.addWidget(self.title, 1)
        fill(head, self._what_if.button, self.rename, self.close_button, margins=(12, 0, 4, 0))
        page = QWidget()
        page.setProperty("role", "side page")
        opacity = _heading("opacity")
        opacity.setToolTip(self.height_box.toolTip())
        parts = _heading("Add a mode"), 0, opacity, self.height_box
        heading = fill(QHBoxLayout(), *parts, spacing=6)
        fill(QVBoxLayout(self.edits), heading, *self.edit_rows, self.edits_note)
        self._said.setContentsMargins(4, 0, 0, 0)
        rows = [self.values_note, *self.value_rows, self.edits, self._said]
        fill(QVBoxLayout(page), *rows, 0, margins=(8, 0, 8, 4))
        scroll = QScrollArea(widgetResizable=True)
        scroll.setProperty("role", "side")
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        scroll.setWidget(page)
        scroll.setMinimumHeight(60)
        fill(QVBoxLayout(self), head, scroll, margins=(1, 0, 0, 0))

    def _emphasis(
        self, index: int, how: Emphasis, text: str, width: int, tip: str
    ) -> QAbstractButton:
        button = text_button(text, tip, partial(self._emphasize, index, how), "chip")
        button.setFixedWidth(width)
        return button

    def _emphasize(self, index: int, how: Emphasis) -> None:
        if index < len(self.values.found):
            # Two clicks on one button mean the same value.
            self._layer.holds = True
            self._actions.emphasize(self.values.found[index], how)

    def _add(self, index: int, striking: bool) -> None:
        # The mouse has left the panel for the menu.
        self._layer.holds = not striking
        self._actions.add_mode(index, striking)


def _heading(text: str = "") -> QLabel:
    heading = label(text, "dim")
    heading.setContentsMargins(4, 0, 0, 0)
    heading.setFixedHeight(HEADING_HEIGHT)
    return heading
