"""The sensitivity view: regions and fields over both images, responses over the TF editor."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QDialog, QVBoxLayout

from app.controls import close_box, fill, order_focus, table
from app.engines.client import EngineName
from app.image_view.engine_pane import EnginePane
from app.sensitivity_view.band_layer import BandLayer, PlotMouse
from app.sensitivity_view.chip_bar import ChipBar
from app.sensitivity_view.field_cover import FieldCover
from app.sensitivity_view.findings_panel import FindingsPanel, SourceLabel
from app.sensitivity_view.region_layer import PlaceLabel, RegionLayer
from app.sensitivity_view.response_layer import ResponseLayer, VisibleLayer
from app.sensitivity_view.what_if import EditActions, RenderedEdit, WhatIfQuestion
from app.state.sensitivity_asker import Answer, SensitivityAsker
from app.state.workspace import Workspace
from app.tf_editor.editor import TransferFunctionEditor
from model.rendering.raster import at_size_of
from model.scene.inputs import SceneInputs
from model.scene.tf_perturbation import edit_over
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import OpacityTF
from model.scene.value_scale import values_at
from model.sensitivity.result import SensitivityResult

TABLE_SIZE = 520, 480  # of the dialog with the curve's numbers, in pixels


class SensitivityView(QObject):
    """Puts the sensitivity's widgets into the panes and into the TF editor, and refreshes them."""

    def __init__(
        self,
        workspace: Workspace,
        panes: Sequence[EnginePane],
        editor: TransferFunctionEditor,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._workspace, self._editor = workspace, editor
        self._asker = asker = workspace.sensitivity
        self._state, self._asked = asker.state, asker.asked
        self._panes = generator, reference, pane_b = panes
        self._what_if_shown: RenderedEdit | None = None
        canvases = [pane.canvas for pane in self._panes]
        self.labels = [PlaceLabel(canvas, asker, workspace.pieces) for canvas in canvases]
        self.regions = [
            RegionLayer(canvas, self._asked, partial(self._name_values_at, n))
            for n, canvas in enumerate(canvases)
        ]
        self.covers = [
            FieldCover(pane, asker, partial(self._field, pane), self._show_one_bar)
            for pane in (reference, pane_b, generator)
        ]
        self.exact, self.exact_b, self.learned = self.covers
        area = editor.area
        self.mouse = PlotMouse(area, self._state, self._asked)
        self.visible = VisibleLayer(area, asker)
        self.responses = ResponseLayer(area, asker, lambda n: self.actions.add_mode(n))
        self.actions = EditActions(
            asker, self.responses, self._shown_colors, self._made_visible, workspace.news.emit
        )
        self.band = BandLayer(area, asker, self.visible, self.actions.add_mode_over_band)
        self.chips = ChipBar(self._asked, area.histogram, self.show_table)
        self.source = SourceLabel(workspace)
        self.what_if = WhatIfQuestion(asker, self.responses, self._show_what_if, self)
        self.findings = FindingsPanel(
            asker, self.responses, self.actions, self.what_if, self.source, area.widget
        )
        editor.header.insertWidget(len(editor.header_controls), self.chips)
        editor.row.addWidget(self.findings)
        self._refreshes = self._listed_refreshes()
        self._connect()
        tag = self.band.tag
        order_focus(
            [
                *(*editor.header_controls, *self.chips.controls, editor.pane_button, area.widget),
                *(*self.responses.flags, *editor.card.controls, tag.add, tag.release),
                *(*self.findings.controls, self.source),
            ]
        )
        self._fold()

    def _listed_refreshes(self) -> dict[str, tuple[Callable[[], object], ...]]:
        """Return what is refreshed after a change, in this order."""
        regions, labels, covers = (
            tuple(part.refresh for part in parts)
            for parts in (self.regions, self.labels, self.covers)
        )
        bars = [cover.bar.place for cover in self.covers]
        visible, responses, band = self.visible, self.responses, self.band
        findings, what_if, chips = self.findings, self.what_if, self.chips
        return {
            # Answers.
            "region": (responses.refresh, self._show_source, findings.refresh),
            "visibility": (visible.refresh, band.refresh, findings.refresh),
            "pick": (*labels, findings.refresh),
            "field": (*covers, self._show_source),
            "seen": covers,
            "seen_too": covers,
            # What was asked.
            "choices": (
                what_if.forget, *regions, *labels, *covers, *bars,
                visible.refresh, responses.refresh, responses.fit, band.refresh,
                chips.refresh, self._show_source, findings.show_open, findings.refresh,
            ),
            "regions": (
                what_if.forget, *regions, visible.mark_stale, responses.follow_region,
                chips.refresh, findings.refresh,
            ),
            "band": (*covers, band.refresh, what_if.follow_band),
            "place": (*regions, *labels, findings.refresh),
            "carried": (*regions, *(label.carry for label in self.labels)),
            "tool": (*regions, chips.refresh),
            # What it was asked of, and where it is shown.
            "inputs": (visible.mark_stale, responses.mark_stale),
            "rest": (findings.refresh,),
            "hint": (*covers, self._show_source),
            "axis": (visible.place_labels, responses.fit, band.refresh),
            "colors": (
                visible.recolor, responses.recolor, band.refresh, chips.refresh, self._show_source,
            ),
        }  # fmt: skip

    def _connect(self) -> None:
        area, state = self._editor.area, self._state
        self._asked.changed.connect(self._refresh)
        self._asked.finished.connect(self._refresh)
        self._asker.answered.connect(self._refresh_soon)
        state.inputsChanged.connect(self._follow_inputs)
        state.tf_input.paneChanged.connect(self._follow_pane)
        for pane in self._panes[1:]:
            pane.canvas.resized.connect(self._follow_edited)
        state.inputsChangeFinished.connect(partial(self._refresh, "rest"))
        for changed in (area.axisChanged, area.heightChanged):
            changed.connect(partial(self._refresh, "axis"))
        area.recolored.connect(partial(self._refresh, "colors"))
        for changed in (self._editor.resized, self.findings.fitted):
            changed.connect(self._fold)
        for changed in (self._editor.resized, self._workspace.volumeStarted):
            changed.connect(partial(self.findings.keep_room, False))
        self._workspace.hintChanged.connect(lambda _hint: self._refresh("hint"))
        self._workspace.modelChanged.connect(self._show_source)
        preparation = self._workspace.reference.preparation
        preparation.progressed.connect(lambda *_groups: self._refresh("pick"))
        self.findings.rename.clicked.connect(lambda: self.chips.ask_name())
        QShortcut(QKeySequence("F8"), self._editor, self.chips.panel.click)

    def _refresh(self, what: str) -> None:
        for refresh in self._refreshes[what]:
            refresh()

    def _refresh_soon(self, what: str) -> None:
        """Refresh now; a few times a second while something moves."""
        for refresh in self._refreshes[what]:
            self._state.refreshes.ask(refresh, refresh)

    def _follow_inputs(self) -> None:
        # The edit's effect on another image is another question.
        self.what_if.forget()
        self.what_if.end()
        self._refresh_soon("inputs")

    def _follow_pane(self) -> None:
        """Name the values at the place in the pane with the focus, and show its field."""
        self._follow_edited()
        if not self._state.tf_input.compares:
            self.exact_b.check_stop()
        self._refresh("field")

    def _follow_edited(self) -> None:
        """Name the values at the place in the pane with the focus, once that is shown."""
        edited = self._panes[1] if self._edited.isHidden() else self._edited
        if any(label.is_here for label in self.labels[1:]):
            self._name_values_at(self._panes.index(edited))

    def _show_source(self) -> None:
        self.source.refresh()
        self.chips.say_source(self.source.plain_text)

    def show_table(self) -> QDialog:
        """List the curve's numbers, for screen readers and to copy them."""
        if not self._asked.shows_curve:
            self._asked.show_layer("curve", True)
        columns, rows = self.responses.table()
        dialog = QDialog(self._editor)
        dialog.setWindowTitle(f"Change: {self._asked.region_name}")
        shown = table(dialog.windowTitle(), columns, rows)
        shown.resizeColumnsToContents()
        fill(QVBoxLayout(dialog), shown, close_box(dialog), margins=(9, 9, 9, 9), spacing=6)
        dialog.resize(*TABLE_SIZE)
        dialog.open()
        return dialog

    def _fold(self) -> None:
        editor = self._editor
        self.findings.fold(editor.width(), editor.height())
        is_open = self.findings.is_open
        self.chips.fold(editor.width(), is_open)
        self.chips.panel.setChecked(is_open)

    def _name_values_at(self, clicked: int) -> None:
        for number, label in enumerate(self.labels):
            label.is_here = number == clicked
            label.refresh()

    def toggle_kept(self) -> None:
        """Keep the band of values, or the best one, after the mouse leaves; or release it."""
        band, best = self._asked.band, self.responses.peaks.intervals
        if band is not None and band.kept:
            self._asked.release()
        elif band is not None:
            self._asked.keep()
        elif best:
            self._asked.keep(best[0].value)

    def escape(self) -> bool:
        """End the newest of the active modes; return False if none is active."""
        asked = self._asked
        if asked.tool is not None:
            asked.set_tool(None)
        elif asked.band is not None and asked.band.kept:
            asked.release()
        elif self.what_if.is_on:
            self.what_if.end()
        elif asked.place is not None:
            asked.pick(None)
        elif asked.active is not None or self.findings.is_asked_for:
            asked.activate(None)
            if self.findings.is_asked_for:
                asked.open_panel(False)
        else:
            return False
        return True

    def result(self) -> SensitivityResult | None:
        """Return the shown sensitivity, to be saved; None if there is none."""
        opened = self._workspace.opened
        if opened is None:
            return None
        return _shown_result(self._asker, self._image(self._state.inputs), opened.volume.units)

    def _field(self, pane: EnginePane) -> Answer[Any] | None:
        band, wanted = self._asked.band, pane.engine
        if band is not None and not band.effect:
            # Visibility is the same by any engine: one image shows it, the other stays. A and B
            # each show their own.
            too = self._asker.seen_too if self._state.tf_input.compares else None
            return self._asker.seen if pane is self._left else too
        if wanted == "exact" and pane is not self._edited:
            return None
        # Each image shows its own engine's field, never the other's.
        other: EngineName = "learned" if wanted == "exact" else "exact"
        name = wanted if wanted in self._asker.engines else other
        return self._asker.fields.get(self._asker.source(name))

    @property
    def _edited(self) -> EnginePane:
        """Pane A or B: the one whose TF is edited."""
        _, reference, pane_b = self._panes
        return pane_b if self._state.tf_input.pane == "B" else reference

    @property
    def _left(self) -> EnginePane:
        """The left pane with an image; of A and B the edited one."""
        if self._state.tf_input.compares:
            return self._edited
        seen = [pane for pane in self._panes if not pane.isHidden()]
        shown = [pane for pane in seen if pane.canvas.image is not None] or seen or self._panes
        return min(shown, key=lambda pane: pane.x())

    def _show_one_bar(self) -> None:
        covers = sorted(self.covers, key=lambda cover: cover.pane is not self._left)
        # While B wipes A's image, its own pane is hidden.
        shown = [cover for cover in covers if cover.caption and not cover.pane.isHidden()]
        for cover in covers:
            cover.bar.setVisible(cover in shown[:1])

    def _image(self, inputs: SceneInputs) -> NDArray[np.float32] | None:
        images = (cover.image_of(inputs) for cover in self.covers)
        return next((image for image in images if image is not None), None)

    def _shown_colors(self) -> NDArray[np.float32]:
        image = self._image(self._state.inputs)
        if image is None:
            return np.zeros((0, 3), dtype=np.float32)
        return image[self._asked.outline.mask(image.shape[:2])]

    def _made_visible(self, opacity: OpacityTF) -> OpacityTF:
        opened = self._workspace.opened
        return opacity if opened is None else ThinnedVolume.of(opened.volume).made_visible(opacity)

    def _show_what_if(self) -> None:
        """Show the difference that an edit makes, with its size; or show the fields again."""
        answer = self.what_if.shown
        before, self._what_if_shown = self._what_if_shown, answer
        if answer is not None and answer is not before:
            exact = self.exact_b if self._state.tf_input.pane == "B" else self.exact
            cover = self.learned if answer.source == "learned" else exact
            cover.show_what_if(answer, self.what_if.edit_text)
        elif answer is None and before is not None:
            for cover in self.covers:
                cover.show_what_if(None)
        self.findings.show_result()
        self.band.asks_edit = self.what_if.is_on


def _shown_result(
    asker: SensitivityAsker, image: NDArray[np.float32] | None, units: str
) -> SensitivityResult | None:
    """Return the field of the band if there is one, else the region's responses."""
    state, band = asker.state, asker.asked.band
    if band is not None and not band.effect:
        # Visibility is not a sensitivity.
        band = None
    answer: Answer[Any] | None = asker.region if band is None else asker.field
    if answer is None or image is None or not answer.is_of(state.inputs):
        return None
    request = answer.request
    if band is None:
        if not asker.is_fresh(answer):
            return None
        place, measure, edit = asker.asked.region_name, request.measure, None
        pixels = int(request.region.mask(request.quality.pixels.shape).sum())
    else:
        if request.values != band.values:
            return None
        low, high = values_at(band.values, state.scale)
        values = f"{low:.5g}" if low == high else f"{low:.5g} to {high:.5g}"
        place = f"edits around {values}{f' {units}' if units else ''}"
        measure, pixels = asker.asked.choices.measure, answer.value.shape[0] * answer.value.shape[1]
        edit = edit_over(band.values, state.scalar_range, request.width)
        image = at_size_of(answer.value, image)
    return SensitivityResult(
        kind="region" if band is None else "value",
        measure=measure,
        place=place,
        pixels=pixels,
        edit=edit,
        scalar_range=state.scalar_range,
        scalar_window=asker.window,
        units=units,
        scale=state.scale,
        opacity=state.transfer_function.opacity.sample(),
        colors=state.transfer_function.color.sample(),
        image=image,
        sensitivity=answer.value,
        width=request.width,
        source=answer.source,
    )
