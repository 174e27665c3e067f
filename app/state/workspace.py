"""The workspace: the open volume and model, and the engines of the two images."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.engines.client import Channel, EngineClient
from app.engines.engines import Builders, GeneratorSettings
from app.state.brightness import Brightness
from app.state.decoded_tf import DecodedTF
from app.state.dispatcher import Dispatcher
from app.state.exactness import STEPS
from app.state.generator_work import NO_VOLUME, GeneratorWork
from app.state.latent_state import LatentState
from app.state.latent_work import LatentWork
from app.state.library import Library
from app.state.live_errors import LiveErrors
from app.state.look_keeper import LookKeeper
from app.state.marks_keeper import MarksKeeper
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.reference_choices import ReferenceChoices
from app.state.reference_work import ReferenceWork
from app.state.sensitivity_answers import Source
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.start_order import StartOrder
from app.state.transfer_function_keeper import TransferFunctionKeeper
from app.state.transfer_function_store import TransferFunctionStore
from app.state.viewer_state import ViewerState
from app.state.volume_opening import VolumeOpening
from model.errors import TfscopeError
from model.scene.range_choice import RangeChoice
from model.scene.range_fitting import fit_to_range, fit_to_volume
from model.scene.robust_range import robust_range
from model.scene.scene import EXACT_LIGHTINGS, Lighting
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import ValueScale, share_without_logarithm
from model.scene.volume import Volume
from model.volume_files.choice import Choice
from model.volume_files.raw import RawLayout

RESTORED = "TF, view, crop box and regions are as you left them; Presets > Default begins anew."


SCALE_EDITS: dict[ValueScale, str] = {"linear": "linear scale", "log": "logarithmic scale"}
"""Names of the edits in the menu."""


class Workspace(QObject):
    """Opens volumes and models, and keeps the engines of both images up to date.

    Parameters
    ----------
    generator, reference : EngineClient
    stand_in : Channel
        To the analyst, a ray caster whose images are shown until the reference's are there.
    brightness : Brightness
    builders : Builders
        Functions that read volumes and build engines.
    store : TransferFunctionStore or None
        Storage of every volume's TF between runs; None for none.
    preferences : Preferences
        What is remembered of volumes, models and choices.
    generator_settings : GeneratorSettings
        Device, backend and precision of generators.
    """

    readingStarted = Signal(str)
    """Emitted with the name of the file or folder that is about to be read."""
    readingEnded = Signal()
    """Emitted when it was read, or was not."""
    volumeRead = Signal(object)
    """Emitted with the :class:`OpenedVolume` that was read: problems from now on are its own."""
    volumeOpened = Signal(object)
    """Emitted when the engines draw a volume that was read, before its TF is set."""
    volumeStarted = Signal()
    """Emitted when the TF of an opened volume is set."""
    rangeChanged = Signal(object)
    """Emitted with the :class:`OpenedVolume` when it is over another scalar range."""
    scaleChanged = Signal(object)
    """Emitted with the :class:`OpenedVolume` when it is on another scale, before its TF is."""
    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""
    hintChanged = Signal(str)
    """Emitted with a description of inputs outside the training range; may be empty."""
    modelChanged = Signal()
    """Emitted when a generator fits the volume, or no longer does."""
    settled = Signal()
    """Emitted when both images are final or replaced by a message."""

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        latent: LatentState,
        generator: EngineClient,
        reference: EngineClient,
        stand_in: Channel,
        brightness: Brightness,
        builders: Builders,
        store: TransferFunctionStore | None,
        preferences: Preferences,
        generator_settings: GeneratorSettings,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._clients = generator, reference
        self._generator, self._analyst = generator, stand_in.client
        self._preferences = preferences
        self.library = Library(preferences)
        self._keeper = TransferFunctionKeeper(store, self)
        self._keeper.problem.connect(self.problem)
        self._model = GeneratorWork(generator, builders, generator_settings, self)
        self._order = StartOrder(generator, reference, stand_in, self._model, self)
        self._dispatcher = Dispatcher(state, generator, reference, stand_in, self)
        self.live_errors = errors = LiveErrors(self)
        self.sensitivity = SensitivityDispatcher(
            state, sensitivity, self._analyst, generator, self._order, brightness, errors, self
        )
        self.latent = LatentWork(
            state, latent, self._analyst, generator, errors, brightness, builders.latent_space, self
        )
        self.decoded = DecodedTF(state, generator, self)
        self.reference = ReferenceWork(
            state, reference, stand_in, builders, self._dispatcher, preferences, self
        )
        self._looks = LookKeeper(state, preferences, self)
        self._marks = MarksKeeper(sensitivity, latent, preferences, self)
        self._opening = VolumeOpening(builders.read_volume, self)
        self._ranging = VolumeOpening(builders.read_volume, self)
        self._opened: OpenedVolume | None = None
        self._first_range: RangeChoice | None = None
        self._first_scale: ValueScale | None = None
        self._first_model: Path | None = None
        self._first_tf: TransferFunction | None = None
        self._is_restored = False
        self._reading = ""
        self._connect()

    def _connect(self) -> None:
        state, work = self._state, self.reference
        state.inputsChanged.connect(self._update_hint)
        state.tf_input.changeFinished.connect(self._follow_range)
        state.edits.edited.connect(self._keep)
        work.resized.connect(self.sensitivity.show)
        work.choicesChanged.connect(self._share_patience)
        self._share_patience(work.choices)
        work.settingsChanged.connect(self._relight)
        work.analystStarted.connect(self._restart_questions)
        self._model.ready.connect(self._generator_ready)
        self._model.failed.connect(self._follow_scene)
        self._opening.progressed.connect(self._tell_progress)
        self._order.done.connect(self.sensitivity.ask)
        for client in self._clients:
            client.images.answered.connect(self.sensitivity.follow_image)
            client.settled.connect(self._report_settled)

    def _share_patience(self, choices: ReferenceChoices) -> None:
        """Have all live answers be as fast as the images are to be."""
        patience = STEPS[choices.exactness].patience
        self.sensitivity.allow(patience)
        self.latent.pictures.allow(patience)

    @property
    def opened(self) -> OpenedVolume | None:
        """The open volume; None if there is none."""
        return self._opened

    @property
    def model(self) -> Path | None:
        """Folder of the open model, of this volume or of another one; None without one."""
        return self._model.folder

    @property
    def has_model(self) -> bool:
        """Whether a model is open, of this volume or of another one."""
        return self._model.folder is not None

    @property
    def draws_codes(self) -> bool:
        """Whether the loaded model draws latent codes, as the paper's networks do."""
        return self._model.draws_codes

    @property
    def draws_path(self) -> bool:
        """Whether the generator of path-traced light draws in the model's place."""
        return self._model.draws_path

    @property
    def model_worth(self) -> str:
        """What the open model is worth, as its card has it; empty where that is not known."""
        return self._model.worth

    @property
    def model_lighting(self) -> Lighting:
        """Lighting of the open model's images; none without one."""
        scene = self._model.scene_for(self._opened)
        if self._model.draws_path:
            return "path"
        return "none" if scene is None else scene.lighting

    @property
    def recorded_agreement(self) -> float | None:
        """Median cosine of the model's sensitivities, as its card has it; None if unknown."""
        return self._model.recorded_agreement

    @property
    def is_settled(self) -> bool:
        """True if both images are final or replaced by a message."""
        drawn = all(c in self._dispatcher.plan.hidden or c.is_settled for c in self._clients)
        return drawn and not self._opening.is_busy and not self._ranging.is_busy

    def open_volume(
        self,
        path: Path,
        raw: RawLayout | None = None,
        first_range: RangeChoice | None = None,
        first_scale: ValueScale | None = None,
        choice: Choice | None = None,
        is_remembered: bool = False,
        model: Path | None = None,
        transfer_function: TransferFunction | None = None,
    ) -> None:
        """Read a volume in the background, then show it; keep the old one until then.

        Parameters
        ----------
        raw : RawLayout or None
            Of a file without a header; None for the one in its name.
        first_range : RangeChoice or None
            Scalar range to show it over; None for its model's, its last one, or a robust one.
        first_scale : {"linear", "log"} or None
            Scale to show it on; None for its model's or its last one.
        choice : Choice or None
            What to read of a file that holds several volumes; None for the largest.
        is_remembered : bool
            Whether the choice is an old one, which gives way where the file no longer has it.
        model : Path or None
            Folder of the model to open with it; None for the open one, or one known to be of it.
        transfer_function : TransferFunction or None
            TF to show it under; None for its last one, or a default.
        """
        if self._opened is None:
            self._clients[1].wait(f"Reading {path.name} …")
        else:
            self.news.emit(f"Reading {path.name} …")
        self._first_range, self._first_scale = first_range, first_scale
        self._first_model, self._first_tf = model, transfer_function
        self._reading = path.name
        self.readingStarted.emit(path.name)
        self._opening.read(path, raw, self._volume_read, self._volume_failed, choice, is_remembered)

    def cancel_reading(self) -> None:
        """Give up reading a volume; the open one stays."""
        if self._opening.is_busy:
            self._opening.abandon()
            self._volume_failed(f"{self._reading}: the reading was cancelled.")

    def open_model(self, folder: Path | None) -> None:
        """Load a generator in the background; None for no model."""
        # Asked for later than what was to come with the volume that is read.
        self._first_model = None
        scene = None if folder is None else self.library.scene_of(folder)
        self._model.open(folder, scene, held=self._reference_comes_first())
        self.news.emit(self._model.worth)
        self._follow_scene()

    def fitted(self, transfer_function: TransferFunction) -> TransferFunction:
        """Convert a TF of any origin to one that can be edited here.

        With a model it is over the range that the model was trained on; else it keeps its own
        where that fits the volume.
        """
        if self._opened is None:
            same = transfer_function.on_scale(self._state.scale)
            return fit_to_range(same, self._state.scalar_range)
        volume, scene = self._opened.volume, self._model.fitting_scene(self._opened)
        if transfer_function.is_relative:
            transfer_function = transfer_function.on_scale(volume.scale)
        if transfer_function.scale == volume.scale:
            if scene is not None:
                return fit_to_range(transfer_function, scene.scalar_range)
            if self._first_range is not None:
                return fit_to_range(transfer_function, volume.scalar_range)
        return fit_to_volume(transfer_function, self._opened.volume)

    def kept_tf(self, fingerprint: str) -> TransferFunction | None:
        """Return the TF under which a volume was seen last; None if that is not known."""
        return self._keeper.load(fingerprint)

    def show_images(self, generator: bool, reference: bool) -> None:
        """Say which images are in sight; others are not drawn."""
        seen = zip(self._clients, (generator, reference), strict=True)
        hidden = frozenset(client for client, shown in seen if not shown)
        missed = self._dispatcher.plan.hidden - hidden
        self._dispatcher.change(hidden=hidden)
        if missed and self._opened is not None:
            self._dispatcher.send()

    @property
    def draws_missing(self) -> bool:
        """Whether missing voxels of the open volume are drawn."""
        return self._opened is not None and self._opened.volume.draws_missing

    @property
    def has_missing(self) -> bool:
        """Whether the open volume has missing voxels."""
        return self._opened is not None and self._opened.volume.missing is not None

    def draw_missing(self, drawn: bool) -> None:
        """Draw the open volume's missing voxels, or leave them transparent, as at first."""
        if self._opened is not None and self.has_missing and drawn != self.draws_missing:
            self._preferences.note_volume(self._opened.fingerprint, draws_missing=drawn)
            self._ranging.draw_missing(self._opened, drawn, self._range_taken, self._volume_failed)

    def show_on_scale(self, scale: ValueScale) -> None:
        """Show the open volume on another scale, under its default TF: one undo step."""
        if self._opened is not None and scale != self._opened.volume.scale:
            self._ranging.show_on_scale(self._opened, scale, self._range_taken, self._volume_failed)

    def stop(self) -> None:
        """Ask all threads to end; returns at once."""
        self._order.stop()
        self.reference.stop()
        self.sensitivity.stop()
        self.latent.stop()
        for client in (*self._clients, self._analyst):
            client.stop()
        self._opening.abandon()
        self._ranging.abandon()

    def join(self) -> None:
        """Wait until all threads have ended and everything is written."""
        self._keeper.finish()
        own = self.reference, self.latent, self._opening, self._ranging
        for part in (*self._clients, self._analyst, *own):
            part.join()

    def _volume_read(self, opened: OpenedVolume) -> None:
        """Show a volume that was read, with its missing voxels if they were drawn the last time."""
        self.readingEnded.emit()
        self.volumeRead.emit(opened)
        known = self._preferences.volume(opened.fingerprint)
        if known.draws_missing and opened.volume.missing is not None:
            show, failed = self._show_over_wanted, partial(self._show_nevertheless, opened)
            self._opening.draw_missing(opened, True, show, failed)
        else:
            self._show_over_wanted(opened)

    def _show_nevertheless(self, opened: OpenedVolume, text: str) -> None:
        self._show_over_wanted(opened)
        self.problem.emit(text)

    def _show_over_wanted(self, opened: OpenedVolume) -> None:
        """Show a volume; first compute it over another range if one is wanted."""
        kept = self._first_tf or self._keeper.load(opened.fingerprint)
        show = partial(self._volume_opened, kept)
        try:
            wanted, scale = self._wanted_range(opened, kept)
        except TfscopeError as error:
            self.problem.emit(str(error))
            wanted, scale = opened.volume.scalar_range, opened.volume.scale
        if (wanted, scale) == (opened.volume.scalar_range, opened.volume.scale):
            show(opened)
            return

        def show_as_read(text: str) -> None:
            show(opened)
            self.problem.emit(text)

        self._opening.show_over(opened, wanted, scale, show, show_as_read)

    def _wanted_range(
        self, opened: OpenedVolume, kept: TransferFunction | None
    ) -> tuple[Range, ValueScale]:
        """Range to show a volume over at first, and on which scale.

        The scale of the TF that is kept of it comes before that of a model.
        """
        volume = opened.volume
        if self._first_scale is not None and self._first_scale != volume.scale:
            volume = volume.on_scale(self._first_scale)
            volume = volume.over(robust_range(volume))
        if self._first_range is not None:
            return self._first_range.of(volume), volume.scale
        if self._first_scale is not None:
            return volume.scalar_range, volume.scale
        folder = self._model_for(opened)
        scene = self._model.scene if folder == self._model.folder else None
        if scene is None and folder is not None:
            scene = self.library.scene_of(folder)
        belongs = scene is not None and scene.volume_fingerprint == opened.fingerprint
        if scene is not None and belongs and (kept is None or kept.scale == scene.scale):
            return scene.scalar_range, scene.scale
        if kept is None:
            return volume.scalar_range, volume.scale
        fitted = fit_to_volume(kept, volume)
        return fitted.scalar_range, fitted.scale

    def _model_for(self, opened: OpenedVolume) -> Path | None:
        """Model to show with a volume: the open one, or one that is known to be of it.

        One that was asked for with it comes first. A model gives way if it was of the volume
        before; one that waits for its own stays.
        """
        if self._first_model is not None:
            return self._first_model
        model = self._model.folder
        if model is not None:
            scene = self._model.scene or self.library.scene_of(model)
            fits = scene is None or scene.volume_fingerprint == opened.fingerprint
            if fits or self._model.scene_for(self._opened) is None:
                return model
        known = self.library.models_of(opened.fingerprint)
        return known[0].folder if known else None

    def _volume_opened(self, kept: TransferFunction | None, opened: OpenedVolume) -> None:
        self._ranging.abandon()
        self._is_restored = kept is not None
        # What they preview belongs to the volume before.
        self.latent.search.cancel()
        self.latent.path.cancel()
        folder = self._model_for(opened)
        self._opened = opened
        # What other windows have kept of it meanwhile.
        self._preferences.refresh()
        self._marks.start(opened)
        self.latent.session.start_volume(opened.volume, opened.window)
        if folder != self._model.folder:
            self.open_model(folder)
        self.reference.start(opened.volume, self._model.scene_for(opened))
        self._follow_scene()
        notes = [
            *opened.volume.notes,
            opened.volume.missing_text,
            self._model.worth,
            RESTORED if kept is not None and self._first_tf is None else "",
        ]
        self.news.emit(" ".join(filter(None, notes)))
        self._dispatcher.change(scale=opened.volume.scale)
        volume, (view, crop) = opened.volume, self._looks.start(opened.fingerprint)
        up = self._preferences.volume(opened.fingerprint).up_axis or volume.up
        self._state.start_view(
            volume.proportions,
            up,
            volume.axis_labels,
            view or volume.file.view,
            opened.shown,
            self.reference.reach,
        )
        self.volumeOpened.emit(opened)
        self._preferences.note_volume(opened.fingerprint, opened.path)
        self._note_model()
        # After the engines: it requests the images, which they then take up.
        self._state.start_volume(opened.default, kept, crop)
        if self._first_tf is not None:
            self._first_tf = None
            self._keep()
        self.volumeStarted.emit()

    def _tell_progress(self, what: str, done: int, count: int) -> None:
        if not self._opening.is_busy:
            # Told before it was cancelled.
            return
        text = f"Reading {self._reading}: {done} of {count} {what} …"
        self.news.emit(text)
        if self._opened is None:
            self._clients[1].wait(text)

    def _volume_failed(self, text: str) -> None:
        self.readingEnded.emit()
        if self._opened is None:
            self._clients[1].fail(text)
            self._generator.pause(NO_VOLUME)
        else:
            self.news.emit("")
            self.problem.emit(text)
            self._report_settled()

    def _follow_range(self, transfer_function: TransferFunction) -> None:
        """Show the volume over the TF's range and scale once these have been changed."""
        wanted, scale, opened = (
            transfer_function.scalar_range,
            transfer_function.scale,
            self._opened,
        )
        if opened is None:
            return
        self._ranging.abandon()
        if (wanted, scale) != (opened.volume.scalar_range, opened.volume.scale):
            self._ranging.show_over(opened, wanted, scale, self._range_taken, self._volume_failed)

    def _range_taken(self, opened: OpenedVolume) -> None:
        is_rescaled = self._opened is None or self._opened.volume.scale != opened.volume.scale
        self._opened = opened
        self._dispatcher.change(scale=opened.volume.scale)
        self.latent.session.start_volume(opened.volume, opened.window)
        self.reference.start(opened.volume, self._model.scene_for(self._opened))
        if is_rescaled:
            self._state.set_default(opened.default)
            self.scaleChanged.emit(opened)
            if self._state.scale != opened.volume.scale:
                self._state.tf_input.set(opened.default, SCALE_EDITS[opened.volume.scale])
            self.news.emit(_scale_news(opened.volume))
        self._follow_scene()
        self.rangeChanged.emit(opened)
        self._dispatcher.send()

    def _generator_ready(self) -> None:
        before = self._dispatcher.plan.raster
        self._follow_scene()
        self._note_model()
        scene, tf = self._model.scene_for(self._opened), self._state.transfer_function
        if self._model.draws_path:
            # What draws now takes any range and scale.
            scene = None
        is_alike = scene is not None and tf.scale == scene.scale
        if scene is not None and is_alike and tf.scalar_range != scene.scalar_range:
            self._state.tf_input.set(fit_to_range(tf, scene.scalar_range), "range of the model")
        elif scene is not None and not is_alike and self._opened is not None and self._is_untouched:
            # As if the model had been there before the volume.
            wanted = scene.scalar_range, scene.scale
            self._ranging.show_over(self._opened, *wanted, self._range_taken, self._volume_failed)
        self._dispatcher.send(generator_only=before == self._dispatcher.plan.raster)

    @property
    def _is_untouched(self) -> bool:
        """Whether the volume's range and scale are none that anybody chose."""
        chosen = self._first_range, self._first_scale
        is_default = self._state.transfer_function == self._state.default_transfer_function
        return not self._is_restored and chosen == (None, None) and is_default

    def _note_model(self) -> None:
        """Remember a model that belongs to the volume."""
        scene = self._model.scene_for(self._opened)
        if scene is not None and self._model.folder is not None and self._model.scene is not None:
            self._preferences.note_model(self._model.folder, scene.volume_fingerprint)

    def _follow_scene(self) -> None:
        """Adapt the generator to the volume, and the reference and the panels to the generator."""
        self.reference.follow(self._model.scene_for(self._opened))
        self._follow_light()
        self._model.match(self._opened, self._opening.is_busy)
        scene = self._model.fitting_scene(self._opened)
        learned_size = None if scene is None else scene.image_size
        self.sensitivity.set_learned(learned_size)
        self.latent.set_model(
            None if scene is None else self._model.folder, learned_size, self._model.draws_codes
        )
        self.decoded.set_model(scene is not None and self._model.draws_codes)
        self._update_hint()
        # Last, so that whoever listens finds all of them changed.
        self.modelChanged.emit()

    def _relight(self) -> None:
        """Adapt the generator and the panels to another light of the reference."""
        before = self._model.draws_path
        self.latent.pictures.trace(self.reference.settings.lighting == "path")
        self._follow_light()
        if self._model.draws_path != before:
            self._follow_scene()
        self._update_hint()

    def _follow_light(self) -> None:
        self._model.follow_light(self._opened, self.reference.settings)
        self._dispatcher.change(generator_follows=self._model.draws_path)

    def _restart_questions(self) -> None:
        """Ask the analyst everything anew."""
        if self._opened is not None:
            lighting = self.reference.settings.lighting
            source: Source = "exact" if lighting in EXACT_LIGHTINGS else "stand-in"
            self.sensitivity.start_volume(self._opened.window, source, lighting == "shadows")
            self.sensitivity.ask()
            self.latent.restart()

    def _keep(self) -> None:
        """Keep the TF for the next run after every edit, undo and redo."""
        if self._opened is not None:
            self._keeper.keep(self._opened.fingerprint, self._state.transfer_function)

    def _update_hint(self) -> None:
        self.hintChanged.emit(self._hint())

    def _hint(self) -> str:
        lighting = self.reference.settings.lighting
        return self._model.hint(self._opened, self._state.inputs, lighting)

    def _reference_comes_first(self) -> bool:
        """Whether the reference is about to show a picture, which a model would hold up."""
        opening = self._opening.is_busy and self._clients[1] not in self._dispatcher.plan.hidden
        return opening or (self._opened is not None and self._draws_reference())

    def _draws_reference(self) -> bool:
        return (
            self._clients[1] not in self._dispatcher.plan.hidden and not self._clients[1].is_settled
        )

    def _report_settled(self) -> None:
        if self.is_settled:
            self.settled.emit()


def _scale_news(volume: Volume) -> str:
    """Say on which scale a volume is, and what of it a logarithm leaves out."""
    if volume.scale == "linear":
        return "The scale is linear."
    share = share_without_logarithm(volume.linear.distribution)
    left = (
        f" {100 * share:.2g} % of the voxels are zero or below, and look as the lowest value does."
        if share
        else ""
    )
    return f"The scale is logarithmic.{left}"
