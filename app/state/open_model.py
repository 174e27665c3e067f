"""The open model, and whether it was trained on the open volume."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from app.engines.client import EngineClient
from app.engines.engines import Builders
from app.engines.messages import EngineReady
from app.engines.requests import ReferenceSettings
from app.state.opened_volume import OpenedVolume
from model.generator.catalog import PATH_LIGHT
from model.networks.card import recorded_error, recorded_errors
from model.rendering.path_tracing import denoising
from model.scene.inputs import SceneInputs, outside_range
from model.scene.scene import Lighting, Scene
from model.scene.value_scale import SCALE_NAMES, values_at
from model.scene.volume import Volume

LIGHTS: dict[Lighting, str] = {
    "none": "no light",
    "direct": "direct light",
    "soft": "soft light",
    "path": "path-traced light",
}

NO_VOLUME = "Waiting for a volume. Open one with File > Open."

NO_MODEL = "No model of this volume yet."

UNUSUAL = 1.5
"""Error from which an image counts as outside the training, relative to the mean error of the kind
of TF that the model draws worst."""

LOADING = "Loading the model …"

PATH_DRAWER = "path traced, 1 sample"


class OpenModel:
    """Loads a model in the background, and pauses it while another volume is open."""

    def __init__(self, client: EngineClient, builders: Builders) -> None:
        self._client, self._builders = client, builders
        self.opened: OpenedVolume | None = None  # that is shown
        # Of the open model, whatever its volume; its scene once it is loaded.
        self.folder: Path | None = None
        self.scene: Scene | None = None
        # Whether one path-traced sample, denoised, replaces the model's image because the model
        # knows another light; or will, once the path tracer's kernels are compiled.
        self.draws_path = self.awaits_path = False
        # Whether its image is shown: at first unless path-traced, then as chosen; None before both.
        self.shows_image: bool | None = None
        self._path_scene: tuple[Volume, ReferenceSettings] | None = None
        self._promised: Scene | None = None
        self._is_held = False
        self._kept: list[Any] = []  # the loaded generator, while the path tracer draws

    @property
    def volume(self) -> Volume | None:
        """The open volume."""
        return None if self.opened is None else self.opened.volume

    @property
    def drawer(self) -> str:
        """Name of the renderer; empty if the title says it."""
        name = "" if self.scene is None or self.folder is None else self.folder.name
        return PATH_DRAWER if self.draws_path else name

    @property
    def errors(self) -> str:
        """The model's errors from its card; empty if unknown."""
        if self.draws_path:
            return (
                "The model was trained in another light. This image has one path-traced sample per "
                "pixel, denoised by a network that serves all volumes."
            )
        return "" if self.folder is None or self.awaits_path else recorded_errors(self.folder)

    def is_unusual(self, error: float) -> bool:
        """Whether an image's error is far above those of the model's test images."""
        if self.folder is None or self.draws_path:
            return False
        return error > UNUSUAL * recorded_error(self.folder)

    def open(self, folder: Path | None, promised: Scene | None, held: bool) -> None:
        """Load a model in the background, given the scene of its card; None for no model."""
        self.scene, self._promised = None, promised
        self.folder, self._kept = folder, []
        self._is_held, self.shows_image = folder is not None, self.shows_image or None
        if folder is None:
            self._client.stop()
            self._client.pause(NO_MODEL)
        elif held:
            self._client.wait(LOADING)
        else:
            self.begin()

    def begin(self) -> None:
        """Load the postponed model, if there is one."""
        if self._is_held and self.folder is not None and not self.awaits_path:
            self._is_held = False
            if self._path_scene is not None:
                build = partial(self._builders.reference, *self._path_scene)
            else:
                build = partial(self._builders.generator, self.folder, self._kept)
            self._client.start(build, LOADING)

    def follow_light(self, settings: ReferenceSettings, coming: ReferenceSettings) -> None:
        """Show one denoised sample where the reference is path traced."""
        wanted, has_waited = self._path_of(settings), self.awaits_path
        self.awaits_path = wanted is None and self._path_of(coming) is not None
        if self.shows_image is None and self.volume_scene is not None:
            self.shows_image = wanted is None and not self.awaits_path
        if wanted != self._path_scene:
            self._path_scene, self.draws_path = wanted, wanted is not None
            if not self._is_held:
                self._is_held = True
                self.begin()
        elif has_waited:
            self.begin()

    def _path_of(self, settings: ReferenceSettings) -> tuple[Volume, ReferenceSettings] | None:
        """Return the scene of the path-traced sample; None if the model draws."""
        volume, scene = self.volume, self.volume_scene
        if volume is None or scene is None or scene.lighting == "path":
            return None
        is_clean = settings.denoises and denoising.installed() and PATH_LIGHT.is_file()
        if settings.lighting != "path" or not is_clean:
            return None
        return volume, replace(settings, samples=1)

    @property
    def volume_scene(self) -> Scene | None:
        """Scene of the model, loaded or loading, if it was trained on the open volume."""
        scene, opened = self.scene or self._promised, self.opened
        if scene is None or opened is None:
            return None
        return scene if scene.volume_fingerprint == opened.fingerprint else None

    @property
    def is_foreign(self) -> bool:
        """True if it was trained on another volume than the open one."""
        return None not in (self.scene or self._promised, self.opened) and not self.volume_scene

    @property
    def lighting(self) -> Lighting:
        """Lighting of the generator's images; none without a model of the open volume."""
        scene = self.volume_scene
        if self.draws_path:
            return "path"
        return "none" if scene is None else scene.lighting

    @property
    def fitting_scene(self) -> Scene | None:
        """Scene of a loaded model if the volume is shown over the model's range, too."""
        scene, opened = self.volume_scene, self.opened
        if scene is None or opened is None or self.scene is None or self.draws_path:
            return None
        shown = opened.volume.scalar_range, opened.volume.scale
        return scene if (scene.scalar_range, scene.scale) == shown else None

    def match(self, is_reading: bool) -> None:
        """Pause the generator unless it was trained on the open volume, or is being loaded."""
        opened = self.opened
        if self.folder is None or (self.scene is not None and self.is_foreign):
            self._client.pause(NO_MODEL)
        elif self.draws_path:
            self._client.resume()
        elif self.scene is not None and opened is None:
            if is_reading:
                self._client.pause("Waiting for the volume …", settled=False)
            else:
                self._client.pause(NO_VOLUME)
        elif self.scene and opened and self.scene.scale != opened.volume.scale:
            self._client.pause(
                f"This model was trained on {SCALE_NAMES[self.scene.scale]}; the TFs here are over "
                f"{SCALE_NAMES[opened.volume.scale]}. ⋯ > Axis > Logarithmic scale changes that."
            )
        else:
            self._client.resume()

    def hint(self, inputs: SceneInputs, drawn: Lighting) -> str:
        """Describe inputs outside the model's training, given the reference's lighting."""
        scene = self.volume_scene
        if scene is None or self.draws_path:
            return ""
        hints = [outside_range(inputs, scene)]
        if scene.lighting != drawn:
            hints.append(
                f"Trained with {LIGHTS[scene.lighting]}; the ground truth has {LIGHTS[drawn]}"
            )
        if inputs.opacity_tf.scale != scene.scale:
            hints.append(f"Trained on {SCALE_NAMES[scene.scale]}")
        elif inputs.opacity_tf.scalar_range != scene.scalar_range:
            trained, present = (
                "{:.5g} to {:.5g}".format(*values_at(places, scene.scale))
                for places in (scene.scalar_range, inputs.opacity_tf.scalar_range)
            )
            hints.append(f"Trained with TFs over {trained}; this one is over {present}")
        return ". ".join(filter(None, hints))

    def take(self, ready: EngineReady) -> None:
        """Note that a model was loaded."""
        if not self.draws_path:
            self.scene = ready.scene

    def has_failed(self) -> bool:
        """Note that the client has failed; return whether it was loading a model."""
        was_promised = self.scene is None and self._promised is not None
        if was_promised:
            self._promised = None
        return was_promised
