"""Widgets and helpers that several parts of the window use."""

import html
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Generic, Literal, TypeVar, cast

from PySide6.QtCore import QBuffer, QEvent, QIODevice, QObject, QPoint, QPointF, QSize, Qt
from PySide6.QtGui import (
    QAccessible,
    QAccessibleAnnouncementEvent,
    QAction,
    QActionGroup,
    QColor,
    QHelpEvent,
    QIcon,
    QImage,
    QKeyEvent,
    QKeySequence,
    QMouseEvent,
    QPainter,
    QPixmap,
    QResizeEvent,
    QTextDocument,
)
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QBoxLayout,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QFrame,
    QLabel,
    QLayout,
    QLineEdit,
    QMenu,
    QPushButton,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
    QToolButton,
    QToolTip,
    QWidget,
)

from app import theme


class WheelGuard(QObject):
    """Keeps the wheel from changing a control without focus, such as while scrolling."""

    def __init__(self, control: QWidget) -> None:
        super().__init__(control)
        if control.focusPolicy() == Qt.FocusPolicy.WheelFocus:
            control.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        control.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Pass the wheel on to the parent widget."""
        unwanted = event.type() == QEvent.Type.Wheel and not (
            isinstance(watched, QWidget) and watched.hasFocus()
        )
        if unwanted:
            event.ignore()
        return unwanted


QT_SHIFT = QPoint(2, 16)  # offset that Qt adds to a tooltip's position, in pixels
GAP, WIDTH = 6, 320  # distance to the menu, and largest width of a tooltip, in pixels


class _MenuTips(QObject):
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Show the tooltip of the entry under the mouse; Qt would place it over the menu."""
        is_tip = event.type() == QEvent.Type.ToolTip
        if not (is_tip and isinstance(watched, QMenu) and isinstance(event, QHelpEvent)):
            return False
        action = watched.actionAt(event.pos())
        tip = "" if action is None else action.toolTip()
        # Without one of its own, an action's tooltip is its text.
        if action is None or not tip or tip == _plain(action.text()):
            QToolTip.hideText()
            return True
        text, width = _wrapped(tip)
        entry = watched.actionGeometry(action)
        place = watched.mapToGlobal(QPoint(watched.width() + GAP, entry.top()))
        if place.x() + width > watched.screen().availableGeometry().right():
            place = watched.mapToGlobal(QPoint(-GAP - width, entry.top()))
        QToolTip.showText(place - QT_SHIFT, text, watched, entry)
        return True


def show_tips(menu: QMenu) -> None:
    """Make a menu show its entries' tooltips: at its right or, if there is no room, at its left."""
    menu.setToolTipsVisible(True)
    menu.installEventFilter(_MenuTips(menu))


def _wrapped(tip: str) -> tuple[str, int]:
    """Return a plain or rich tooltip as rich text that is wrapped, and its width in pixels."""
    inside = tip if tip.startswith("<") else html.escape(tip)
    document = QTextDocument()
    document.setDefaultFont(QToolTip.font())
    document.setHtml(inside)
    # Of the document, the frame and the style sheet.
    margins = 24
    width = round(min(document.idealWidth(), WIDTH))
    return f"<table width={width}><tr><td>{inside}</td></tr></table>", width + margins


def _plain(text: str) -> str:
    """Return an entry's text as Qt makes a tooltip of it: without key marks and dots."""
    return text.replace("&", "").partition("\t")[0].rstrip(".…")


T = TypeVar("T")

ARROWS: dict[int, tuple[int, int]] = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, -1),
    Qt.Key.Key_Down: (0, 1),
}
"""Steps of the arrow keys, to the right and down."""


class Painted(Generic[T]):
    """An attribute of a widget whose change repaints the widget, or calls another method."""

    def __init__(self, first: T, then: str = "update") -> None:
        self._first, self._then = first, then

    def __set_name__(self, _owner: type, name: str) -> None:
        self._name = f"_{name}"

    def __get__(self, widget: object, _owner: type | None = None) -> T:
        return cast(T, getattr(widget, self._name, self._first))

    def __set__(self, widget: object, value: T) -> None:
        before = getattr(widget, self._name, self._first)
        if value is not before and value != before:
            setattr(widget, self._name, value)
            getattr(widget, self._then)()


L = TypeVar("L", bound="QBoxLayout")

BY_KEYS = (
    Qt.FocusReason.TabFocusReason,
    Qt.FocusReason.BacktabFocusReason,
    Qt.FocusReason.ShortcutFocusReason,
)
"""Ways in which the keyboard moves the focus."""

MORE = " …"  # end of a text that is cut off


class ElidedLabel(QLabel):
    """A label of one line that shows as many sentences as fit; the tooltip has all of them."""

    full_text = Painted("", "_cut")

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.setTextFormat(Qt.TextFormat.PlainText)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Cut the sentence to the new width."""
        super().resizeEvent(event)
        self._cut()

    def minimumSizeHint(self) -> QSize:
        """Take any width."""
        return QSize(0, super().minimumSizeHint().height())

    def _cut(self) -> None:
        metrics, width = self.fontMetrics(), self.width()
        shown = self.full_text
        while metrics.horizontalAdvance(shown) > width:
            rest, end, _last = shown.removesuffix(MORE).rpartition(". ")
            if not end:
                shown = metrics.elidedText(self.full_text, Qt.TextElideMode.ElideRight, width)
                break
            shown = f"{rest}.{MORE}"
        self.setText(shown)
        self.setToolTip(self.full_text if shown != self.full_text else "")


def announce(widget: QWidget, text: str, at_once: bool = False) -> None:
    """Make a screen reader say a text, at once or after the present one."""
    event = QAccessibleAnnouncementEvent(widget, text)
    politeness = QAccessible.AnnouncementPoliteness
    event.setPoliteness(politeness.Assertive if at_once else politeness.Polite)
    QAccessible.updateAccessibility(event)


_Button = TypeVar("_Button", bound=QAbstractButton)
_Widget = TypeVar("_Widget", bound=QWidget)


def named(widget: _Widget, name: str = "", tip: str = "") -> _Widget:
    """Give a widget its accessible name, or its tooltip, or both; return it."""
    if name:
        widget.setAccessibleName(name)
    if tip:
        widget.setToolTip(tip)
    return widget


def clicked(button: _Button, slot: Callable[[], object]) -> _Button:
    """Connect a button to a function without Qt's `checked` argument; return the button."""
    button.clicked.connect(lambda _checked=False: slot())
    return button


def close_box(dialog: QDialog) -> QDialogButtonBox:
    """Return a dialog's button to close it; the dialog is deleted then."""
    box = QDialogButtonBox(QDialogButtonBox.StandardButton.Close, dialog)
    # Otherwise Enter would press the dialog's first button.
    box.button(QDialogButtonBox.StandardButton.Close).setDefault(True)
    box.rejected.connect(dialog.reject)
    dialog.finished.connect(dialog.deleteLater)
    return box


def answer_box(
    dialog: QDialog, accept: str, reject: str = "Cancel"
) -> tuple[QDialogButtonBox, QPushButton]:
    """Return a dialog's buttons, and the one that Enter presses."""
    box, role = QDialogButtonBox(dialog), QDialogButtonBox.ButtonRole
    button = box.addButton(accept, role.AcceptRole)
    button.setDefault(True)
    box.addButton(reject, role.RejectRole)
    box.rejected.connect(dialog.reject)
    return box, button


def form(*rows: tuple[str, QWidget | QLayout]) -> QFormLayout:
    """Return rows of names and fields."""
    made = QFormLayout(verticalSpacing=8, horizontalSpacing=16)
    for name, field in rows:
        made.addRow(name, field)
    return made


def table(name: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> QTableWidget:
    """Return a read-only table of texts, in which whole rows are selected."""
    made = named(QTableWidget(len(rows), len(columns)), name)
    made.setHorizontalHeaderLabels(columns)
    made.verticalHeader().hide()
    made.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
    made.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    for down, row in enumerate(rows):
        for right, text in enumerate(row):
            item = QTableWidgetItem(text)
            item.setToolTip(text)
            made.setItem(down, right, item)
    return made


def rule(height: int = 20) -> QFrame:
    """Return an upright line between groups of controls."""
    line = QFrame()
    line.setProperty("role", "line")
    line.setFixedSize(1, height)
    return line


def wrapped(lines: Iterable[str]) -> str:
    """Return plain lines as a rich tooltip, which Qt wraps."""
    tip = "<br>".join(html.escape(line).replace("\n", " ") for line in lines if line)
    return f"<qt>{tip}</qt>" if tip else ""


def label(text: str, role: Literal["title", "dim"], wraps: bool = False) -> QLabel:
    """Return a plain label in the style of its role, in one line unless it wraps."""
    made = QLabel(text, textFormat=Qt.TextFormat.PlainText, wordWrap=wraps)
    made.setProperty("role", role)
    return made


class Card(QFrame):
    """A card over the images, or a tag in the plot, that keeps its mouse events to itself."""

    def __init__(self, parent: QWidget | None = None, role: str = "card") -> None:
        super().__init__(parent)
        self.setProperty("role", role)
        self.setAttribute(Qt.WidgetAttribute.WA_NoMousePropagation, role == "tag")
        self.setCursor(Qt.CursorShape.ArrowCursor)


class SearchField(QLineEdit):
    """A field for words to search for."""

    def __init__(self, name: str) -> None:
        super().__init__(placeholderText="Search", clearButtonEnabled=True)
        self.setAccessibleName(name)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keep Enter, which would close the dialog with what was found."""
        super().keyPressEvent(event)
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            event.accept()


def list_box() -> QComboBox:
    """Return an empty combo box; the wheel changes it only while it has the focus."""
    box = QComboBox()
    WheelGuard(box)
    return box


def text_button(
    text: str, tip: str, slot: Callable[[], object] | None = None, role: str = ""
) -> QToolButton:
    """Return a small button that takes no focus, so that keys such as W still reach the window."""
    button = named(QToolButton(), tip=tip)
    button.setText(text)
    if role:
        button.setProperty("role", role)
    if slot is not None:
        clicked(button, slot)
    return button


def fill(
    layout: L,
    *parts: QWidget | QLayout | int,
    margins: tuple[int, int, int, int] = (0, 0, 0, 0),
    spacing: int = 0,
) -> L:
    """Put widgets and layouts into a row or column; numbers are spaces in pixels, 0 a stretch."""
    layout.setContentsMargins(*margins)
    layout.setSpacing(spacing)
    for part in parts:
        if isinstance(part, int):
            layout.addSpacing(part) if part else layout.addStretch()
        elif isinstance(part, QWidget):
            layout.addWidget(part)
        else:
            layout.addLayout(part)
    return layout


def picture_icon(picture: QImage | None, size: int) -> QIcon:
    """Return an icon of a picture, or an empty one while the picture is being drawn."""
    if picture is None or picture.isNull():
        shown = QPixmap(size, size)
        shown.fill(Qt.GlobalColor.black)
        painter = QPainter(shown)
        painter.setPen(QColor(theme.ON_IMAGE.dim))
        text = "drawing …" if painter.fontMetrics().horizontalAdvance("drawing …") < size else "…"
        painter.drawText(shown.rect(), Qt.AlignmentFlag.AlignCenter, text)
        painter.end()
    else:
        how = Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation
        shown = QPixmap.fromImage(picture).scaled(size, size, *how)
    return untinted(shown)


def untinted(picture: QPixmap) -> QIcon:
    """Return an icon that keeps its colours where it is selected."""
    icon = QIcon(picture)
    icon.addPixmap(picture, QIcon.Mode.Selected)
    return icon


def picture_tip(picture: QImage, text: str) -> str:
    """Return a tooltip with a picture, as large as it is, above a text."""
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    picture.save(buffer, "PNG")  # type: ignore[call-overload]
    content = buffer.data().toBase64().toStdString()
    return f"<img src='data:image/png;base64,{content}'><br>{html.escape(text)}"


CLICK_REACH = 4.0  # largest movement of a click, in pixels; a larger one is a drag


class RightClick(QObject):
    """Opens a menu where a widget is clicked with the right button; drags are the widget's own."""

    def __init__(self, widget: QWidget, menu: QMenu) -> None:
        super().__init__(widget)
        self._widget, self._menu = widget, menu
        self._pressed, self._is_click = QPointF(), False
        widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Keep the small movements of a click from the widget, and open the menu at its end."""
        if not isinstance(event, QMouseEvent):
            return False
        position, kind = event.position(), event.type()
        if kind == QEvent.Type.MouseMove:
            moved = (position - self._pressed).manhattanLength()
            self._is_click = self._is_click and moved <= CLICK_REACH
            return self._is_click
        if kind == QEvent.Type.MouseButtonRelease and self._is_click:
            self._widget.customContextMenuRequested.emit(position.toPoint())
            self._menu.popup(event.globalPosition().toPoint())
        self._pressed = position
        pressed = kind == QEvent.Type.MouseButtonPress and event.buttons()
        # Buttons over the widget pass the right one on.
        is_free = self._widget.childAt(position.toPoint()) is None
        self._is_click = pressed == Qt.MouseButton.RightButton and is_free
        return False


def add_action(
    menu: QMenu,
    text: str,
    slot: Callable[[], object],
    keys: QKeySequence.StandardKey | str | None = None,
) -> QAction:
    """Add a menu entry whose slot is called without Qt's `checked` argument."""
    action = menu.addAction(text)
    action.triggered.connect(lambda _checked=False: slot())
    if keys is not None:
        action.setShortcut(QKeySequence(keys))
    return action


def add_switch(menu: QMenu, text: str, tip: str, switch: Callable[[bool], object]) -> QAction:
    """Add a menu entry that the user switches on and off."""
    action = menu.addAction(text)
    action.setCheckable(True)
    action.setToolTip(tip)
    action.triggered.connect(lambda on: switch(on))
    return action


def add_choices(
    menu: QMenu, entries: Mapping[T, tuple[str, str]], choose: Callable[[T], object]
) -> dict[T, QAction]:
    """Add menu entries, each with text and tooltip, of which one is checked."""
    group, actions = QActionGroup(menu), {}
    for value, (text, tip) in entries.items():
        actions[value] = action = add_action(menu, text, partial(choose, value))
        action.setCheckable(True)
        action.setToolTip(tip)
        group.addAction(actions[value])
    return actions


def add_title(menu: QMenu, text: str) -> None:
    """Add a heading above menu entries; the style shows no texts of sections."""
    menu.addAction(text).setEnabled(False)


@dataclass(frozen=True)
class Action:
    """A button of a notice: its label, and what it calls without arguments."""

    label: str
    slot: Callable[[], object]


def action_button(action: Action, before: Callable[[], object]) -> QPushButton:
    """Return a button that removes its notice by calling `before`, and then acts."""

    def act() -> None:
        before()
        action.slot()

    return clicked(QPushButton(action.label, autoDefault=False), act)


def order_focus(widgets: Sequence[QWidget]) -> None:
    """Make Tab go from each widget to the next; skip those of other windows."""
    inside = [widget for widget in widgets if widget.window() is widgets[0].window()]
    for one, other in pairwise(inside):
        QWidget.setTabOrder(one, other)
