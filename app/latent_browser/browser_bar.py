"""Controls of the latent browser: map, colours, filter and codec."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QAction, QActionGroup, QKeySequence, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QMenu, QPushButton, QToolButton, QWidget

from app.caption_button import CaptionButton
from app.controls import add_action
from app.icons import IconButton, icon
from app.latent_browser.map_colors import lookup_table
from app.menu_tips import show_tips
from app.state.latent_state import CodecChoice, Coloring, LatentState
from model.scene.transfer_function import Range

COLORINGS: dict[Coloring, tuple[str, str]] = {
    "value": ("Value", "The scalar value that most is seen of in the picture"),
    "opacity": ("Opacity", "How opaque the picture is on the whole"),
    "modes": ("Modes", "How many peaks the TF has"),
    "distance": ("Distance", "How far the TF's code is from the present TF's"),
}

CODECS: dict[CodecChoice, tuple[str, str]] = {
    "shipped": ("Shipped", "The codec that ships with tfscope, for any volume"),
    "model": ("Model's", "The codec of this volume's model"),
}

HEIGHT = 36
BAND_WIDTH = 84, 150
"""Least and greatest width of the field of values, in pixels."""


class BrowserBar(QWidget):
    """Controls in one row, and the menu of what is chosen rarely.

    Attributes
    ----------
    map : IconButton
        Shows the map, or the TFs that differ most again.
    coloring : CaptionButton
        Says what the map's colours mean; its menu has other meanings.
    modes : QAction
        Whether a chosen TF becomes modes.
    stop : QPushButton
        Ends the computation of the map, while it runs.
    """

    resetRequested = Signal()
    problem = Signal(str)
    """Emitted with an error sentence; empty when what was wrong has been mended."""

    def __init__(self, latent: LatentState) -> None:
        super().__init__()
        self._latent = latent
        self._band_before: Range | None = None
        self._refused: str | None = None
        self.setFixedHeight(HEIGHT)
        self._actions: dict[str, dict[Any, QAction]] = {}
        self.map = IconButton(
            "browse",
            "Map",
            tip="The map of all TFs, and a picture of each of its cells",
            text="Map",
        )
        self.map.setCheckable(True)
        self.coloring = CaptionButton()
        self.coloring.set_swatch(lookup_table())
        self.coloring.setToolTip("What the colours mean")
        self._add_choices(self.coloring.add_menu(), "coloring", COLORINGS)
        self.band = QLineEdit()
        self.band.setPlaceholderText("90 to 120")
        self.band.setClearButtonEnabled(True)
        self.band.setAccessibleName("Shows values")
        self.band.setToolTip(
            "Scalar values, such as 90 to 120 (Ctrl+F): TFs whose picture shows none of them fade"
        )
        self.band.setMinimumWidth(BAND_WIDTH[0])
        self.band.setMaximumWidth(BAND_WIDTH[1])
        self._eye = self.band.addAction(icon("eye"), QLineEdit.ActionPosition.LeadingPosition)
        find_values = QShortcut(QKeySequence("Ctrl+F"), self)
        find_values.activated.connect(self.band.setFocus)
        self.reset = IconButton("home", "Whole map", "Home")
        self.stop = QPushButton("Stop")
        self.stop.setToolTip("Stop the computation of the map (Escape)")
        self.stop.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.more = IconButton("more", "More")
        self.more.setMenu(QMenu(self.more))
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._fill_more(self.more.menu())
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 0, 8, 0)
        row.setSpacing(4)
        left: list[QWidget] = [self.map, self.coloring, self.band, self.reset]
        right: list[QWidget] = [self.stop, self.more]
        for widget in left:
            row.addWidget(widget)
        row.addStretch(1)
        for widget in right:
            row.addWidget(widget)
        self.stop.hide()
        self._connect()
        self._show_choices()

    def changeEvent(self, event: QEvent) -> None:
        """Draw the field's icon anew in another theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self._eye.setIcon(icon("eye"))
        super().changeEvent(event)

    def _fill_more(self, menu: QMenu) -> None:
        show_tips(menu)
        self.modes = menu.addAction("Take as modes")
        self.modes.setToolTip("A chosen TF becomes Gaussian modes, instead of a curve")
        self.modes.setCheckable(True)
        self.codec = menu.addMenu("Codec")
        self._add_choices(self.codec, "codec", CODECS)

    def _add_choices(self, menu: QMenu, name: str, choices: dict[Any, tuple[str, str]]) -> None:
        """Add exclusive choices, each with its explanation."""
        show_tips(menu)
        group = QActionGroup(menu)
        for choice, (text, explanation) in choices.items():
            action = add_action(menu, text, partial(self._choose, name, choice))
            action.setToolTip(explanation)
            action.setCheckable(True)
            group.addAction(action)
            self._actions.setdefault(name, {})[choice] = action

    def _choose(self, name: str, choice: Any) -> None:
        self._latent.choose(**{name: choice})

    def explain_colors(self, meaning: str) -> None:
        """Say what the map's colours mean, with the unit."""
        self.coloring.setToolTip(f"Colour by: {meaning}")

    def set_model(self, fits: bool) -> None:
        """Offer what only a model has, if one fits the volume."""
        self.codec.menuAction().setVisible(fits)

    def _connect(self) -> None:
        latent = self._latent
        self.band.editingFinished.connect(self._read_band)
        self.band.textChanged.connect(lambda text: None if text else self._read_band())
        self.map.clicked.connect(lambda on: latent.choose(on_map=on))
        self.modes.triggered.connect(lambda on: latent.choose(as_modes=on))
        self.reset.clicked.connect(self.resetRequested)
        latent.choicesChanged.connect(lambda _choices: self._show_choices())

    def _show_choices(self) -> None:
        choices = self._latent.choices
        for name, actions in self._actions.items():
            actions[getattr(choices, name)].setChecked(True)
        self.map.setChecked(choices.on_map)
        for widget in (self.coloring, self.reset):
            widget.setVisible(choices.on_map)
        self.coloring.set_title(COLORINGS[choices.coloring][0])
        self.coloring.setAccessibleName(f"Colour by: {self.coloring.title}")
        self.modes.setChecked(choices.as_modes)
        if choices.band is None and self._band_before is not None:
            self.band.clear()
        self._band_before = choices.band

    def _read_band(self) -> None:
        text = self.band.text().strip()
        if text == self._refused:
            return
        self._refused = None
        try:
            band = parsed_band(text)
        except ValueError:
            self._refused = text
            self.problem.emit(
                f"'{text}' is not a range of scalar values; write two numbers, such as 90 to 120."
            )
            return
        self.problem.emit("")
        self._latent.choose(band=band)


def parsed_band(text: str) -> Range | None:
    """Read a value, or two with "to", a comma or a dash between them; None for nothing.

    Raises
    ------
    ValueError
        When the text is something else.
    """
    if not text:
        return None
    number = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
    found = re.fullmatch(rf"({number})(?:\s*(?:to|,|–|-|\.\.)\s*({number}))?", text)
    if found is None:
        raise ValueError(text)
    low = float(found[1])
    high = low if found[2] is None else float(found[2])
    return min(low, high), max(low, high)
