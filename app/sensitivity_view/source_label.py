"""A line that names the sources of what is shown, and how far learned and exact ones agree."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel

from app import theme
from app.glosses import explain, gloss, without_links
from app.state.workspace import Workspace
from model.sensitivity.display import Agreement

GOOD, FAIR = 0.9, 0.7  # least cosine of good and of fair agreement
NOTABLE = 2.0  # factor between learned and exact responses from which it is said


class SourceLabel(QLabel):
    """Names the engines behind what is shown, with the colours of their curves."""

    def __init__(self, workspace: Workspace) -> None:
        super().__init__()
        self._workspace, self._asker = workspace, workspace.sensitivity
        self._hint = ""
        self.setProperty("role", "dim")
        self.setTextFormat(Qt.TextFormat.RichText)
        self.setWordWrap(True)
        explain(self)
        # By Tab, too; Enter opens the glossary.
        flags = Qt.TextInteractionFlag
        self.setTextInteractionFlags(flags.LinksAccessibleByMouse | flags.LinksAccessibleByKeyboard)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.refresh()

    @property
    def said(self) -> str:
        """Text of the line as it is read."""
        return without_links(self.text())

    def set_hint(self, hint: str) -> None:
        """Say whether inputs are outside what the model was trained on."""
        self._hint = hint
        self.refresh()

    def refresh(self) -> None:
        """Name the sources, and how far learned and exact ones agree."""
        asker, choices = self._asker, self._asker.asked.choices
        text = ""
        if choices.shown and asker.problem:
            text = _warning(asker.problem)
        elif choices.shown and choices.engine == "learned" and asker.learned_size is None:
            text = "no model of this volume: open one, or choose Exact"
        elif choices.shown:
            text = self._source_text()
        if text != self.text():
            self.setText(text)

    def _source_text(self) -> str:
        asker = self._asker
        exact, parts = asker.exact_source, []
        name = gloss("Exact" if exact == "exact" else "Surrogate")
        if exact in asker.regions:
            parts.append(f"<span style='color:{theme.CHANGE}'>━</span> {name}")
        if "learned" in asker.regions:
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
            if "exact" in asker.order("region") and exact not in asker.regions:
                parts.append(f"{name} …")
            if self._hint:
                parts.append(_warning("outside what it was trained on"))
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
        asker, asked = self._asker, self._asker.asked
        if asked.choices.engine == "exact":
            return ""
        if self._hint and asker.learned_size is None:
            is_there = self._workspace.model.scene is not None
            return f"{gloss('Learned')}: {'not for this range' if is_there else 'loading …'}"
        if asker.learned_size and not asked.outline.is_in_square:
            return f"{gloss('Learned')}: outside the model's image"
        return ""


def _warning(text: str) -> str:
    return f"<span style='color:{theme.WARNING}'>{text}</span>"


def _trust_word(cosine: float) -> str:
    return "good" if cosine >= GOOD else "fair" if cosine >= FAIR else "poor"
