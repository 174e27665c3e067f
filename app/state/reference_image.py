"""The reference image: the engines that draw it and answer questions about it."""

from dataclasses import replace
from functools import partial
from typing import Any, get_args

from PySide6.QtCore import QObject, Qt, Signal

from app.engines.background import Pause
from app.engines.client import Clients, EngineState
from app.engines.engines import Builders
from app.engines.exactness import STOPS, Stop
from app.engines.messages import Result
from app.engines.requests import ReferenceSettings
from app.state.edited_tf import PaneName, other_pane
from app.state.image_errors import TradeOff
from app.state.image_scheduler import NO_MODEL_SIZE, ImageScheduler
from app.state.preferences import Preferences
from app.state.preparation import Preparation
from app.state.reference_choices import ReferenceChoices, quiet_seconds, slow_lights
from app.state.settings import ImageSettings, LightingChoice, LookOfB, part_of
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.region import SQUARE, Reach
from model.scene.scene import LightDirection, Lighting, Scene
from model.scene.volume import Volume
from model.volume_files.shipped import sample_of

PANE_REST_MS = 150  # pause after the last change of a pane's size before an image is drawn for it
FIRST_REST_MS = 1000  # pause after a first picture in quicker light before path-traced ones follow
LEAST_PANE = 64  # fewest pixels of an image's sides, while a pane is not laid out yet

PREPARING = "Preparing the volume …"


class ReferenceImage(QObject):
    """Draws the reference by the user's choices and, next to a model, as it was trained."""

    choicesChanged = Signal(object)  # emitted with the new :class:`ReferenceChoices`
    settingsChanged = Signal(object)  # emitted with the new :class:`ReferenceSettings`
    lightRangeChanged = Signal(object)  # emitted with the range of the light, or None
    analystReplaced = Signal()
    """Emitted when the analyst restarts or waits for kernels: old answers are invalid."""
    resized = Signal(object)  # emitted with the :class:`Raster` of the image
    lightTooSlow = Signal(float)  # emitted with the seconds of a lit image that is too slow

    def __init__(
        self,
        state: ViewerState,
        clients: Clients,
        builders: Builders,
        scheduler: ImageScheduler,
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._reference, self._analyst = clients.reference, clients.analyst
        self._builders, self._scheduler, self._preferences = builders, scheduler, preferences
        self._volume: Volume | None = None
        self._scene: Scene | None = None
        self.choices = ReferenceChoices(**vars(part_of(preferences.settings, ImageSettings)))
        # Settings of the reference now, and once all kernels are compiled.
        self.settings = self.wanted = ReferenceSettings()
        self.settings_b = self.wanted_b = ReferenceSettings()
        self._answering = self.settings  # of the analyst
        # Whether the first image is shown, or none will be: until then nothing else may take the
        # processor.
        self.has_drawn = self._analyst_waits = False
        # Seconds per image in each light, and lights whose first image is drawn.
        self._light_seconds: dict[Lighting, float] = {}
        self._loaded: set[Lighting] = set()
        # Whether all pixels are drawn, whatever the time.
        self.is_patient = False
        # Whether the home view is still adapted to the pane's size.
        self.fits_view = True
        self._pane_pixels = NO_MODEL_SIZE, NO_MODEL_SIZE
        self._pane_rest = Pause(self, PANE_REST_MS, self._take_pane_size)
        # Queued, because during an opening the view is still the previous volume's.
        self.resized.connect(self._fit_home, Qt.ConnectionType.QueuedConnection)
        self.trade_off = TradeOff(state, clients.reference, self)
        # The light that a shipped volume was given with its TF.
        self.designed_light: LightDirection | None = None
        self.preparation = Preparation(self)
        self.preparation.prepared.connect(self._take_prepared)
        clients.reference.images.answered.connect(self._take_image)
        clients.reference.settled.connect(self._take_first)
        clients.reference.stateChanged.connect(self._note_failure)
        self.preparation.progressed.connect(self._say_time)
        # Reason that VTK does not draw until the ray caster's first kernel is compiled.
        self._vtk_problem = ""
        self._is_first = False
        self._first_rest = Pause(self, FIRST_REST_MS, self._end_first)
        self._asked_lighting: LightingChoice | None = None
        state.tf_input.paneChanged.connect(self.follow_panes)

    @property
    def is_preparing(self) -> bool:
        """Whether an image is not as wanted until kernels are compiled."""
        return (self.settings, self.settings_b) != (self.wanted, self.wanted_b)

    @property
    def edited(self) -> ReferenceSettings:
        """Settings of the pane with the focus, for the analyst."""
        return self.settings_b if self._state.tf_input.pane == "B" else self.settings

    def choices_of(self, pane: PaneName) -> ReferenceChoices:
        """Return the choices of A or B."""
        own = vars(self._state.tf_input.look) if pane == "B" else {}
        return replace(self.choices, **{name: each for name, each in own.items() if each})

    @property
    def slow_lights(self) -> frozenset[Lighting]:
        """Lights that are too slow here."""
        return slow_lights(self._light_seconds)

    @property
    def reach(self) -> Reach:
        """Reach that the home view fits: the whole image's, or that of a model's square image."""
        return self._scheduler.raster.reach if self._scene is None else SQUARE

    def resting_distance(self, stop: Stop) -> float:
        """Return the sample distance of images at rest at a stop, in voxels."""
        settings = replace(self.choices, stop=stop).settings(self._scene, self.slow_lights)
        by_raycast = settings.renderer == "raycast" or self._reference.by_raycast
        return settings.smooth_distance if by_raycast else settings.sample_distance

    @property
    def raster(self) -> Raster:
        """The pixels of an image at rest."""
        return self._scheduler.raster

    def choose(self, keep: bool = True, **changes: Any) -> None:
        """Change some of the :class:`ReferenceChoices`, by name.

        A lighting belongs to the open volume or, without one, to the next. With `keep`, choices are
        stored for the next run, and a change of lighting or renderer can be undone.
        """
        if self._volume is None:
            self._asked_lighting = changes.get("lighting", self._asked_lighting)
        choices = replace(self.choices, **changes)
        lighting, tf_input = self.choices.lighting, self._state.tf_input
        is_shared = keep and tf_input.compares and tf_input.look.lighting is None
        if is_shared and choices.lighting != lighting:
            # B keeps the light that it has.
            tf_input.look = replace(tf_input.look, lighting=lighting)
        before, after = (LookOfB(each.lighting, each.drawing) for each in (self.choices, choices))
        if keep and self._volume is not None and before != after:
            self._state.edits.change(
                lambda shown: self._choose(replace(self.choices, **vars(shown)), keep=True),
                before,
                after,
                "renderer" if choices.lighting == lighting else "kind of light",
            )
        self._choose(choices, keep)

    def choose_look(self, **look: Any) -> None:
        """Choose `lighting` or renderer (`drawing`) of the pane with the focus."""
        tf_input = self._state.tf_input
        if tf_input.pane == "A":
            self.choose(**look)
        else:
            self._is_first = False
            name = "kind of light of B" if "lighting" in look else "renderer of B"
            tf_input.set_look(replace(tf_input.look, **look), name)

    def copy(self, source: PaneName) -> None:
        """Copy a pane's TF, light and renderer to the other one, which gets the focus."""
        choices, light = self.choices_of(source), self._state.inputs_of(source).light
        with self._state.edits.as_one(f"copy {source} to {other_pane(source)}"):
            self._state.tf_input.copy(source)
            # B's follows A's again.
            self._state.light_input.set(None if source == "A" else light)
            self.choose_look(lighting=choices.lighting, drawing=choices.drawing)

    def swap(self) -> None:
        """Exchange TFs, lights and renderers of A and B."""
        a, b = self.choices, self.choices_of("B")
        light_a, light_b = (self._state.inputs_of(pane).light for pane in get_args(PaneName))
        with self._state.edits.as_one("swap A and B"):
            self._state.tf_input.swap()
            if light_a != light_b:
                self._state.edited["light"].set(light_b)
                self._state.edited["light_b"].set(light_a)
            self.choose(lighting=b.lighting, drawing=b.drawing)
            self._state.tf_input.set_look(LookOfB(a.lighting, a.drawing), "look of B")

    def _choose(self, choices: ReferenceChoices, keep: bool) -> None:
        if choices == self.choices:
            return
        before, self.choices = self.choices, choices
        is_resized = choices.reference_size != before.reference_size
        redrawn = is_resized or choices.drawing != before.drawing
        relit = choices.lighting != before.lighting
        if relit and self._volume is not None:
            self._is_first = False
        if keep:
            if relit and self._volume is not None:
                self._preferences.note_volume(self._volume.fingerprint, lighting=choices.lighting)
            self._preferences.set(**vars(part_of(choices, ImageSettings)))
        self.choicesChanged.emit(choices)
        self.follow(self._scene)
        if redrawn:
            self._scheduler.send()
        elif choices.stop != before.stop and self._volume is not None:
            self._scheduler.show_trade_off()

    def start(self, volume: Volume, scene: Scene | None, proposed: LightingChoice = "auto") -> None:
        """Draw another volume, in its remembered light or else the proposed one."""
        before, self._volume, self._scene = self._volume, volume, scene
        is_new = before is None or volume.voxels is not before.voxels
        if is_new:
            known = self._preferences.volume(volume.fingerprint).light_seconds
            self._light_seconds, self._loaded = dict(known), set()
            self._vtk_problem = ""
            self._is_first = self._reference not in self._scheduler.hidden
            self._first_rest.stop()
            sample = sample_of(volume)
            self.designed_light = None if sample is None else sample.light
            self._take_light(before, proposed)
            # With a model that comes or goes, the pane's size changes.
            self.follow_pane()
        self._take_settings()
        # Over another range, the last image stays until the first new one.
        self._start_reference(PREPARING if is_new else "")
        self._start_analyst()

    def follow(self, scene: Scene | None) -> None:
        """Adapt to the model next to it, to the choices, and to look, focus and presence of B."""
        if (scene is None) != (self._scene is None):
            self.follow_pane()
        self._scene = scene
        before, before_b, answering = self.settings, self.settings_b, self._answering
        self._take_settings()
        if self._volume is None:
            return
        if self.settings != before:
            # Of the same volume: its last image stays until the first new one.
            self._start_reference("")
        by = {name: getattr(answering, name) for name in ("renderer", "passes", "is_truth")}
        if replace(self.edited, **by) != answering:
            self._start_analyst()
        if (self.settings, self.settings_b) != (before, before_b):
            self._scheduler.send()

    def follow_panes(self) -> None:
        """Adapt to which images are visible."""
        self.follow(self._scene)

    def set_pane_pixels(self, width: int, height: int) -> None:
        """Set the pane's pixels; images follow once they stop changing."""
        self._pane_pixels = max(width, LEAST_PANE), max(height, LEAST_PANE)
        # Before a volume is open, this is the window's first layout.
        if self._volume is None:
            self._take_pane_size()
        else:
            self._pane_rest.start()

    def stop(self) -> None:
        """Stop following the pane, and stop preparing kernels."""
        self._pane_rest.stop()
        self._first_rest.stop()
        self.preparation.stop()

    def _take_light(self, before: Volume | None, proposed: LightingChoice) -> None:
        """Take the light in which the volume was last shown; the next time step keeps it."""
        assert self._volume is not None
        known = self._preferences.volume(self._volume.fingerprint)
        is_alike = before is not None and before.series == self._volume.series
        if is_alike and (known.lighting, known.light) == ("auto", None):
            return
        lighting, self._asked_lighting = self._asked_lighting or known.lighting, None
        lighting = proposed if lighting == "auto" else lighting
        self.choices = replace(self.choices, lighting=lighting)
        self.choicesChanged.emit(self.choices)
        self._state.start_light(None)

    def _take_settings(self) -> None:
        wanted = self.wanted, self.wanted_b = self._wanted_of("A"), self._wanted_of("B")
        if self._volume is not None:
            # A's comes first.
            groups = [each for one in wanted for each in self._builders.kernels(self._volume, one)]
            self.preparation.want(tuple(dict.fromkeys(groups)))
        self.settings, self.settings_b = map(self._nearest, wanted)
        is_alike = self.settings_b == self.settings
        if is_alike and self._scheduler.settings_b is not None:
            self._reference.free()
        self._scheduler.settings_b = None if is_alike else self.settings_b
        self._size_images()
        self._offer_light()
        self.settingsChanged.emit(self.settings)

    def _wanted_of(self, pane: PaneName) -> ReferenceSettings:
        shown = pane if self._state.tf_input.compares else "A"
        wanted = self.choices_of(shown).settings(self._scene, self.slow_lights)
        # Where no model's image is compared with it, the faster and finer renderer stays.
        scene, is_compared = self._scene, self._scheduler.shows_generator
        is_truth = wanted.is_truth and is_compared
        as_trained = is_compared and scene is not None and scene.lighting == wanted.lighting
        smooths = (
            self._volume is not None
            and self._volume.has_thick_slices
            and not (is_truth or as_trained)
            and wanted.renderer == "auto"
            and wanted.lighting != "path"
        )
        return replace(wanted, is_truth=is_truth, smooths=smooths)

    def _size_images(self) -> None:
        size, scheduler = self.choices.reference_size, self._scheduler
        if size == "generator" and self._scene is not None:
            size = self._scene.image_size
        scheduler.is_fixed = self.is_patient or isinstance(size, int)
        scheduler.raster = Raster(*((size, size) if isinstance(size, int) else self._pane_pixels))
        scheduler.stop = STOPS[self.choices.stop]
        self.resized.emit(scheduler.raster)

    def follow_pane(self) -> None:
        """Adapt the home view to the pane until the pane's size is stable."""
        self.fits_view = True
        self._pane_rest.start()

    def _take_pane_size(self) -> None:
        before = self._scheduler.raster
        self._size_images()
        self._fit_home()
        self.fits_view = False
        if self._scheduler.raster != before and self._volume is not None:
            self._scheduler.send()

    def _offer_light(self) -> None:
        """Make the light movable if it may be, and keep its direction."""
        ranges = (
            self.choices.light_range(self._scene, each) for each in (self.settings, self.settings_b)
        )
        limits = next(filter(None, ranges), None)
        if (limits is None) != (self._state.light is None):
            fingerprint = "" if self._volume is None else self._volume.fingerprint
            kept = self._preferences.volume(fingerprint).light
            chosen = kept or self.designed_light or self.settings.light or self.settings_b.light
            place = limits.nearest(chosen) if limits is not None and chosen is not None else None
            self._state.start_light(place)
        self.lightRangeChanged.emit(limits)

    def _fit_home(self) -> None:
        self._state.set_reach(self.reach, follow=self.fits_view)

    def _take_image(self, result: Result) -> None:
        """Measure a light once; replace an automatic light that is too slow."""
        lighting = self.settings.lighting
        seconds = quiet_seconds(lighting, result)
        if seconds is not None and lighting not in self._light_seconds:
            # The first image includes loading.
            if lighting in self._loaded and not self.preparation.text:
                self._note_seconds(lighting, seconds)
            self._loaded.add(lighting)
        self._take_first()

    def _note_seconds(self, lighting: Lighting, seconds: float) -> None:
        assert self._volume is not None
        self._light_seconds[lighting] = seconds
        known = dict(self._light_seconds)
        self._preferences.note_volume(self._volume.fingerprint, light_seconds=known)
        is_slow = lighting in self.slow_lights
        if is_slow and self.choices.lighting == "auto" and self._scene is None:
            self.follow(None)
            if self.settings.lighting == "none":
                self.lightTooSlow.emit(seconds)

    def _nearest(self, wanted: ReferenceSettings) -> ReferenceSettings:
        """Return the settings nearest to the wanted ones that need no compiling."""
        lighting = wanted.lighting
        by_vtk: Lighting = "none" if lighting == "none" else "direct"
        if wanted.renderer == "vtk" and by_vtk == lighting:
            return wanted
        others: tuple[Lighting, ...] = (by_vtk,)
        if lighting == "path" and (self._vtk_problem or self._is_first):
            others = "soft", by_vtk
        # The first path-traced picture takes seconds.
        late = lighting == "path" and self._is_first
        for other in (*others, lighting) if late else (lighting, *others):
            settings = replace(wanted, lighting=other, passes=other != lighting)
            if self._are_prepared(settings, images_only=True):
                return settings
        return replace(wanted, lighting=by_vtk, renderer="vtk", passes=True)

    @property
    def _is_vtk_for_now(self) -> bool:
        """Whether VTK draws because other renderers' kernels are not compiled."""
        return self.settings.passes and self.settings.renderer == "vtk"

    def _are_prepared(self, settings: ReferenceSettings, images_only: bool = False) -> bool:
        if self._volume is None:
            return True
        groups = self._builders.kernels(self._volume, settings)
        asked = [group for group in groups if group.purpose == "images" or not images_only]
        return all(map(self.preparation.is_prepared, asked))

    def _take_prepared(self) -> None:
        """Start engines that waited for kernels that are now compiled."""
        self.follow(self._scene)
        if self._volume is not None and self._analyst_waits:
            self._start_analyst()

    def _note_failure(self, state: EngineState) -> None:
        """Wait for the ray caster's first kernel if VTK cannot draw until then."""
        if state is EngineState.FAILED and self._is_vtk_for_now:
            self._vtk_problem = self._reference.text
            self._start_reference()

    def _start_reference(self, busy_text: str = PREPARING) -> None:
        assert self._volume is not None
        if self._vtk_problem and self._is_vtk_for_now:
            self._say_time()
            return
        build, volume, own = self._builders.reference, self._volume, self.settings
        self.has_drawn = self._reference in self._scheduler.hidden
        self._reference.start(lambda settings=own: build(volume, settings), busy_text)

    def _start_analyst(self) -> None:
        """Start the analyst once its kernels are compiled and the reference is shown."""
        assert self._volume is not None
        self._answering = self.edited
        is_prepared = self._are_prepared(self._answering)
        self._analyst_waits = not (is_prepared and self.has_drawn)
        if self._analyst_waits:
            self._analyst.wait(PREPARING if is_prepared else self.preparation.text)
        else:
            build = partial(self._builders.analyst, self._volume, self._answering)
            self._analyst.start(build, PREPARING)
        self.analystReplaced.emit()

    def _say_time(self, *_progress: object) -> None:
        """Say why an engine waits, and for how long."""
        text = self.preparation.text
        if text and self._vtk_problem and self._is_vtk_for_now:
            problem = self._vtk_problem.rstrip(".")
            self._reference.wait(f"{problem}. The ray caster draws the first image. {text}")
        if text and self._analyst_waits and not self._are_prepared(self._answering):
            self._analyst.wait(text)

    def _take_first(self) -> None:
        """Start everything that comes after the first picture."""
        self.preparation.begin()
        if self._is_first and self.is_preparing and not self._first_rest.isActive():
            self._first_rest.start()
        if not self.has_drawn:
            self.has_drawn = True
            if self._analyst_waits and self._are_prepared(self._answering):
                self._start_analyst()

    def _end_first(self) -> None:
        """Start path-traced pictures after the first one, once nothing moves."""
        if self._state.live:
            self._first_rest.start()
        else:
            self._is_first = False
            self.follow(self._scene)
