"""The menu of how fields are drawn over the images."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QMenu, QWidget

from app.controls import add_action, add_title
from app.menu_tips import show_tips
from app.state.sensitivity_state import SensitivityState

Entries = dict[str, tuple[dict[str, Any], str]]

STYLES: Entries = {
    "Area": ({"style": "map"}, "The change of each pixel, in colours"),
    "Contours": ({"style": "contours"}, "The change of each pixel, as contours"),
    "8 × 8 blocks": (
        {"style": "blocks", "blocks": 8},
        "The change of the norm of 8 × 8 blocks, as in the paper: of all values at once",
    ),
    "16 × 16 blocks": (
        {"style": "blocks", "blocks": 16},
        "The change of the norm of 16 × 16 blocks, as in the paper",
    ),
    "Blocks of one pixel": (
        {"style": "blocks", "blocks": 0},
        "The change of the norm of each pixel: takes longest",
    ),
}
"""Ways to draw a field, with their choices and explanations."""

SCALES: Entries = {
    "Own scale": ({"locked": False, "scale": "own"}, "Colours end at what this value changes most"),
    "Scale of all values": (
        {"locked": False, "scale": "all"},
        "Colours end at what any value of interest changes most, as in the paper: they say how "
        "strong this value is among all, and fade where it changes little",
    ),
    "Lock scale": (
        {"locked": True},
        "Colours end where they do now, and so does the curve's scale: to compare",
    ),
}
"""Ends of the colours' scale, with their choices and explanations."""

DOUBT = "Fade where model and exact disagree"
DOUBT_TIP = "Where the model's effect differs from the exact one, its colours turn grey"


class FieldMenu(QMenu):
    """Chooses how the field of the value under the mouse is drawn, and where its colours end."""

    def __init__(self, sensitivity: SensitivityState, parent: QWidget) -> None:
        super().__init__("Over the images", parent)
        self._sensitivity = sensitivity
        show_tips(self)
        self._choices = [
            (self._add_group(title, entries), entries)
            for title, entries in (("Drawn as", STYLES), ("Colours end at", SCALES))
        ]
        self.addSeparator()
        self.doubt = self.addAction(DOUBT)
        self.doubt.setCheckable(True)
        self.doubt.setToolTip(DOUBT_TIP)
        self.doubt.toggled.connect(lambda on: sensitivity.choose(fade=on))
        self.aboutToShow.connect(self._show_choices)

    def _add_group(self, title: str, entries: Entries) -> QActionGroup:
        add_title(self, title)
        group = QActionGroup(self)
        for name, (changes, explanation) in entries.items():
            action = add_action(self, name, partial(self._sensitivity.choose, **changes))
            action.setCheckable(True)
            action.setToolTip(explanation)
            group.addAction(action)
        return group

    def _show_choices(self) -> None:
        choices = self._sensitivity.choices
        for group, entries in self._choices:
            chosen = [
                action
                for action, (changes, _) in zip(group.actions(), entries.values(), strict=True)
                if replace(choices, **changes) == choices
            ]
            if chosen:
                chosen[0].setChecked(True)
        self.doubt.setChecked(choices.fade)
