"""A line that names the sources of what is shown, and how far learned and exact ones agree."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QLabel, QWidget

from app import theme
from app.glosses import explain, gloss, without_links
from app.state.sensitivity_answers import Source
from app.state.sensitivity_asker import SensitivityAsker
from app.state.sensitivity_state import SensitivityState
from app.state.workspace import Workspace
from model.sensitivity.cosine import Agreement

GLOSSES: dict[Source, str] = {
    "exact": "Exact",
    "stand-in": "Surrogate",
    "learned": "Learned",
}
"""Terms of the glossary for the sources."""

GOOD, FAIR = 0.9, 0.7
"""Least cosine of good and of fair agreement."""

NOTABLE = 2.0
"""Factor between learned and exact responses from which it is said."""


class SourceLabel(QLabel):
    """Names the engines behind what is shown, with the colours of their curves."""

    saidChanged = Signal(str)

    def __init__(
        self,
        state: SensitivityState,
        asker: SensitivityAsker,
        workspace: Workspace,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._asker = asker
        self._workspace = workspace
        self._hint = ""
        self.setProperty("role", "dim")
        self.setTextFormat(Qt.TextFormat.RichText)
        self.setWordWrap(True)
        explain(self)
        # By Tab, too; Enter opens the glossary.
        flags = Qt.TextInteractionFlag
        self.setTextInteractionFlags(flags.LinksAccessibleByMouse | flags.LinksAccessibleByKeyboard)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        for signal in (asker.regionAnswered, asker.fieldAnswered):
            signal.connect(self.refresh)
        state.choicesChanged.connect(lambda _choices: self.refresh())
        workspace.hintChanged.connect(self._take_hint)
        workspace.modelChanged.connect(self.refresh)
        self.refresh()

    @property
    def said(self) -> str:
        """Text of the line as it is read."""
        return without_links(self.text())

    def _take_hint(self, hint: str) -> None:
        self._hint = hint
        self.refresh()

    def refresh(self) -> None:
        """Name the sources, and how far learned and exact ones agree."""
        asker, choices = self._asker, self._state.choices
        if not choices.shown:
            text = ""
        elif choices.engine == "learned" and asker.learned_size is None:
            text = "no model of this volume: open one, or choose Exact"
        else:
            text = self._source_text()
        if asker.problem and choices.shown:
            text = f"<span style='color:{theme.WARNING}'>{asker.problem}</span>"
        self.setText(text)
        self.saidChanged.emit(self.said)

    def _source_text(self) -> str:
        asker = self._asker
        exact, learned = asker.exact_source, "learned"
        parts = []
        if exact in asker.regions:
            parts.append(f"<span style='color:{theme.CHANGE}'>━</span> {gloss(GLOSSES[exact])}")
        if learned in asker.regions:
            parts.append(f"<span style='color:{theme.CHANGE}'>╍</span> {gloss('Learned')}")
            agreement = asker.region_agreement
            if agreement is not None:
                parts.append(self._agreement_text(agreement))
            elif exact not in asker.regions and not self._hint:
                recorded = self._workspace.model.recorded_agreement
                parts.append(
                    "agreement not measured"
                    if recorded is None
                    else f"{gloss('Cosine')} on its test images {recorded:.2f}, "
                    f"{_trust_word(recorded)}"
                )
            wanted = asker.order("region")
            if "exact" in wanted and exact not in asker.regions:
                parts.append(f"{gloss(GLOSSES[exact])} …")
            if self._hint:
                color = theme.WARNING
                parts.append(f"<span style='color:{color}'>outside what it was trained on</span>")
        elif missing := self._missing_learned():
            parts.append(missing)
        return " &nbsp; ".join(parts)

    def _agreement_text(self, found: Agreement) -> str:
        words = [f"{gloss('Cosine')} {found.cosine:.2f}"]
        if not 1 / NOTABLE < found.strength < NOTABLE:
            words.append(f"{found.strength:.1f} times as strong")
        elif not self._hint:
            # Where the model knows nothing, a shape that happens to agree is no good.
            words.append(_trust_word(found.cosine))
        return ", ".join(words)

    def _missing_learned(self) -> str:
        """Say why a model of this volume gives no answer; empty if it does, or need not."""
        if self._state.choices.engine == "exact":
            return ""
        if self._hint and self._asker.learned_size is None:
            return f"{gloss('Learned')}: not for this range"
        if self._asker.learned_size and not self._state.outline.is_in_square:
            return f"{gloss('Learned')}: outside the model's image"
        return ""


def _trust_word(cosine: float) -> str:
    """Return the word for a cosine of learned and exact sensitivities."""
    return "good" if cosine >= GOOD else "fair" if cosine >= FAIR else "poor"
