"""A line that names the scalar values which are visible in the active region."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QWidget

from app.sensitivity_view.response_layer import VISIBLE
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from model.scene.value_text import range_text
from model.sensitivity.contributions import contributions

JOINED = "\N{NO-BREAK SPACE}"
"""Between a value and its share, which stay in one line."""


class VisibleLabel(QLabel):
    """Says of which values the active region, or the whole image, consists.

    Parameters
    ----------
    state : SensitivityState
    dispatcher : SensitivityDispatcher
    """

    def __init__(
        self,
        state: SensitivityState,
        dispatcher: SensitivityDispatcher,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._dispatcher = dispatcher
        self.setProperty("role", "dim")
        self.setTextFormat(Qt.TextFormat.RichText)
        self.setWordWrap(True)
        self.setToolTip(
            "The values that the region shows, each with its share of what is visible there: the "
            "green line over the TF. The green area is that of the whole image.\n"
            "Values lists them, to raise or lower them, or to show one alone"
        )
        dispatcher.visibilityAnswered.connect(self.refresh)
        state.regionsChanged.connect(self.refresh)
        for changed in (state.choicesChanged, state.placeChanged):
            changed.connect(lambda _value: self.refresh())
        self.refresh()

    def refresh(self) -> None:
        """Name the values; nothing while they are not known, or those of a click are listed."""
        answer, outline = self._dispatcher.visibility, self._state.outline
        if answer is None or not self._state.choices.shown or self._state.place is not None:
            self.setText("")
            return
        if answer.request.regions[0] != outline:
            # Another region's answer is on its way.
            return
        opacity = answer.request.inputs.opacity_tf
        scalar_range = opacity.scalar_range
        found = contributions(answer.value[0], scalar_range)
        values = ", ".join(
            f"{text} ({100 * each.share:.0f} %)".replace(" ", JOINED)
            for each in found
            for text in [range_text(each.reach, scalar_range, opacity.scale)]
        )
        text = f"visible: {values}" if found else "visible: nothing, it is black"
        self.setText(f"<span style='color:{VISIBLE}'>■</span> {text}")
