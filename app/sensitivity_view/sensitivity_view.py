"""The sensitivity view: regions and fields over both images, responses over the TF editor."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from app.image_view.engine_pane import EnginePane
from app.sensitivity_view.choice_bar import ChoiceBar
from app.sensitivity_view.field_cover import FieldCover
from app.sensitivity_view.findings_panel import FindingsPanel
from app.sensitivity_view.measured_edits import MeasuredEdits
from app.sensitivity_view.region_layer import RegionLayer
from app.sensitivity_view.response_layer import ResponseLayer
from app.sensitivity_view.source_label import SourceLabel
from app.sensitivity_view.visible_label import VisibleLabel
from app.state.sensitivity_answers import Answer, Source, WhatIfAnswer
from app.state.sensitivity_export import shown_result
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.tf_editor.editor import TransferFunctionEditor
from model.sensitivity.result import SensitivityResult


class SensitivityView(QObject):
    """Puts the sensitivity's widgets into the panes and into the TF editor.

    The reference pane shows exact fields, the generator's learned ones; where there is only
    one of the two, both show it.

    Parameters
    ----------
    state : ViewerState
    sensitivity : SensitivityState
    workspace : Workspace
    generator, reference : EnginePane
    editor : TransferFunctionEditor
    parent : QObject
    """

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        workspace: Workspace,
        generator: EnginePane,
        reference: EnginePane,
        editor: TransferFunctionEditor,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._workspace = workspace
        self._dispatcher = dispatcher = workspace.sensitivity
        self.regions = [RegionLayer(pane.canvas, sensitivity) for pane in (generator, reference)]
        self.exact = FieldCover(
            reference, state, sensitivity, dispatcher, lambda: self._field("exact")
        )
        self.learned = FieldCover(
            generator, state, sensitivity, dispatcher, lambda: self._field("learned")
        )
        self.responses = ResponseLayer(editor.area, state, sensitivity, dispatcher)
        self.bar = ChoiceBar(sensitivity)
        self.source = SourceLabel(sensitivity, dispatcher, workspace)
        self.visible = VisibleLabel(sensitivity, dispatcher)
        self.measured = MeasuredEdits(state, sensitivity, dispatcher, self.responses, self)
        self.findings = FindingsPanel(
            state,
            sensitivity,
            dispatcher,
            self.responses,
            self.measured,
            self._shown_colors,
            self.source,
            self.visible,
        )
        editor.add_to_header(self.bar)
        editor.add_beside(self.findings)
        sensitivity.choicesChanged.connect(lambda choices: self.findings.setVisible(choices.shown))
        # What the edit would do to another image is another question.
        state.inputsChanged.connect(self.findings.end_what_if)
        for cover in (self.exact, self.learned):
            workspace.hintChanged.connect(cover.set_hint)
        self.findings.whatIfShown.connect(self._show_what_if)
        self.findings.whatIfEnded.connect(self._end_what_if)

    def escape(self) -> bool:
        """End the last of what is under way; return False if nothing is.

        That is a region that is to be drawn, a pinned band, or a list of values.
        """
        asked = self._sensitivity
        if asked.tool is not None:
            asked.set_tool(None)
        elif asked.band is not None and asked.band.pinned:
            asked.unpin()
        else:
            return self.findings.leave_what_if() or self.findings.values.leave()
        return True

    def result(self) -> SensitivityResult | None:
        """Return what is shown now, to be saved; None if nothing is."""
        opened = self._workspace.opened
        if opened is None:
            return None
        return shown_result(
            self._state, self._sensitivity, self._dispatcher, self._image(), opened.volume.units
        )

    def _field(self, wanted: Source) -> Answer[Any] | None:
        band = self._sensitivity.band
        if band is not None and not band.effect:
            return self._dispatcher.seen
        fields, exact = self._dispatcher.shown_fields, self._dispatcher.exact_source
        if wanted == "learned" and "learned" in self._dispatcher.chooser.available:
            # Not the ray caster's meanwhile: it would be taken for the model's.
            return fields.get("learned")
        order = (exact, "learned") if wanted == "exact" else ("learned", exact)
        return next((fields[source] for source in order if source in fields), None)

    def _image(self) -> NDArray[np.float32] | None:
        inputs = self._state.inputs
        image = self.exact.image_of(inputs)
        return self.learned.image_of(inputs) if image is None else image

    def _shown_colors(self) -> NDArray[np.float32]:
        image = self._image()
        if image is None:
            return np.zeros((0, 3), dtype=np.float32)
        return image[self._sensitivity.outline.mask(image.shape[:2])]

    def _show_what_if(self, answer: WhatIfAnswer) -> None:
        cover = self.learned if answer.source == "learned" else self.exact
        cover.show_what_if(answer)

    def _end_what_if(self) -> None:
        for cover in (self.exact, self.learned):
            cover.show_what_if(None)
