"""The sensitivity view: regions and fields over both images, responses over the TF editor."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QWidget

from app.controls import order_focus
from app.engines.channels import EngineName
from app.image_view.engine_pane import EnginePane
from app.sensitivity_view.band_layer import BandLayer
from app.sensitivity_view.chip_bar import ChipBar
from app.sensitivity_view.edit_actions import EditActions
from app.sensitivity_view.field_cover import FieldCover
from app.sensitivity_view.findings_panel import FindingsPanel
from app.sensitivity_view.place_label import PlaceLabel
from app.sensitivity_view.plot_mouse import PlotMouse
from app.sensitivity_view.region_layer import RegionLayer
from app.sensitivity_view.response_layer import ResponseLayer
from app.sensitivity_view.responses_table import ResponsesTable
from app.sensitivity_view.shown_result import shown_result
from app.sensitivity_view.source_label import SourceLabel
from app.sensitivity_view.visible_layer import VisibleLayer
from app.sensitivity_view.what_if import WhatIfQuestion
from app.state.sensitivity_answers import Answer, WhatIfAnswer
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.tf_editor.editor import TransferFunctionEditor
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import OpacityTF
from model.sensitivity.result import SensitivityResult


class SensitivityView(QObject):
    """Puts the sensitivity's widgets into the panes and into the TF editor.

    The reference pane shows exact fields, the generator's learned ones; where there is only
    one of the two, both show it.
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
        self._asker = asker = workspace.sensitivity
        self._editor = editor
        self._panes = generator, reference
        self.regions = [RegionLayer(pane.canvas, sensitivity) for pane in self._panes]
        self.labels = [PlaceLabel(pane.canvas, state, sensitivity, asker) for pane in self._panes]
        self.exact = FieldCover(reference, state, sensitivity, asker, lambda: self._field("exact"))
        self.learned = FieldCover(
            generator, state, sensitivity, asker, lambda: self._field("learned")
        )
        area = editor.area
        self.mouse = PlotMouse(area, state, sensitivity)
        self.visible = VisibleLayer(area, state, sensitivity, asker)
        self.responses = ResponseLayer(area, state, sensitivity, asker)
        self.band = BandLayer(area, state, sensitivity, asker, self.visible)
        self.chips = ChipBar(sensitivity, area.histogram)
        self.source = SourceLabel(sensitivity, asker, workspace)
        self.what_if = WhatIfQuestion(state, sensitivity, asker, self.responses, self)
        self.actions = EditActions(
            state, sensitivity, asker, self.responses, self._shown_colors, self._made_visible
        )
        self.findings = FindingsPanel(
            state,
            sensitivity,
            asker,
            self.responses,
            self.actions,
            self.what_if,
            self.source,
        )
        editor.add_to_header(self.chips)
        editor.add_panel(self.findings)
        self._connect()
        self._order_focus()
        self._fold()

    def _connect(self) -> None:
        sensitivity, findings = self._sensitivity, self.findings
        self._editor.resized.connect(self._fold)
        for asked_for in (sensitivity.regionDrawn, self.chips.regionChosen):
            asked_for.connect(lambda: findings.set_open(True))
        for layer, label in zip(self.regions, self.labels, strict=True):
            layer.placeClicked.connect(partial(self._name_values_at, label))
            label.openRequested.connect(lambda: findings.set_open(True))
        self.chips.panel.clicked.connect(findings.set_open)
        self.chips.tableRequested.connect(self.show_table)
        QShortcut(QKeySequence("F8"), self._editor, self.chips.panel.click)
        findings.openChanged.connect(lambda _open: self._fold())
        findings.renameRequested.connect(self.chips.ask_name)
        self._editor.area.recolored.connect(self.source.refresh)
        self.source.saidChanged.connect(self.chips.say_source)
        self.band.tag.add.addRequested.connect(self.actions.add_mode_over_band)
        for cover in (self.exact, self.learned):
            self._workspace.hintChanged.connect(cover.set_hint)
            cover.changed.connect(self._show_one_bar)
        self.what_if.shown.connect(self._show_what_if)
        self.what_if.ended.connect(self._end_what_if)
        self.what_if.ended.connect(lambda: self.band.ask_edit(False))
        self.what_if.resultChanged.connect(
            lambda _said: self.band.ask_edit(self.what_if.button.isChecked())
        )

    def show_table(self) -> ResponsesTable:
        """List the curve's numbers."""
        if not self._sensitivity.shows_curve:
            self._sensitivity.show_layer("curve", True)
        columns, rows = self.responses.table()
        title = f"Change: {self._sensitivity.region_name}"
        dialog = ResponsesTable(title, columns, rows, self._editor)
        dialog.open()
        return dialog

    def _order_focus(self) -> None:
        """Let Tab go from the header to the plot, its flags and its card, and to the panel."""
        chips, findings, area = self.chips, self.findings, self._editor.area
        rows = zip(findings.raises, findings.lowers, findings.isolates, strict=True)
        order: list[QWidget] = [
            *self._editor.header_controls,
            chips.region, chips.change, chips.more, chips.visible, chips.voxels, chips.panel,
            area.widget, *self.responses.flags, *self._editor.card.controls,
            self.band.tag.add, self.band.tag.release,
            findings.rename, findings.close_button, *(each for row in rows for each in row),
            findings.height_box, *findings.adds, self.what_if.button, self.source,
        ]  # fmt: skip
        order_focus(order)

    def _fold(self) -> None:
        editor = self._editor
        self.findings.fold(editor.width(), editor.height())
        is_open = self.findings.is_open
        self.chips.fold(editor.width(), is_open)
        self.chips.panel.setChecked(is_open)

    def _name_values_at(self, clicked: PlaceLabel) -> None:
        for label in self.labels:
            label.come(label is clicked)

    def toggle_pin(self) -> None:
        """Keep the band of values, or the best one, when the mouse leaves; or release it."""
        band, best = self._sensitivity.band, self.responses.intervals
        if band is not None and band.pinned:
            self._sensitivity.unpin()
        elif band is not None:
            self._sensitivity.pin()
        elif best:
            self._sensitivity.pin(best[0].value)

    def escape(self) -> bool:
        """End the last of what is under way; return False if nothing is.

        That is a region that is to be drawn, a pinned band, an edit that is tried, a clicked
        place, a region, or the open panel.
        """
        asked = self._sensitivity
        if asked.tool is not None:
            asked.set_tool(None)
        elif asked.band is not None and asked.band.pinned:
            asked.unpin()
        elif self.what_if.leave() or self.findings.values.leave():
            pass
        elif asked.active is not None:
            asked.activate(None)
            self.findings.set_open(False)
        elif self.findings.is_asked_for:
            self.findings.set_open(False)
        else:
            return False
        return True

    def result(self) -> SensitivityResult | None:
        """Return what is shown now, to be saved; None if nothing is."""
        opened = self._workspace.opened
        if opened is None:
            return None
        return shown_result(
            self._state, self._sensitivity, self._asker, self._image(), opened.volume.units
        )

    def _field(self, wanted: EngineName) -> Answer[Any] | None:
        band = self._sensitivity.band
        if band is not None and not band.effect:
            # Of the data, whoever draws: one image shows it, and the other stays as it is.
            return self._asker.seen if wanted == self._left else None
        # Each image has its own engine's, not meanwhile the other's, which would be taken for it.
        other: EngineName = "learned" if wanted == "exact" else "exact"
        name = wanted if wanted in self._asker.engines else other
        return self._asker.fields.get(self._asker.source(name))

    @property
    def _left(self) -> EngineName:
        """Whose pane is the left one of those that are shown."""
        shown = [pane for pane in self._panes if not pane.isHidden()] or self._panes
        left = min(shown, key=lambda pane: pane.x())
        return "learned" if left is self._panes[0] else "exact"

    def _show_one_bar(self) -> None:
        """Show the colour bar over the left one of the images that have a field."""
        covers = (
            [self.learned, self.exact] if self._left == "learned" else [self.exact, self.learned]
        )
        shown = [cover for cover in covers if cover.caption]
        for cover in covers:
            cover.bar.setVisible(cover in shown[:1])

    def _image(self) -> NDArray[np.float32] | None:
        inputs = self._state.inputs
        image = self.exact.image_of(inputs)
        return self.learned.image_of(inputs) if image is None else image

    def _shown_colors(self) -> NDArray[np.float32]:
        image = self._image()
        if image is None:
            return np.zeros((0, 3), dtype=np.float32)
        return image[self._sensitivity.outline.mask(image.shape[:2])]

    def _made_visible(self, opacity: OpacityTF) -> OpacityTF:
        opened = self._workspace.opened
        return opacity if opened is None else ThinnedVolume.of(opened.volume).made_visible(opacity)

    def _show_what_if(self, answer: WhatIfAnswer) -> None:
        cover = self.learned if answer.source == "learned" else self.exact
        cover.show_what_if(answer, self.what_if.edit_text)

    def _end_what_if(self) -> None:
        for cover in (self.exact, self.learned):
            cover.show_what_if(None)
