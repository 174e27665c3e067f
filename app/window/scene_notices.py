"""Notices about what is not visible of the open volume, and how to show it."""

from collections.abc import Callable
from functools import partial

import numpy as np
from PySide6.QtCore import QObject

from app.controls import Action
from app.engines.messages import Result
from app.image_view.engine_pane import EnginePane
from app.state.reference_choices import ReferenceChoices
from app.window.context import Context
from model.scene.hints import NarrowPart, narrow_part, nothing_visible, why_nothing
from model.scene.labels import label_range, label_tf, looks_like_labels
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import LOGARITHM_OFFER, suits_logarithm
from model.scene.volume import Caution, Volume

NARROW, LIGHT, OFFER, LABELS = "narrow part of the TF", "light", "logarithmic scale", "labels"
CAUTION = "the file"
"""Keys of the notices."""


class SceneNotices(QObject):
    """Watches TF, light, scale and final images, and reports problems with a way out."""

    def __init__(self, context: Context, show_range: Callable[[Range], object]) -> None:
        super().__init__(context.window)
        self._context, self._notices = context, context.notices
        self._state, self._workspace = context.state, context.workspace
        self._show_range = show_range
        self._narrow: NarrowPart | None = None
        work = self._workspace.reference
        self._state.tf_input.changeFinished.connect(self._judge_tf)
        work.lightTooSlow.connect(self._offer_light)
        work.choicesChanged.connect(self._follow_light)
        for pane in context.panes:
            pane.channel.answered.connect(partial(self._judge_image, pane))
            pane.client.stateChanged.connect(partial(self._follow_pane, pane))

    def start_volume(self, volume: Volume) -> None:
        """Forget the previous volume's notices, before the TF is set, and show its cautions."""
        self._narrow = None
        self._notices.clear(LIGHT)
        cautions = (note for note in volume.notes if isinstance(note, Caution))
        self._notices.add(" ".join(cautions), key=CAUTION)

    def _judge_tf(self, tf: TransferFunction) -> None:
        found = narrow_part(tf.opacity, tf.color)
        # A dismissed notice comes again only for another part or range.
        if found == self._narrow:
            return
        self._narrow = found
        if found is None:
            self._notices.clear(NARROW)
        else:
            show = Action(f"Show {found.remedy_text}", partial(self._show_range, found.remedy))
            self._notices.add(found.sentence, show, key=NARROW)

    def _offer_light(self, seconds: float) -> None:
        self._notices.add(
            f"The image has no light: with light, each takes {seconds:.0f} s here.",
            Action("Light it", partial(self._workspace.reference.choose, lighting="direct")),
            key=LIGHT,
        )

    def _follow_light(self, choices: ReferenceChoices) -> None:
        if choices.lighting != "auto":
            self._notices.clear(LIGHT)

    def offer_logarithm(self) -> None:
        """Offer the logarithmic scale for values that need it."""
        opened = self._workspace.opened
        if opened is None or opened.volume.scale == "log":
            return
        is_new = self._state.transfer_function == self._state.default
        if is_new and suits_logarithm(opened.volume.distribution):
            self._notices.add(
                f"{opened.volume.name}: {LOGARITHM_OFFER}.",
                Action("Logarithmic scale", partial(self._workspace.opening.show_on_scale, "log")),
                key=OFFER,
            )

    def offer_labels(self) -> None:
        """Offer to show values as labels if the file's name says so."""
        opened, state = self._workspace.opened, self._state
        if opened is None or not state.interpolates or not looks_like_labels(opened.volume):
            self._notices.clear(LABELS)
        elif state.transfer_function == state.default:
            text = f"{opened.volume.name} looks like labels."
            show = Action("Show as labels", partial(self._show_labels, opened.volume))
            self._notices.add(text, show, key=LABELS)

    def _show_labels(self, volume: Volume) -> None:
        with self._state.edits.as_one("show as labels"):
            self._state.set_interpolates(False)
            tf = label_tf(volume.over(label_range(volume)))
            self._state.tf_input.exchange(tf, "show as labels")

    def _follow_pane(self, pane: EnginePane, _state: object) -> None:
        if pane.canvas.image is None or pane.canvas.message:
            self._notices.clear(_emptiness(pane))

    def _judge_image(self, pane: EnginePane, result: Result) -> None:
        request, opened = result.request, self._workspace.opened
        if result.value is None or opened is None or request.quality.live:
            return
        if not nothing_visible(result.value):
            self._notices.clear(_emptiness(pane))
            return
        state = self._state
        if request.inputs != state.inputs_of(pane.name):
            return
        height, width = np.shape(result.value)[:2]
        volume, ratio = opened.volume, width / height
        found = why_nothing(request.inputs, volume.data_range, opened.counts, opened.edges, ratio)
        actions = {
            "tf": Action("Default TF", partial(self._reset_tf, pane)),
            "view": Action("Reset view", state.reset_view),
            "crop": Action("Whole volume", state.show_whole),
            "mask": Action("Show all voxels", state.show_all_voxels),
        }
        self._notices.add(found.text, actions[found.cause], key=_emptiness(pane))

    def _reset_tf(self, pane: EnginePane) -> None:
        self._state.tf_input.focus(pane.name)
        self._state.reset_transfer_function()


def _emptiness(pane: EnginePane) -> str:
    """Key of the notice about a pane that shows nothing."""
    return f"emptiness of the {pane.engine} image {pane.name}"
