"""Controls of the latent browser: map, filter and codec."""

from __future__ import annotations

import re
from functools import partial

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QAction, QActionGroup, QKeySequence, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QMenu, QPushButton, QToolButton, QWidget

from app.controls import add_action
from app.icons import IconButton, icon
from app.menu_tips import show_tips
from app.state.latent_state import CodecChoice, LatentState
from model.scene.transfer_function import Range

CODECS: dict[CodecChoice, tuple[str, str]] = {
    "shipped": ("Shipped codec", "The codec that ships with tfscope, for any volume"),
    "model": ("Model's codec", "The codec of this volume's model"),
}

HEIGHT = 36
BAND_WIDTH = 84, 150
"""Least and greatest width of the field of values, in pixels."""


class BrowserBar(QWidget):
    """Controls in one row: map or pictures, filter, codec, and the end of the map's computation."""

    resetRequested = Signal()
    problem = Signal(str)
    """Emitted with an error sentence; empty when what was wrong has been mended."""

    def __init__(self, latent: LatentState) -> None:
        super().__init__()
        self._latent = latent
        self._band_before: Range | None = None
        self._refused: str | None = None
        self.setFixedHeight(HEIGHT)
        self._codecs: dict[CodecChoice, QAction] = {}
        self.map = IconButton(
            "browse",
            "Map",
            tip="The map of all TFs, and a picture of each of its cells",
            text="Map",
        )
        self.map.setCheckable(True)
        self.band = QLineEdit()
        self.band.setPlaceholderText("90 to 120")
        self.band.setClearButtonEnabled(True)
        self.band.setAccessibleName("Shows values")
        self.band.setToolTip(
            "Type scalar values, such as 90 to 120 (Ctrl+F). Pictures that show none of them fade."
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
        self.more = IconButton("more", "Codec")
        self.more.setMenu(QMenu(self.more))
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._add_codecs(self.more.menu())
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 0, 8, 0)
        row.setSpacing(4)
        left: list[QWidget] = [self.map, self.band, self.reset]
        right: list[QWidget] = [self.stop, self.more]
        for widget in left:
            row.addWidget(widget)
        row.addStretch(1)
        for widget in right:
            row.addWidget(widget)
        self.stop.hide()
        self.more.hide()
        self._connect()
        self._show_choices()

    def changeEvent(self, event: QEvent) -> None:
        """Draw the field's icon anew in another theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self._eye.setIcon(icon("eye"))
        super().changeEvent(event)

    def _add_codecs(self, menu: QMenu) -> None:
        show_tips(menu)
        group = QActionGroup(menu)
        for codec, (text, explanation) in CODECS.items():
            action = add_action(menu, text, partial(self._latent.choose, codec=codec))
            action.setToolTip(explanation)
            action.setCheckable(True)
            group.addAction(action)
            self._codecs[codec] = action

    def set_model(self, fits: bool) -> None:
        """Offer the codec of a model, if one fits the volume."""
        self.more.setVisible(fits)

    def _connect(self) -> None:
        latent = self._latent
        self.band.editingFinished.connect(self._read_band)
        self.band.textChanged.connect(lambda text: None if text else self._read_band())
        self.map.clicked.connect(lambda on: latent.choose(on_map=on))
        self.reset.clicked.connect(self.resetRequested)
        latent.choicesChanged.connect(lambda _choices: self._show_choices())

    def _show_choices(self) -> None:
        choices = self._latent.choices
        self._codecs[choices.codec].setChecked(True)
        self.map.setChecked(choices.on_map)
        self.reset.setVisible(choices.on_map)
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

    Anything else raises ValueError.
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
