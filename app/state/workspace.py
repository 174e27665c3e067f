"""The workspace: the open volume and model, and the engines of the two images."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.background import BackgroundCall
from app.engines.client import EngineClient
from app.engines.engines import Builders, GeneratorSettings, ReferenceSettings
from app.engines.messages import EngineReady, Result, StandInRequest
from app.state.dispatcher import NO_MODEL_SIZE, Dispatcher
from app.state.latent_state import LatentState
from app.state.latent_work import LatentWork
from app.state.opened_volume import OpenedVolume, open_volume
from app.state.reference_choices import ReferenceChoices
from app.state.sensitivity_answers import Source
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.transfer_function_keeper import TransferFunctionKeeper
from app.state.transfer_function_store import TransferFunctionStore
from app.state.viewer_state import ViewerState
from model.generator.catalog import model_for
from model.networks.card import recorded_agreement, verdict_of
from model.rendering.raster import Raster
from model.scene.inputs import outside_range
from model.scene.scene import Lighting, Scene

PANE_REST_MS = 150
"""Pause after the last change of a pane's size before an image is drawn for it."""

LEAST_PANE = 64
"""Fewest pixels of an image's sides, while a pane is not laid out yet."""

SLOW_LIGHT_S = 1.0
"""Time of the ray caster's image from which nobody is given light who has not asked for it."""

LIGHTS: dict[Lighting, str] = {
    "none": "no light",
    "direct": "direct light",
    "global": "global light",
}

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
    choicesChanged = Signal(object)
    """Emitted with the new :class:`ReferenceChoices`."""
    settingsChanged = Signal(object)
    """Emitted with the new :class:`ReferenceSettings`: what the reference is drawn with now."""
    hintChanged = Signal(str)
    """Emitted with a description of inputs outside the training range; may be empty."""
    modelChanged = Signal()
    """Emitted when a generator fits the volume, or no longer does."""
    lightRangeChanged = Signal(object)
    """Emitted with the range in which the light may be moved; None for a fixed one or none."""
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
        self._dispatcher = Dispatcher(state, generator, reference, analyst, self)
        self._sensitivity_state = sensitivity
        self._analyst = analyst
        self.sensitivity = SensitivityDispatcher(state, sensitivity, analyst, generator, self)
        self.latent = LatentWork(state, latent, analyst, generator, builders.latent_space, self)
        self._opened: OpenedVolume | None = None
        self._scene: Scene | None = None
        self._model: Path | None = None
        self._model_is_shipped = False
        self._settings = ReferenceSettings()
        self.choices = ReferenceChoices()
        self._pane_pixels = NO_MODEL_SIZE, NO_MODEL_SIZE
        self._pane_rest = QTimer(self, singleShot=True, interval=PANE_REST_MS)
        self._pane_rest.timeout.connect(self._take_pane_size)
        self._light_is_slow = False
        self._reading: BackgroundCall | None = None
        self._calls: list[BackgroundCall] = []
        state.viewChanged.connect(self._update_hint)
        state.transferFunctionChanged.connect(self._update_hint)
        state.lightChanged.connect(self._update_hint)
        state.edited.connect(self._keep)
        state.cropChanged.connect(self._update_hint)
        generator.engineReady.connect(self._generator_ready)
        analyst.resultReady.connect(self._judge_light)
        for client in (generator, reference):
            client.settled.connect(self._report_settled)

    @property
    def opened(self) -> OpenedVolume | None:
        """The open volume; None if there is none."""
        return self._opened

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
        clients = (self._generator, self._reference)
        return self._reading is None and all(c in hidden or c.is_settled for c in clients)

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

    def choose(self, **changes: object) -> None:
        """Change some of the :class:`ReferenceChoices`, by name."""
        choices = replace(self.choices, **changes)  # type: ignore[arg-type]
        if choices != self.choices:
            resized = choices.size != self.choices.size
            redrawn = choices.drawing != self.choices.drawing
            self.choices = choices
            self.choicesChanged.emit(choices)
            self._follow_scene()
            if resized or redrawn:
                self._dispatcher.send()

    def set_pane_pixels(self, width: int, height: int) -> None:
        """Say how many pixels the reference's pane has; images follow once it rests."""
        self._pane_pixels = max(width, LEAST_PANE), max(height, LEAST_PANE)
        # Until a volume is open, it is the first layout of the window.
        if self._opened is None:
            self._take_pane_size()
        else:
            self._pane_rest.start()

    def show_images(self, generator: bool, reference: bool) -> None:
        """Say which images are in sight; others are not drawn."""
        seen = ((self._generator, generator), (self._reference, reference))
        hidden = {client for client, shown in seen if not shown}
        missed = self._dispatcher.hidden - hidden
        self._dispatcher.hidden = hidden
        if missed and self._opened is not None:
            self._dispatcher.send()

    def stop(self) -> None:
        """Ask all threads to end; returns at once."""
        self._pane_rest.stop()
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
        self._light_is_slow = False
        self._dispatcher.forget_times()
        self._settings = self._wanted_settings()
        self._start_reference()
        self._sensitivity_state.start_volume()
        self.latent.session.start_volume(opened.volume, opened.window)
        self._start_analyst()
        self._open_shipped_model(opened)
        self._match_generator()
        self._follow_scene()
        self.news.emit(" ".join(filter(None, [*opened.volume.notes, self._worth()])))
        volume = opened.volume
        self._state.start_view(volume.proportions, volume.up, volume.axis_labels)
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
        before, settings = self._settings, self._wanted_settings()
        self._settings = settings
        self._size_images()
        self._offer_light()
        self.settingsChanged.emit(settings)
        if settings != before:
            self._dispatcher.forget_times()
            self._start_reference()
            if replace(settings, renderer=before.renderer) != before:
                self._start_analyst()
            self._dispatcher.send()
        learned_size = None if scene is None else scene.image_size
        self.sensitivity.set_learned(learned_size)
        self.latent.set_model(None if scene is None else self._model, learned_size)
        # Last, so that whoever listens finds all of them changed.
        self.modelChanged.emit()

    def _size_images(self) -> None:
        """Choose the number of pixels of the reference."""
        scene = self._scene if self._matches() else None
        size, dispatcher = self.choices.size, self._dispatcher
        if size == "generator" and scene is not None:
            size = scene.image_size
        dispatcher.is_fixed = isinstance(size, int)
        dispatcher.raster = (
            Raster(size, size) if isinstance(size, int) else Raster(*self._pane_pixels)
        )
        dispatcher.may_stand_in = (
            self.choices.drawing == "auto" and self._settings.lighting != "global"
        )
        self.sensitivity.chooser.picture_size = dispatcher.size

    def _take_pane_size(self) -> None:
        before = self._dispatcher.raster
        self._size_images()
        if self._dispatcher.raster != before and self._opened is not None:
            self._dispatcher.send()

    def _offer_light(self) -> None:
        """Make the light movable where it may be, and keep its direction where it was."""
        scene = self._scene if self._matches() else None
        limits = self.choices.light_range(scene, self._settings)
        if (limits is None) != (self._state.light is None):
            self._state.set_light(None if limits is None else self._settings.light)
        self.lightRangeChanged.emit(limits)

    def _judge_light(self, result: Result) -> None:
        """Turn off a light that nobody has chosen where it takes too long."""
        is_whole = isinstance(result.request, StandInRequest) and not result.request.quality.live
        unasked = self.choices.lighting == "auto" and not self._matches()
        lit = self._settings.lighting != "none"
        if is_whole and unasked and lit and result.seconds > SLOW_LIGHT_S:
            self._light_is_slow = True
            self._follow_scene()
            self.news.emit(
                f"Drawn without light, which takes {result.seconds:.1f} s an image here; "
                "choose Light above the image to have it."
            )

    def _wanted_settings(self) -> ReferenceSettings:
        scene = self._scene if self._matches() else None
        return self.choices.settings(scene, self._light_is_slow)

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
        hints = []
        if self._scene is not None and self._matches():
            hints.append(outside_range(self._state.inputs, self._scene))
            trained, drawn = self._scene.lighting, self._settings.lighting
            if trained != drawn:
                hints.append(f"Trained with {LIGHTS[trained]}; the reference has {LIGHTS[drawn]}")
        self.hintChanged.emit(". ".join(filter(None, hints)))

    def _report_settled(self) -> None:
        if self.is_settled:
            self.settled.emit()

    def _forget_call(self) -> None:
        call = self.sender()
        if isinstance(call, BackgroundCall) and call in self._calls:
            self._calls.remove(call)
            call.join()
            call.deleteLater()
