"""The workspace: the open volume and model, and the engines of the two images."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, get_args

from PySide6.QtCore import QObject, Signal, SignalInstance

from app.engines.client import Clients, EngineClient, EngineName, EngineState
from app.engines.engines import Builders
from app.engines.exactness import STOPS
from app.engines.messages import EngineReady
from app.state.edited_tf import PaneName
from app.state.image_scheduler import ImageScheduler
from app.state.latent_pictures import LatentPictures
from app.state.latent_session import LatentChoices, LatentState
from app.state.library import Library
from app.state.open_model import NO_VOLUME, OpenModel
from app.state.opened_volume import OpenedVolume
from app.state.piece_finder import PieceFinder
from app.state.preferences import Preferences
from app.state.reference_image import ReferenceImage
from app.state.sensitivity_asker import SensitivityAsker, Source
from app.state.sensitivity_state import SensitivityState
from app.state.settings import VolumeMemory
from app.state.viewer_state import ViewerState
from app.state.volume_opening import VolumeOpening
from model.scene.mask import Mask
from model.scene.ranges import fit_to_range, fit_to_volume
from model.scene.scene import EXACT_LIGHTINGS, LightDirection
from model.scene.transfer_function import TransferFunction
from model.scene.value_scale import ValueScale, share_without_logarithm
from model.scene.volume import Volume
from model.volume_files.shipped import sample_of

RESTORED = "TF, view, crop box and regions are restored; Presets > Default resets the TF."

SCALE_EDITS: dict[ValueScale, str] = {"linear": "linear scale", "log": "logarithmic scale"}
"""Names of the edits in the menu."""


@dataclass(frozen=True)
class Viewing:
    """State that a window shows and remembers."""

    state: ViewerState
    sensitivity: SensitivityState
    latent: LatentState
    preferences: Preferences


class Workspace(QObject):
    """Opens volumes and models, and keeps the engines of both images up to date."""

    volumeOpened = Signal(object)  # emitted when engines draw a new volume, before its TF is set
    volumeStarted = Signal()  # emitted when the TF of an opened volume is set
    rangeChanged = Signal(object)  # emitted with the :class:`OpenedVolume` over another range
    scaleChanged = Signal(object)  # emitted with the :class:`OpenedVolume` on another scale
    problem = Signal(str)  # emitted with an error sentence for the notice bar
    news = Signal(str)  # emitted with a sentence for the status bar
    hintChanged = Signal(str)  # emitted with what is outside the training range, or ""
    modelChanged = Signal()  # emitted when a generator fits the volume, or no longer does
    settled = Signal()  # emitted when both images are final or replaced by a message

    def __init__(
        self, viewing: Viewing, clients: Clients, builders: Builders, parent: QObject
    ) -> None:
        super().__init__(parent)
        state, preferences, asked = viewing.state, viewing.preferences, viewing.sensitivity
        self._state, self._preferences, self._asked = state, preferences, asked
        self._clients = clients
        self._images = clients.generator, clients.reference
        self.library = Library(preferences)
        self.model = OpenModel(clients.generator, builders)
        self._scheduler = ImageScheduler(state, clients, self)
        both: dict[EngineName, EngineClient] = {
            "exact": clients.analyst,
            "learned": clients.generator,
        }
        self.sensitivity = SensitivityAsker(state, asked, both, self)
        self.sensitivity.is_starting = lambda: not self.reference.has_drawn
        self.latent = LatentPictures(state, viewing.latent, both, builders.latent_space, self)
        self.reference = ReferenceImage(
            state, clients, builders, self._scheduler, preferences, self
        )
        by = self.model, self.library, preferences
        self.opening = VolumeOpening(builders.read_volume, *by, self)
        # Pictures of the map are as fast as the images.
        self.latent.patience = lambda: STOPS[self.reference.choices.stop].patience
        self.latent.raster = lambda: self.reference.raster
        self.latent.is_path_traced = lambda: self.reference.settings.lighting == "path"
        self.opened: OpenedVolume | None = None
        self.pieces = PieceFinder(self.sensitivity, lambda: self.model.volume, self.news.emit, self)
        self._kept = ""  # fingerprint of the volume whose memory is kept
        self.is_next = self._is_restored = False  # the next time step of a series
        self._has_map = False  # whether the map of TFs is shown
        self._connect()

    def _connect(self) -> None:
        state, work, generator = self._state, self.reference, self._clients.generator
        reference = self._clients.reference
        images = generator.images, reference.images, reference.images_b
        wires: list[tuple[SignalInstance, Callable[..., object]]] = [
            (state.inputsChangeFinished, self._update_hint),
            (state.tf_input.changeFinished, self.opening.follow),
            (state.edits.edited, self._keep_edits),
            (state.tf_input.paneChanged, self._keep_b),
            (state.viewChangeFinished, lambda view: self.keep(view=view)),
            (self._asked.changed, self._keep_regions),
            (self._asked.finished, self._keep_regions),
            (self.opening.warned, self.problem.emit),
            (self.opening.opened, self.show),
            (self.opening.ranged, self.show_range),
            (self.opening.refused, self.refuse),
            (self.opening.said, self.say_progress),
            (work.resized, self.sensitivity.show),
            (work.settingsChanged, self._relight),
            (self.latent.state.choicesChanged, self._follow_browser),
            (self.latent.session.differentChanged, partial(self._scheduler.make_way, False)),
            (work.analystReplaced, self._restart_questions),
            (generator.engineReady, self._generator_ready),
            (generator.stateChanged, self._follow_failure),
            *((channel.answered, self.sensitivity.follow_image) for channel in images),
            (reference.images_b.pendingChanged, lambda _is_pending: self._report_settled()),
            *((client.settled, self._report_settled) for client in self._images),
            # Loading a model would take the processor from the first picture.
            (reference.images.answered, lambda _result: self.model.begin()),
            (reference.settled, self.model.begin),
        ]
        for signal, slot in wires:
            signal.connect(slot)

    def _follow_browser(self, choices: LatentChoices) -> None:
        """Have images wait for the browser's first pictures, which its opening asks for."""
        if (has_map := choices.shown and choices.on_map) != self._has_map:
            # The map takes so much of the window that the home view would be cut off.
            self._has_map = has_map
            self.reference.follow_pane()
        is_first = self.latent.session.different is None and self.opened is not None
        self._scheduler.make_way(choices.shown and is_first)

    @property
    def is_settled(self) -> bool:
        """True if both images are final or replaced by a message."""
        drawn = all(c in self._scheduler.hidden or c.is_settled for c in self._images)
        drawn = drawn and not self._clients.reference.images_b.is_pending
        return drawn and not (self.opening.is_busy or self.reference.is_preparing)

    def open_model(self, folder: Path | None) -> None:
        """Load a generator in the background; None for no model."""
        scene = None if folder is None else self.library.scene_of(folder)
        self.model.open(folder, scene, held=self._reference_comes_first())
        # This model was chosen later than the one of the volume being read.
        self.opening.follow_model()
        self._follow_scene()

    def ask_for_model(self) -> None:
        """Show the model's image next to the reference, with this volume in any light."""
        self.model.shows_image = True
        self._follow_scene()

    def fitted(self, transfer_function: TransferFunction) -> TransferFunction:
        """Convert any TF to one that can be edited here."""
        if self.opened is None:
            same = transfer_function.on_scale(self._state.scale)
            return fit_to_range(same, self._state.scalar_range)
        volume, scene = self.opened.volume, self.model.fitting_scene
        if transfer_function.is_relative:
            transfer_function = transfer_function.on_scale(volume.scale)
        if transfer_function.scale == volume.scale:
            if scene is not None:
                return fit_to_range(transfer_function, scene.scalar_range)
            if self.opening.shown.scalar_range is not None:
                return fit_to_range(transfer_function, volume.scalar_range)
        return fit_to_volume(transfer_function, self.opened.volume)

    def show_images(self, generator: bool, reference: bool, b: bool) -> None:
        """Set which images are visible; others are not drawn."""
        seen = zip(self._images, (generator, reference), strict=True)
        hidden = frozenset(client for client, shown in seen if not shown)
        missed = bool(self._scheduler.hidden - hidden) or (b and not self._scheduler.compares)
        is_other = hidden != self._scheduler.hidden
        self._scheduler.hidden, self._scheduler.compares = hidden, b
        if is_other:
            self.sensitivity.see_model(generator)
            self.reference.follow_panes()
        if not b:
            self._clients.reference.images_b.cancel()
            self._clients.reference.free()
        if missed and self.opened is not None:
            self._scheduler.send()
        if not reference:
            self.model.begin()

    def stop(self) -> None:
        """Ask all threads to end; returns at once."""
        self._scheduler.end()
        self.reference.stop()
        self.sensitivity.stop()
        self.latent.stop()
        self.pieces.stop()
        for client in (*self._images, self._clients.analyst):
            client.stop()
        self.opening.abandon()

    def join(self) -> None:
        """Wait until all threads have ended."""
        clients = *self._images, self._clients.analyst
        for part in (*clients, self.latent.session, self.pieces, self.opening):
            part.join()

    def show(self, opened: OpenedVolume) -> None:
        """Show a volume that was read, with all that is remembered of it."""
        volume, wanted = opened.volume, self.opening.shown
        folder = self.opening.model_for(opened.fingerprint)
        sample = sample_of(volume)
        before, self.opened = self.opened, opened
        self.model.opened = opened
        self.is_next = before is not None and before.volume.series == volume.series
        memory = self._start_memory(opened)
        self._is_restored = memory.tf is not None
        self.latent.session.start_volume(volume, opened.map_window)
        is_other = before is None or before.fingerprint != opened.fingerprint
        # With the volume, or before it.
        is_chosen = wanted.model is not None or (is_other and folder == self.model.folder)
        is_chosen = is_chosen and folder is not None and wanted.memory is None
        if folder != self.model.folder:
            self.open_model(folder)
        self.model.shows_image = None if is_chosen else memory.shows_model
        proposed = "auto" if sample is None or wanted.model is not None else sample.lighting
        self.reference.start(volume, self.model.volume_scene, proposed)
        self._follow_scene()
        self._scheduler.make_way(False)  # the first picture comes before the browser's
        restored = RESTORED if self._is_restored and wanted.memory is None else ""
        notes = [*volume.notes, volume.missing_text, restored]
        self.news.emit(" ".join(filter(None, notes)))
        self._scheduler.scale = volume.scale
        axes = volume.proportions, memory.up_axis or volume.up, volume.axis_labels
        angles = None if sample is None else sample.angles
        seen = memory.view, opened.shown, self.reference.reach
        self._state.start_view(*axes, *seen, angles)
        self.volumeOpened.emit(opened)
        self._preferences.note_opened(opened.fingerprint, opened.path)
        self._note_model()
        # After the engines are set: this requests the images.
        others, tf = vars(memory) | {"mask": opened.mask}, memory.tf
        tf_input = self._state.tf_input
        if self.is_next and wanted.memory is None:
            # The next time step keeps what is cut away, and B; whether these are labels, it says.
            kept = {name for name in self._state.edited if others[name] is None} - {"interpolates"}
            others |= {name: self._state.edited[name].value for name in kept}
        if self.is_next and tf_input.compares and memory.tf_b is None:
            others |= {"compares": True, "tf_b": tf_input.of("B"), "look_b": tf_input.look}
            tf = tf or tf_input.of("A")
        if is_chosen:
            # B would take the place of the model's image.
            others["compares"] = False
        self._state.start_volume(opened.default, tf, others, volume.file, volume.units)
        by = {"raw_layout": wanted.raw, "choice": wanted.choice}
        self.keep(**{name: each.text for name, each in by.items() if each is not None})
        if wanted.memory is not None:
            self._keep_edits()
        if wanted.memory is not None or (memory.mask and opened.mask is None):
            # A missing mask file was reported; once is enough.
            self.keep(mask=self._mask_name(opened.mask))
        self.volumeStarted.emit()

    def show_range(self, opened: OpenedVolume) -> None:
        """Show the open volume over another range, or on another scale."""
        volume = opened.volume
        is_rescaled = self.opened is None or self.opened.volume.scale != volume.scale
        self.opened = self.model.opened = opened
        self._scheduler.scale = volume.scale
        self.latent.session.start_volume(volume, opened.map_window)
        self.reference.start(volume, self.model.volume_scene)
        if is_rescaled:
            self._state.default = opened.default
            self.scaleChanged.emit(opened)
            if self._state.scale != volume.scale:
                self._state.tf_input.exchange(opened.default, SCALE_EDITS[volume.scale])
            self.news.emit(_scale_news(volume))
        self._follow_scene()
        self.rangeChanged.emit(opened)
        self._scheduler.send()

    def refuse(self, text: str) -> None:
        """Say why a volume cannot be shown; the open one stays."""
        if self.opened is None:
            self._clients.reference.fail(text)
            self._clients.generator.pause(NO_VOLUME)
        else:
            self.news.emit("")
            self.problem.emit(text)
            self._report_settled()

    def say_progress(self, text: str) -> None:
        """Show what is being read: in the status line, or instead of a missing image."""
        say = self._clients.reference.wait if self.opened is None else self.news.emit
        say(text)

    def _start_memory(self, opened: OpenedVolume) -> VolumeMemory:
        """Show regions and brightness of another volume, and keep its changes from now on."""
        self._kept = ""
        memory, asked = self._preferences.volume(opened.fingerprint), self._asked
        names = [region.name for region in memory.regions]
        active = names.index(memory.active_region) if memory.active_region in names else None
        asked.start_volume(self.is_next, memory.regions, active, memory.region_count)
        brightness = self._state.brightness
        if memory.brightness is not None or not self.is_next:
            brightness.start(memory.brightness)
        self._kept = opened.fingerprint
        self.keep(brightness=brightness.value)
        if opened.volume.file.is_labels and memory.interpolates is None:
            # The same voxels are labels even if this file does not say so.
            self.keep(interpolates=False)
        if asked.regions != memory.regions:
            self._keep_regions()
        return memory

    def _keep_edits(self) -> None:
        """Keep the TF and the other edited inputs after every edit, undo and redo."""
        state, designed = self._state, self.reference.designed_light or LightDirection()
        inputs = {**state.edited, "brightness": state.brightness}
        edited = {name: each.value for name, each in inputs.items() if each.is_edited}
        if edited.get("light") == designed:
            edited["light"] = None
        if "mask" in edited:
            edited["mask"] = self._mask_name(edited["mask"])
        self.keep(tf=state.tf_input.of("A"), **edited)
        self._keep_b()

    def _keep_b(self) -> None:
        tf_input = self._state.tf_input
        shown = {"compares": tf_input.compares, "pane": tf_input.pane}
        self.keep(tf_b=tf_input.of("B"), look_b=tf_input.look, **shown)

    def _mask_name(self, mask: Mask | None) -> str:
        """Keep the open volume's mask; return its name in the memory."""
        assert self.opened is not None
        return self._preferences.keep_mask(self._kept, mask, self.opened.volume)

    def _keep_regions(self, what: str = "regions") -> None:
        asked = self._asked
        if what == "regions" and not asked.dragging:
            name = "" if asked.active is None else asked.region_name
            self.keep(regions=asked.regions, active_region=name, region_count=asked.count)

    def keep(self, **changes: Any) -> None:
        """Remember something of the open volume, by its names in :class:`VolumeMemory`."""
        if self._kept:
            self._preferences.note_volume(self._kept, **changes)

    def _follow_failure(self, state: EngineState) -> None:
        if state is EngineState.FAILED and self.model.has_failed():
            self._follow_scene()

    def _generator_ready(self, ready: EngineReady) -> None:
        self.model.take(ready)
        self._follow_scene()
        self._note_model()
        scene, tf = self.model.volume_scene, self._state.transfer_function
        if self.model.draws_path:
            # The present renderer takes any range and scale.
            scene = None
        is_alike = scene is not None and tf.scale == scene.scale
        if scene is not None and is_alike and tf.scalar_range != scene.scalar_range:
            self._state.tf_input.set(fit_to_range(tf, scene.scalar_range), "range of the model")
        elif scene is not None and not is_alike and self.opened is not None and self._is_untouched:
            # The result is the same as if the model had been opened before the volume.
            self.opening.show_over(scene.scalar_range, scene.scale)
        self._scheduler.send()

    @property
    def _is_untouched(self) -> bool:
        """Whether the volume's range and scale are not chosen."""
        chosen = self.opening.shown.scalar_range, self.opening.shown.scale
        tfs = [self._state.tf_input.of(pane) for pane in get_args(PaneName)]
        is_default = all(tf in (None, self._state.default) for tf in tfs)
        return not self._is_restored and chosen == (None, None) and is_default

    def _note_model(self) -> None:
        scene = self.model.volume_scene
        if scene is not None and self.model.folder is not None and self.model.scene is not None:
            self._preferences.note_model(self.model.folder, scene.volume_fingerprint)

    def _follow_scene(self) -> None:
        """Adapt the generator to the volume, and the reference and the panels to the generator."""
        self.reference.follow(self.model.volume_scene)
        self._follow_light()
        self.model.match(self.opening.is_reading)
        scene = self.model.fitting_scene
        learned_size = None if scene is None else scene.image_size
        self.sensitivity.set_learned(learned_size)
        self.latent.set_model(None if scene is None else self.model.folder, learned_size)
        self._update_hint()
        # Last, so that listeners see all changes.
        self.modelChanged.emit()

    def _relight(self) -> None:
        """Adapt the generator and the panels to another light of the reference."""
        before = self.model.draws_path, self.model.awaits_path
        self._follow_light()
        if (self.model.draws_path, self.model.awaits_path) != before:
            self._follow_scene()
        self._update_hint()

    def _follow_light(self) -> None:
        self.model.follow_light(self.reference.settings, self.reference.wanted)
        self._scheduler.generator_follows = self.model.draws_path
        if not self._reference_comes_first():
            # The reference, for which the model waited, may be hidden by now.
            self.model.begin()
        self.keep(shows_model=self.model.shows_image)

    def _restart_questions(self) -> None:
        if self.opened is not None:
            lighting = self.reference.edited.lighting
            source: Source = "exact" if lighting in EXACT_LIGHTINGS else "other light"
            self.sensitivity.start_volume(self.opened.window, source)
            self.sensitivity.ask()
            self.latent.restart()

    def _update_hint(self) -> None:
        lighting, inputs = self.reference.settings.lighting, self._state.inputs_of("A")
        hint = self.sensitivity.hint = self.model.hint(inputs, lighting)
        self.hintChanged.emit(hint)

    def _reference_comes_first(self) -> bool:
        """Whether the reference is about to show a picture, which loading a model would delay."""
        if self._clients.reference in self._scheduler.hidden:
            return False
        is_drawn = self.opened is not None and not self._clients.reference.is_settled
        return self.opening.is_reading or is_drawn

    def _report_settled(self) -> None:
        if self.is_settled:
            self.settled.emit()


def _scale_news(volume: Volume) -> str:
    """Report a volume's scale, and the share of its voxels without a logarithm."""
    if volume.scale == "linear":
        return "The scale is linear."
    share = share_without_logarithm(volume.linear.distribution)
    said = f" {100 * share:.2g} % of the voxels are zero or below, and look like the lowest value."
    return f"The scale is logarithmic.{said if share else ''}"
