"""The dialog with rarely changed settings; a field filters them by words."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, get_args

from PySide6.QtCore import QObject
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QDialog,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.controls import SearchField, clicked, close_box, fill, form, label, list_box, named
from app.image_view.reference_controls import DRAWINGS, SIZES
from app.state.settings import RecentKind, ThemeChoice
from app.theme import apply_theme
from app.window.context import Context
from app.window.overlays import Overlays

THEMES: dict[ThemeChoice, str] = {"system": "As the system", "dark": "Dark", "light": "Light"}

WIDTH = 680  # of the dialog, in pixels

OTHERS = (
    "light and brightness at the top right",
    "speed and accuracy by the slider from fast to exact",
    "transfer function presets and colour maps below the images",
    "range, axis and logarithmic scale in the menu ⋯ below the images",
)
"""Settings that are elsewhere, and where."""

MOST_OTHERS = 4  # number of those named at once


class SettingsDialog(QDialog):
    """Shows the settings in groups; each applies at once."""

    def __init__(
        self, context: Context, overlays: Overlays, actions: Sequence[QAction] = ()
    ) -> None:
        super().__init__(context.window)
        self.setWindowTitle("Settings")
        self._context, self._overlays = context, overlays
        self._elsewhere = [*OTHERS, *_paths(actions)]
        self.search = SearchField("Search settings")
        self.search.textChanged.connect(self._filter)
        self._form = form()
        self._rows: list[tuple[QWidget, str, QLabel]] = []
        self._others = label("", "dim", wraps=True)
        for title, settings in self._groups().items():
            group = label(title, "title")
            self._form.addRow(group)
            for name, control, explanation in settings:
                self._add(group, name, control, explanation)
        names = [self._form.labelForField(row) for row, _, _ in self._rows]
        for each in names:
            # The rows that are left do not move to the side.
            each.setMinimumWidth(max(name.sizeHint().width() for name in names))
        parts = self.search, self._others, self._form, 0, close_box(self)
        fill(QVBoxLayout(self), *parts, margins=(16, 14, 16, 14), spacing=12)
        self._filter("")
        # Hidden rows leave their room, so that the field does not move.
        self.setFixedSize(WIDTH, self.sizeHint().height())

    def _groups(self) -> dict[str, list[tuple[str, QWidget, str]]]:
        """Return name, control and explanation of all settings, by title of their group."""
        work, settings = self._context.workspace.reference, self._context.preferences.settings
        renderer = _list(DRAWINGS, work.choices.drawing, lambda name: work.choose(drawing=name))
        present = work.choices.reference_size
        size = _list(SIZES, present, lambda size: work.choose(reference_size=size))
        cube = _switch(settings.cube, lambda _on: self._overlays.toggle("cube"))
        forget = clicked(QPushButton("Forget them"), lambda: self._forget(forget))
        return {
            "Ground truth": [
                (
                    "Renderer", renderer,
                    "The images of VTK and of the ray caster differ by an RMSE of .001 to .005.",
                ),
                ("Image size", size, "Pixels of the image at rest. Larger images take longer."),
            ],
            "Window": [
                (
                    "Orientation cube", cube,
                    "Shows from which side you look. Click a face to look from there.",
                ),
                (
                    "Theme", _list(THEMES, settings.theme, self._choose_theme),
                    "Dark or light colours.",
                ),
                (
                    "Single-key shortcuts", _switch(settings.single_keys, self._choose_single_keys),
                    "Letters without Ctrl are shortcuts: R draws a rectangle, for example.",
                ),
                ("Recent files", forget, "Empties the menus of recent files."),
            ],
        }  # fmt: skip

    def _add(self, group: QLabel, name: str, control: QWidget, explanation: str) -> None:
        control.setAccessibleName(name)
        below, row = label(explanation, "dim", wraps=True), named(QWidget(), name)
        fill(QVBoxLayout(row), control, below, spacing=2)
        self._form.addRow(name, row)
        texts = [group.text(), name, explanation]
        if isinstance(control, QComboBox):
            texts += [control.itemText(index) for index in range(control.count())]
        self._rows.append((row, " ".join(texts).lower(), group))

    def _filter(self, text: str) -> None:
        """Show the rows and titles that have all of some words; name settings elsewhere."""
        words = text.lower().split()
        shown: set[QLabel] = set()
        for row, texts, group in self._rows:
            fits = all(word in texts for word in words)
            self._form.setRowVisible(row, fits)
            shown |= {group} if fits else set()
        for _, _, group in self._rows:
            self._form.setRowVisible(group, group in shown)
        others = [each for each in self._elsewhere if all(word in each.lower() for word in words)]
        said = f"Elsewhere in the window: {', '.join(others[:MOST_OTHERS])}."
        nothing = "" if shown else "No setting has these words."
        self._others.setText(said if words and others else nothing)
        self._others.setVisible(bool(self._others.text()))

    def _forget(self, button: QPushButton) -> None:
        self._context.preferences.set(**{f"recent_{kind}": () for kind in get_args(RecentKind)})
        button.setEnabled(False)

    def _choose_theme(self, theme: ThemeChoice) -> None:
        self._context.preferences.set(theme=theme)
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        apply_theme(application, theme)

    def _choose_single_keys(self, are_on: bool) -> None:
        self._context.preferences.set(single_keys=are_on)
        apply_single_keys(self._context.window, are_on)


def apply_single_keys(window: QObject, are_on: bool) -> None:
    """Enable or disable a window's shortcuts that are single letters."""
    for action in window.findChildren(QAction):
        # The keys that the action was created with.
        keys = action.property("keys") or [key.toString() for key in action.shortcuts()]
        if any(len(key) == 1 for key in keys):
            action.setProperty("keys", keys)
            action.setShortcuts([QKeySequence(key) for key in keys if are_on or len(key) > 1])


def _paths(actions: Sequence[QAction], before: str = "") -> Iterator[str]:
    """Yield the entries of menus as "View > Zoom to fit"."""
    for action in actions:
        path = before + action.text().replace("&", "").rstrip("…")
        menu = action.menu()
        if menu is not None:
            yield from _paths(menu.actions(), f"{path} > ")  # type: ignore[attr-defined]
        elif before and action.text() and action.isVisible():
            yield path


def _list(texts: Mapping[Any, str], present: object, choose: Callable[[Any], object]) -> QComboBox:
    box, choices = list_box(), list(texts)
    box.addItems([*texts.values()])
    box.setCurrentIndex(choices.index(present) if present in choices else -1)
    box.activated.connect(lambda row: choose(choices[row]))
    return box


def _switch(is_on: bool, choose: Callable[[bool], Any]) -> QCheckBox:
    box = QCheckBox("On")
    box.setChecked(is_on)
    box.toggled.connect(choose)
    return box
