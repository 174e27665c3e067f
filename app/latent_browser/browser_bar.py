"""Controls of the latent browser: colours, filters, engines, places, search."""

from __future__ import annotations

import re
from functools import partial

from PySide6.QtCore import Signal
from PySide6.QtGui import QIcon, QPixmap
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QMenu, QToolButton, QWidget

from app.controls import add_action, combo, text_button
from app.image_view.image_canvas import to_qimage
from app.state.latent_state import Coloring, EngineChoice, LatentState
from model.scene.transfer_function import Range

COLORINGS: dict[Coloring, tuple[str, str]] = {
    "value": ("Value", "The scalar value that most is seen of in the picture"),
    "opacity": ("Opacity", "How opaque the picture is on the whole"),
    "modes": ("Modes", "How many peaks the TF has"),
    "distance": ("Distance", "How far the TF's code is from the present TF's"),
    "error": ("Model error", "How far the model's picture is from the ray caster's"),
}

ENGINES: dict[EngineChoice, tuple[str, str]] = {
    "automatic": ("Automatic", "The ray caster where it is fast enough, else the model"),
    "exact": ("Ray caster", "Pictures are exact"),
    "learned": ("Model", "Pictures of the volume's model"),
}


class BrowserBar(QWidget):
    """Controls in one row, and the menus of places and of searches.

    Parameters
    ----------
    latent : LatentState

    Attributes
    ----------
    decoded : QToolButton
        Chooses what a model's pictures are drawn from; below the map, where there is room.
    """

    resetRequested = Signal()
    playRequested = Signal()
    movieRequested = Signal()
    nameRequested = Signal()
    placeRequested = Signal(int)
    renameRequested = Signal(int)
    forgetRequested = Signal(int)
    seekRequested = Signal(str)
    """Emitted with "more", "less", "remember", "picture", "region", "file" or "stop"."""
    problem = Signal(str)
    """Emitted with an error sentence; empty when what was wrong has been mended."""

    def __init__(self, latent: LatentState) -> None:
        super().__init__()
        self._latent = latent
        self._band_before: Range | None = None
        self._refused: str | None = None
        self._draws_codes = False
        self.coloring = combo(dict(COLORINGS.values()), "What the colours mean")
        self.engine = combo(dict(ENGINES.values()), "Who draws the pictures")
        self.codec = combo(
            {
                "Shipped": "The codec that ships with tfscope, for any volume",
                "Model's": "The codec of this volume's model",
            },
            "Whose codes the map shows",
        )
        self.codec.setVisible(False)
        self.band = QLineEdit()
        self.band.setPlaceholderText("90 to 120")
        self.band.setClearButtonEnabled(True)
        self.band.setMaximumWidth(150)
        self.band.setToolTip(
            "Scalar values, such as 90 to 120: TFs whose picture shows none of them fade"
        )
        self.lasso = text_button("Lasso", "Draw around TFs: the others fade. A click ends it.")
        self.lasso.setCheckable(True)
        self.modes = text_button(
            "As modes", "A chosen TF becomes Gaussian modes, instead of a curve"
        )
        self.modes.setCheckable(True)
        self.decoded = text_button(
            "Decoded TFs",
            "The model draws the TFs that codes are decoded to, or the ray caster does,\n"
            "instead of the codes themselves (D)",
        )
        self.decoded.setCheckable(True)
        self.decoded.setVisible(False)
        self.places = text_button("Places", "Named places, and the path between them")
        self.search = text_button("Find", "Search for a TF by what its picture shall show")
        self.reset = text_button("Whole map", "Show the whole map (Home)")
        for box, least in ((self.coloring, 66), (self.codec, 84), (self.engine, 92)):
            # Narrower than its longest entry where the window is small.
            box.setMinimumWidth(least)
        self.band.setMinimumWidth(96)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(6)
        for widget in (
            self.coloring, self.band, self.lasso, self.places, self.search, self.modes,
            self.codec, self.engine, self.reset,
        ):  # fmt: skip
            row.addWidget(widget)
        row.addStretch()
        self.places.setMenu(QMenu(self.places))
        self.search.setMenu(QMenu(self.search))
        for button in (self.places, self.search):
            button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._connect()
        self._show_choices()
        self.fill_places()

    def set_model(self, fits: bool, draws_codes: bool = False) -> None:
        """Offer what only a model has, if one fits the volume, and one that draws codes."""
        self.codec.setVisible(fits)
        self._draws_codes = draws_codes
        self._show_choices()
        self.engine.setEnabled(fits)

    def show_search(self, running: bool, remembered: bool, region: str) -> None:
        """Fill the menu of searches.

        Parameters
        ----------
        running : bool
            Whether one is running.
        remembered : bool
            Whether a picture is remembered as a goal.
        region : str
            Name of the region that is drawn in the image.
        """
        menu = self.search.menu()
        menu.clear()
        if running:
            add_action(menu, "Stop the search", partial(self.seekRequested.emit, "stop"))
            return
        add_action(menu, f"More in: {region}", partial(self.seekRequested.emit, "more"))
        add_action(menu, f"Less in: {region}", partial(self.seekRequested.emit, "less"))
        menu.addSeparator()
        add_action(
            menu, "Remember this picture as a goal", partial(self.seekRequested.emit, "remember")
        )
        for text, kind in (
            ("Like the remembered picture", "picture"),
            (f"{region}, as in the remembered picture", "region"),
        ):
            action = add_action(menu, text, partial(self.seekRequested.emit, kind))
            action.setEnabled(remembered)
        add_action(menu, "Like a picture file…", partial(self.seekRequested.emit, "file"))

    def fill_places(self) -> None:
        """Fill the menu of places."""
        menu = self.places.menu()
        for action in menu.actions():
            if isinstance(before := action.menu(), QMenu):
                before.deleteLater()
        menu.clear()
        named = self._latent.places
        add_action(menu, "Name the present TF's place…", self.nameRequested.emit)
        menu.addSeparator()
        for index, place in enumerate(named):
            sub = menu.addMenu(place.name)
            add_action(sub, "Make it the TF", partial(self.placeRequested.emit, index))
            add_action(sub, "Rename…", partial(self.renameRequested.emit, index))
            add_action(sub, "Forget it", partial(self.forgetRequested.emit, index))
            if place.picture is not None:
                sub.setIcon(QIcon(QPixmap.fromImage(to_qimage(place.picture))))
        if named:
            menu.addSeparator()
        play = add_action(menu, "Play the path", self.playRequested.emit)
        movie = add_action(menu, "Save the path as a movie…", self.movieRequested.emit)
        for action in (play, movie):
            action.setEnabled(bool(named))
        menu.addSeparator()
        add_action(menu, "Clear the trail", self._latent.clear_trail)

    def _connect(self) -> None:
        latent = self._latent
        self.coloring.activated.connect(lambda i: latent.choose(coloring=list(COLORINGS)[i]))
        self.engine.activated.connect(lambda i: latent.choose(engine=list(ENGINES)[i]))
        self.codec.activated.connect(lambda i: latent.choose(codec=("shipped", "model")[i]))
        self.band.editingFinished.connect(self._read_band)
        self.band.textChanged.connect(lambda text: None if text else self._read_band())
        self.lasso.clicked.connect(self._toggle_lasso)
        self.decoded.clicked.connect(lambda on: latent.choose(drawn="tf" if on else "code"))
        self.modes.clicked.connect(lambda on: latent.choose(as_modes=on))
        self.reset.clicked.connect(self.resetRequested)
        latent.choicesChanged.connect(lambda _choices: self._show_choices())
        latent.toolChanged.connect(lambda _tool: self._show_lasso())
        latent.lassoChanged.connect(lambda _lasso: self._show_lasso())
        latent.placesChanged.connect(self.fill_places)

    def _toggle_lasso(self, on: bool) -> None:
        if not on:
            self._latent.set_lasso(None)
        self._latent.set_tool("lasso" if on else "brush")
        self._show_lasso()

    def _show_lasso(self) -> None:
        self.lasso.setChecked(self._latent.tool == "lasso" or self._latent.lasso is not None)

    def _show_choices(self) -> None:
        choices = self._latent.choices
        self.coloring.setCurrentIndex(list(COLORINGS).index(choices.coloring))
        self.engine.setCurrentIndex(list(ENGINES).index(choices.engine))
        self.codec.setCurrentIndex(("shipped", "model").index(choices.codec))
        self.modes.setChecked(choices.as_modes)
        self.decoded.setChecked(choices.drawn == "tf")
        self.decoded.setVisible(self._draws_codes and choices.codec == "model")
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
