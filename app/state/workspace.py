"""The workspace: the open volume and model, and the engines of the two images."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.engines.background import BackgroundCall
from app.engines.client import EngineClient
from app.engines.engines import Builders, GeneratorSettings, ReferenceSettings
from app.engines.messages import EngineReady
from app.state.dispatcher import NO_MODEL_SIZE, Dispatcher
from app.state.latent_state import LatentState
from app.state.latent_work import LatentWork
from app.state.opened_volume import OpenedVolume, open_volume
from app.state.sensitivity_answers import Source
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.transfer_function_keeper import TransferFunctionKeeper
from app.state.transfer_function_store import TransferFunctionStore
from app.state.viewer_state import ViewerState
from model.generator.catalog import model_for
from model.networks.card import recorded_agreement, verdict_of
from model.scene.inputs import outside_range
from model.scene.scene import RendererName, Scene

NO_VOLUME = "Waiting for a volume: open one with File > Open volume."


class Workspace(QObject):
    """Opens volumes and models and keeps the engines of both images up to date.

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
    generator_settings : GeneratorSettings
        Device, backend and precision of generators.
    """

    volumeOpened = Signal(object)
    """Emitted when a volume has been read, before its TF is set."""
    volumeStarted = Signal()
    """Emitted when the TF of an opened volume is set."""
    problem = Signal(str)
    """Emitted with an error sentence for the notice bar."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""
    referenceChanged = Signal(str)
    """Emitted with the name of a newly chosen reference renderer."""
    hintChanged = Signal(str)
    """Emitted with a description of inputs outside the training range; may be empty."""
    modelChanged = Signal()
    """Emitted when a generator fits the volume, or no longer does."""
    lightRangeChanged = Signal(object)
    """Emitted with True when the light becomes movable, with False when fixed."""
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
        generator_settings: GeneratorSettings,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._generator = generator
        self._reference = reference
        self._builders = builders
        self._keeper = TransferFunctionKeeper(store, self)
        self._keeper.problem.connect(self.problem)
        self._generator_settings = generator_settings
        self._dispatcher = Dispatcher(state, (generator, reference), self)
        self._sensitivity_state = sensitivity
        self._analyst = analyst
        self.sensitivity = SensitivityDispatcher(state, sensitivity, analyst, generator, self)
        self.latent = LatentWork(state, latent, analyst, generator, builders.latent_space, self)
        self._opened: OpenedVolume | None = None
        self._scene: Scene | None = None
        self._model: Path | None = None
        self._model_is_shipped = False
        self._settings = ReferenceSettings()
        self._reference_size: int | None = None
        self._reference_renderer: RendererName = "vtk"
        self._reading: BackgroundCall | None = None
        self._calls: list[BackgroundCall] = []
        state.viewChanged.connect(self._update_hint)
        state.transferFunctionChanged.connect(self._update_hint)
        state.lightChanged.connect(self._update_hint)
        state.edited.connect(self._keep)
        generator.engineReady.connect(self._generator_ready)
        for client in (generator, reference):
            client.settled.connect(self._report_settled)

    @property
    def opened(self) -> OpenedVolume | None:
        """The open volume; None if there is none."""
        return self._opened

    @property
    def recorded_agreement(self) -> float | None:
        """Median cosine of the model's sensitivities, as its card has it; None if unknown."""
        return None if self._model is None else recorded_agreement(self._model)

    @property
    def is_settled(self) -> bool:
        """True if both images are final or replaced by a message."""
        hidden = self._dispatcher.hidden is self._generator
        engines_settled = (hidden or self._generator.is_settled) and self._reference.is_settled
        return self._reading is None and engines_settled

    def open_volume(self, path: Path) -> None:
        """Read a volume in the background, then show it; keep the old one until then."""
        if self._reading is not None:
            self._reading.abandon()
        if self._opened is None:
            self._reference.wait(f"Reading {path.name} …")
        else:
            self.news.emit(f"Reading {path.name} …")
        call = BackgroundCall(partial(open_volume, path, self._builders.read_volume), "volume")
        call.done.connect(self._volume_opened)
        call.failed.connect(self._volume_failed)
        call.finished.connect(self._forget_call)
        self._reading = call
        self._calls.append(call)
        call.start()

    def open_model(self, folder: Path | None) -> None:
        """Load a generator in the background; None for no model."""
        self._scene = None
        self._model = folder
        self._model_is_shipped = False
        if folder is None:
            self._generator.stop()
            self._generator.pause(self._no_model_text())
        else:
            build = partial(self._builders.generator, folder, self._generator_settings)
            self._generator.start(build, "Loading the model …")
            self.news.emit(self._worth())
        self._follow_scene()

    def set_reference_size(self, size: int | None) -> None:
        """Set the reference image's size in pixels; None for the generator's."""
        self._reference_size = size
        self._follow_scene()
        self._dispatcher.send()

    def set_reference_renderer(self, name: RendererName) -> None:
        """Set the renderer of the reference image."""
        self._reference_renderer = name
        self.referenceChanged.emit(name)
        self._follow_scene()

    def show_generator(self, shown: bool) -> None:
        """Say whether the generator's image is in sight; otherwise it is not drawn."""
        before, self._dispatcher.hidden = self._dispatcher.hidden, None
        if not shown:
            self._dispatcher.hidden = self._generator
        elif before is not None:
            self._dispatcher.send()

    def stop(self) -> None:
        """Ask all threads to end; returns at once."""
        self.sensitivity.stop()
        self.latent.stop()
        self._generator.stop()
        self._reference.stop()
        self._analyst.stop()
        for call in self._calls:
            call.abandon()

    def join(self) -> None:
        """Wait until all threads have ended and everything is written."""
        self._keeper.finish()
        self._generator.join()
        self._reference.join()
        self._analyst.join()
        self.latent.join()
        for call in self._calls:
            call.join()
            call.deleteLater()
        self._calls.clear()

    def _volume_opened(self, opened: OpenedVolume) -> None:
        self._reading = None
        # What they preview belongs to the volume before.
        self.latent.search.cancel()
        self.latent.path.cancel()
        self._opened = opened
        self._settings = self._wanted_settings()
        self._start_reference()
        self._sensitivity_state.start_volume()
        self.latent.session.start_volume(opened.volume, opened.window)
        self._start_analyst()
        self._open_shipped_model(opened)
        self._match_generator()
        self._follow_scene()
        self.news.emit(" ".join(filter(None, [*opened.volume.notes, self._worth()])))
        self.volumeOpened.emit(opened)
        kept = self._keeper.load(opened.fingerprint)
        # After the engines: it requests the images, which they then take up.
        self._state.start_volume(opened.default, kept)
        self.volumeStarted.emit()

    def _volume_failed(self, text: str) -> None:
        self._reading = None
        if self._opened is None:
            self._reference.fail(text)
            self._generator.pause(NO_VOLUME)
        else:
            self.news.emit("")
            self.problem.emit(text)
            self._report_settled()

    def _generator_ready(self, ready: EngineReady) -> None:
        self._scene = ready.scene
        self._match_generator()
        self._follow_scene()
        self._dispatcher.send()

    def _match_generator(self) -> None:
        """Pause the generator unless it was trained on this volume."""
        if self._model is None:
            self._generator.pause(self._no_model_text())
        elif self._scene is not None and self._opened is None:
            if self._reading is None:
                self._generator.pause(NO_VOLUME)
            else:
                self._generator.pause("Waiting for the volume …", settled=False)
        elif self._scene is not None and not self._matches():
            self._generator.pause(
                f"This model was trained on '{self._scene.volume_name}', not on this volume; "
                "open that volume, or a model trained on this one."
            )
        else:
            self._generator.resume()
        self._update_hint()

    def _open_shipped_model(self, opened: OpenedVolume) -> None:
        """Open the shipped model of a volume, unless the user has chosen a model."""
        if self._model is not None and not self._model_is_shipped:
            return
        folder = model_for(opened.fingerprint)
        if folder != self._model:
            self.open_model(folder)
            self._model_is_shipped = True

    def _worth(self) -> str:
        """Verdict on the model, as its card has it; empty where that is not known."""
        return "" if self._model is None else verdict_of(self._model)

    def _matches(self) -> bool:
        """Return True if the model was trained on the open volume."""
        if self._scene is None or self._opened is None:
            return False
        return self._scene.volume_fingerprint == self._opened.fingerprint

    def _follow_scene(self) -> None:
        """Adapt the reference renderer's settings to the generator's training images."""
        scene = self._scene if self._matches() else None
        size = NO_MODEL_SIZE if scene is None else scene.image_size
        self._dispatcher.size = self._reference_size or size
        self.sensitivity.chooser.picture_size = self._dispatcher.size
        self._offer_light()
        before, settings = self._settings, self._wanted_settings()
        if settings != before:
            self._settings = settings
            self._start_reference()
            if replace(settings, renderer=before.renderer) != before:
                self._start_analyst()
            self._dispatcher.send()
        learned_size = None if scene is None else scene.image_size
        self.sensitivity.set_learned(learned_size)
        self.latent.set_model(None if scene is None else self._model, learned_size)
        # Last, so that whoever listens finds all of them changed.
        self.modelChanged.emit()

    def _offer_light(self) -> None:
        """Make the light movable if the model was trained with a movable light."""
        scene = self._scene if self._matches() else None
        movable = scene is not None and scene.light_range is not None
        if movable != (self._state.light is not None):
            self._state.set_light(scene.light if scene is not None and movable else None)
            self.lightRangeChanged.emit(scene.light_range if scene is not None else None)

    def _wanted_settings(self) -> ReferenceSettings:
        settings = ReferenceSettings()
        if self._scene is not None and self._matches():
            settings = ReferenceSettings.of(self._scene)
        return replace(settings, renderer=self._reference_renderer)

    def _start_reference(self) -> None:
        if self._opened is not None:
            build = partial(self._builders.reference, self._opened.volume, self._settings)
            self._reference.start(build, "Preparing the volume …")

    def _start_analyst(self) -> None:
        if self._opened is not None:
            build = partial(self._builders.analyst, self._opened.volume, self._settings)
            self._analyst.start(build, "Preparing the volume …")
            source: Source = "differences" if self._settings.lighting == "global" else "exact"
            self.sensitivity.start_volume(self._opened.window, source)
            self.sensitivity.ask()
            self.latent.restart()

    def _no_model_text(self) -> str:
        volume = "FILE"
        if self._opened is not None:
            path = self._opened.path.absolute()
            here = Path.cwd()
            volume = str(path.relative_to(here) if path.is_relative_to(here) else path)
        return (
            "No model yet: open one with File > Open model, or train one with\n\n"
            f"python main.py train\n--volume {volume}\n--preset compact --out runs/model"
        )

    def _keep(self) -> None:
        """Keep the TF for the next run after every edit, undo and redo."""
        if self._opened is not None:
            self._keeper.keep(self._opened.fingerprint, self._state.transfer_function)

    def _update_hint(self) -> None:
        hint = ""
        if self._scene is not None and self._matches():
            hint = outside_range(self._state.inputs, self._scene)
        self.hintChanged.emit(hint)

    def _report_settled(self) -> None:
        if self.is_settled:
            self.settled.emit()

    def _forget_call(self) -> None:
        call = self.sender()
        if isinstance(call, BackgroundCall) and call in self._calls:
            self._calls.remove(call)
            call.join()
            call.deleteLater()
