"""The workspace: the open volume and model, and the engines of the two images."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.engines.client import EngineClient
from app.engines.engines import Builders, GeneratorSettings
from app.engines.messages import EngineReady
from app.state.dispatcher import Dispatcher
from app.state.latent_state import LatentState
from app.state.latent_work import LatentWork
from app.state.library import Library
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.reference_work import ReferenceWork
from app.state.sensitivity_answers import Source
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.transfer_function_keeper import TransferFunctionKeeper
from app.state.transfer_function_store import TransferFunctionStore
from app.state.viewer_state import ViewerState
from app.state.volume_opening import VolumeOpening
from model.errors import TfscopeError
from model.networks.card import recorded_agreement, verdict_of
from model.scene.inputs import outside_range
from model.scene.range_choice import RangeChoice
from model.scene.range_fitting import fit_to_range, fit_to_volume, range_of
from model.scene.scene import Lighting, Scene
from model.scene.transfer_function import Range, TransferFunction
from model.volume_files.raw import RawLayout

LIGHTS: dict[Lighting, str] = {
    "none": "no light",
    "direct": "direct light",
    "global": "global light",
}

NO_VOLUME = "Waiting for a volume: open one with File > Open volume."

NO_MODEL = "No model of this volume yet."


class Workspace(QObject):
    """Opens volumes and models, and keeps the engines of both images up to date.

    Parameters
    ----------
    state : ViewerState
    sensitivity : SensitivityState
    latent : LatentState
    generator, reference, analyst : EngineClient
    builders : Builders
        Functions that read volumes and build engines.
    store : TransferFunctionStore or None
        Storage of every volume's TF between runs; None for none.
    preferences : Preferences
        What is remembered of volumes, models and choices.
    generator_settings : GeneratorSettings
        Device, backend and precision of generators.

    Attributes
    ----------
    reference : ReferenceWork
    sensitivity : SensitivityDispatcher
    latent : LatentWork
    library : Library
    """

    volumeRead = Signal()
    """Emitted when a volume has been read: problems from now on are this volume's."""
    volumeOpened = Signal(object)
    """Emitted when the engines draw a volume that was read, before its TF is set."""
    volumeStarted = Signal()
    """Emitted when the TF of an opened volume is set."""
    rangeChanged = Signal(object)
    """Emitted with the :class:`OpenedVolume` when it is over another scalar range."""
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
        analyst: EngineClient,
        builders: Builders,
        store: TransferFunctionStore | None,
        preferences: Preferences,
        generator_settings: GeneratorSettings,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._clients = generator, reference
        self._generator, self._analyst = generator, analyst
        self._builders = builders
        self._preferences = preferences
        self.library = Library(preferences)
        self._keeper = TransferFunctionKeeper(store, self)
        self._keeper.problem.connect(self.problem)
        self._generator_settings = generator_settings
        self._dispatcher = Dispatcher(state, generator, reference, analyst, self)
        self._sensitivity_state = sensitivity
        self.sensitivity = SensitivityDispatcher(state, sensitivity, analyst, generator, self)
        self.latent = LatentWork(state, latent, analyst, generator, builders.latent_space, self)
        self.reference = ReferenceWork(
            state, reference, analyst, builders, self._dispatcher, preferences, self
        )
        self._opening = VolumeOpening(builders.read_volume, self)
        self._ranging = VolumeOpening(builders.read_volume, self)
        self._opened: OpenedVolume | None = None
        self._scene: Scene | None = None
        self._model: Path | None = None
        self._first_range: RangeChoice | None = None
        self._connect()

    def _connect(self) -> None:
        state, work = self._state, self.reference
        for changed in (
            state.viewChanged,
            state.transferFunctionChanged,
            state.lightChanged,
            state.cropChanged,
        ):
            changed.connect(self._update_hint)
        state.transferFunctionChangeFinished.connect(self._follow_range)
        state.edited.connect(self._keep)
        work.news.connect(self.news)
        work.resized.connect(partial(setattr, self.sensitivity.chooser, "picture_size"))
        work.settingsChanged.connect(self._update_hint)
        work.analystStarted.connect(self._restart_questions)
        self._generator.engineReady.connect(self._generator_ready)
        for client in self._clients:
            client.settled.connect(self._report_settled)

    @property
    def opened(self) -> OpenedVolume | None:
        """The open volume; None if there is none."""
        return self._opened

    @property
    def model(self) -> Path | None:
        """Folder of the open model, of this volume or of another one; None without one."""
        return self._model

    @property
    def has_model(self) -> bool:
        """Whether a model is open, of this volume or of another one."""
        return self._model is not None

    @property
    def recorded_agreement(self) -> float | None:
        """Median cosine of the model's sensitivities, as its card has it; None if unknown."""
        return None if self._model is None else recorded_agreement(self._model)

    @property
    def is_settled(self) -> bool:
        """True if both images are final or replaced by a message."""
        hidden = self._dispatcher.hidden
        if self._opening.is_busy or self._ranging.is_busy:
            return False
        return all(client in hidden or client.is_settled for client in self._clients)

    def open_volume(
        self,
        path: Path,
        raw: RawLayout | None = None,
        first_range: RangeChoice | None = None,
    ) -> None:
        """Read a volume in the background, then show it; keep the old one until then.

        Parameters
        ----------
        path : Path
        raw : RawLayout or None
            Of a file without a header; None for the one in its name.
        first_range : RangeChoice or None
            Scalar range to show it over; None for its model's, its last one, or a robust one.
        """
        if self._opened is None:
            self._clients[1].wait(f"Reading {path.name} …")
        else:
            self.news.emit(f"Reading {path.name} …")
        self._first_range = first_range
        self._opening.read(path, raw, self._volume_read, self._volume_failed)

    def open_model(self, folder: Path | None) -> None:
        """Load a generator in the background; None for no model."""
        self._scene = None
        self._model = folder
        if folder is None:
            self._generator.stop()
            self._generator.pause(NO_MODEL)
        else:
            build = partial(self._builders.generator, folder, self._generator_settings)
            self._generator.start(build, "Loading the model …")
            self.news.emit(self._worth())
        self._follow_scene()

    def fitted(self, transfer_function: TransferFunction) -> TransferFunction:
        """Convert a TF of any origin to one that can be edited here.

        With a model it is over the range that the model was trained on; else it keeps its own
        where that fits the volume.
        """
        scene = self._fitting_scene()
        if self._opened is None:
            return fit_to_range(transfer_function, self._state.scalar_range)
        if scene is not None:
            return fit_to_range(transfer_function, scene.scalar_range)
        if self._first_range is not None:
            return fit_to_range(transfer_function, self._opened.volume.scalar_range)
        return fit_to_volume(transfer_function, self._opened.volume)

    def show_images(self, generator: bool, reference: bool) -> None:
        """Say which images are in sight; others are not drawn."""
        seen = zip(self._clients, (generator, reference), strict=True)
        hidden = {client for client, shown in seen if not shown}
        missed = self._dispatcher.hidden - hidden
        self._dispatcher.hidden = hidden
        if missed and self._opened is not None:
            self._dispatcher.send()

    def stop(self) -> None:
        """Ask all threads to end; returns at once."""
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
        for client in (*self._clients, self._analyst):
            client.join()
        self.latent.join()
        self._opening.join()
        self._ranging.join()

    def _volume_read(self, opened: OpenedVolume) -> None:
        """Show a volume that was read; first compute it over another range if one is wanted."""
        self.volumeRead.emit()
        kept = self._keeper.load(opened.fingerprint)
        show = partial(self._volume_opened, kept)
        try:
            wanted = self._wanted_range(opened, kept)
        except TfscopeError as error:
            self.problem.emit(str(error))
            wanted = opened.volume.scalar_range
        if wanted == opened.volume.scalar_range:
            show(opened)
            return

        def show_as_read(text: str) -> None:
            show(opened)
            self.problem.emit(text)

        self._opening.show_over(opened, wanted, show, show_as_read)

    def _wanted_range(self, opened: OpenedVolume, kept: TransferFunction | None) -> Range:
        """Range to show a volume over at first."""
        if self._first_range is not None:
            return self._first_range.of(opened.volume)
        folder = self._model_for(opened)
        scene = self._scene if folder == self._model else None
        if scene is None and folder is not None:
            scene = self.library.scene_of(folder)
        if scene is not None and scene.volume_fingerprint == opened.fingerprint:
            return scene.scalar_range
        return opened.volume.scalar_range if kept is None else range_of(kept, opened.volume)

    def _model_for(self, opened: OpenedVolume) -> Path | None:
        """Model to show with a volume: the open one, or one that is known to be of it.

        A model gives way if it was of the volume before; one that waits for its own stays.
        """
        model = self._model
        if model is not None:
            scene = self._scene or self.library.scene_of(model)
            fits = scene is None or scene.volume_fingerprint == opened.fingerprint
            if fits or not self._matches():
                return model
        known = self.library.models_of(opened.fingerprint)
        return known[0].folder if known else None

    def _volume_opened(self, kept: TransferFunction | None, opened: OpenedVolume) -> None:
        self._ranging.abandon()
        # What they preview belongs to the volume before.
        self.latent.search.cancel()
        self.latent.path.cancel()
        folder = self._model_for(opened)
        self._opened = opened
        self._sensitivity_state.start_volume()
        self.latent.session.start_volume(opened.volume, opened.window)
        if folder != self._model:
            self.open_model(folder)
        self.reference.start(opened.volume, self._matching_scene())
        self._match_generator()
        self._follow_scene()
        self.news.emit(" ".join(filter(None, [*opened.volume.notes, self._worth()])))
        volume, known = opened.volume, self._preferences.volume(opened.fingerprint)
        up = known.up_axis or volume.up
        self._state.start_view(volume.proportions, up, volume.axis_labels)
        self.volumeOpened.emit(opened)
        self._preferences.note_volume(opened.fingerprint, opened.path)
        self._note_model()
        # After the engines: it requests the images, which they then take up.
        self._state.start_volume(opened.default, kept)
        self.volumeStarted.emit()

    def _volume_failed(self, text: str) -> None:
        if self._opened is None:
            self._clients[1].fail(text)
            self._generator.pause(NO_VOLUME)
        else:
            self.news.emit("")
            self.problem.emit(text)
            self._report_settled()

    def _follow_range(self, transfer_function: TransferFunction) -> None:
        """Show the volume over the TF's range once that has been changed."""
        wanted, opened = transfer_function.scalar_range, self._opened
        if opened is None:
            return
        self._ranging.abandon()
        if wanted != opened.volume.scalar_range:
            self._ranging.show_over(opened, wanted, self._range_taken, self._volume_failed)

    def _range_taken(self, opened: OpenedVolume) -> None:
        self._opened = opened
        self.latent.session.start_volume(opened.volume, opened.window)
        self.reference.start(opened.volume, self._matching_scene())
        self._follow_scene()
        self.rangeChanged.emit(opened)
        self._dispatcher.send()

    def _generator_ready(self, ready: EngineReady) -> None:
        self._scene = ready.scene
        self._match_generator()
        self._follow_scene()
        self._note_model()
        scene, tf = self._matching_scene(), self._state.transfer_function
        if scene is not None and tf.scalar_range != scene.scalar_range:
            self._state.commit(fit_to_range(tf, scene.scalar_range), "range of the model")
        self._dispatcher.send()

    def _note_model(self) -> None:
        """Remember a model that belongs to the volume."""
        scene = self._matching_scene()
        if scene is not None and self._model is not None:
            self._preferences.note_model(self._model, scene.volume_fingerprint)

    def _match_generator(self) -> None:
        """Pause the generator unless it was trained on this volume."""
        if self._model is None:
            self._generator.pause(NO_MODEL)
        elif self._scene is not None and self._opened is None:
            if self._opening.is_busy:
                self._generator.pause("Waiting for the volume …", settled=False)
            else:
                self._generator.pause(NO_VOLUME)
        elif self._scene is not None and not self._matches():
            self._generator.pause(
                f"This model was trained on '{self._scene.volume_name}', not on this volume; "
                "open that volume, or a model trained on this one."
            )
        else:
            self._generator.resume()
        self._update_hint()

    def _worth(self) -> str:
        """Verdict on the model, as its card has it; empty where that is not known."""
        return "" if self._model is None else verdict_of(self._model)

    def _matches(self) -> bool:
        """Return True if the model was trained on the open volume."""
        if self._scene is None or self._opened is None:
            return False
        return self._scene.volume_fingerprint == self._opened.fingerprint

    def _matching_scene(self) -> Scene | None:
        """Scene of the model if it was trained on the open volume."""
        return self._scene if self._matches() else None

    def _fitting_scene(self) -> Scene | None:
        """The same, if the TF's range is the one that the model was trained on, too."""
        scene = self._matching_scene()
        if scene is None or self._opened is None:
            return None
        same = scene.scalar_range == self._opened.volume.scalar_range
        return scene if same else None

    def _follow_scene(self) -> None:
        """Adapt the reference and the panels to the generator."""
        self.reference.follow(self._matching_scene())
        scene = self._fitting_scene()
        learned_size = None if scene is None else scene.image_size
        self.sensitivity.set_learned(learned_size)
        self.latent.set_model(None if scene is None else self._model, learned_size)
        self._update_hint()
        # Last, so that whoever listens finds all of them changed.
        self.modelChanged.emit()

    def _restart_questions(self) -> None:
        """Ask the analyst everything anew."""
        if self._opened is not None:
            is_global = self.reference.settings.lighting == "global"
            source: Source = "differences" if is_global else "exact"
            self.sensitivity.start_volume(self._opened.window, source)
            self.sensitivity.ask()
            self.latent.restart()

    def _keep(self) -> None:
        """Keep the TF for the next run after every edit, undo and redo."""
        if self._opened is not None:
            self._keeper.keep(self._opened.fingerprint, self._state.transfer_function)

    def _update_hint(self) -> None:
        hints = []
        scene = self._matching_scene()
        if scene is not None:
            hints.append(outside_range(self._state.inputs, scene))
            trained, drawn = scene.lighting, self.reference.settings.lighting
            if trained != drawn:
                hints.append(f"Trained with {LIGHTS[trained]}; the reference has {LIGHTS[drawn]}")
            lo, hi = scene.scalar_range
            if self._state.scalar_range != (lo, hi):
                hints.append(f"Trained with values from {lo:.5g} to {hi:.5g}; the TF covers others")
        self.hintChanged.emit(". ".join(filter(None, hints)))

    def _report_settled(self) -> None:
        if self.is_settled:
            self.settled.emit()
