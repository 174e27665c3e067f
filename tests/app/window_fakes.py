"""Stand-ins for the engines: quick, and under the test's control."""

import tempfile
import threading
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from ramp import make_tf, make_volume
from toy_codec import toy_space

from app.engines.engines import Builders
from app.engines.pace import SCALES
from app.engines.requests import UNWATCHED, Image, ImageRequest, Quality, ReferenceSettings
from model.errors import VolumeError
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.blocks import counted

PATIENCE_S = 100  # so long a test waits on a busy machine for what comes at once on a free one


@dataclass(frozen=True)
class LevelRequest(ImageRequest):
    """A request whose image has a level of red that the test has chosen."""

    level: int = 0


def make_request(level, live=False):
    inputs = SceneInputs.of(View(), make_tf())
    return LevelRequest(inputs, Quality(8, live=live), sequence=level, level=level)


DARKEST = 4  # level of the first image of a test

_levels = {}


def red_of(request):
    """Level (0..255) of a fake image's red: the request's own or a counter, one more if live."""
    if isinstance(request, LevelRequest):
        return request.level
    level = _levels.setdefault(request.inputs, DARKEST + len(_levels))
    return (level + request.quality.live) % 256


class FakeEngine:
    """Renders images in :func:`red_of`'s colour; with a gate it waits in every render."""

    def __init__(self, scene=None, gate=None, description=""):
        self.scene = scene
        self.description, self.remark = description, ""
        self.by_raycast = False
        self.image_error = None
        self.gate = gate
        self.started = threading.Semaphore(0)
        self.requests = []
        self.others = []
        self.threads = [threading.current_thread()]
        self.closed, self.forgotten = False, ""
        self.error = None

    def image(self, request, watch=UNWATCHED):
        self.threads.append(threading.current_thread())
        self.requests.append(request)
        self.started.release()
        self._wait_or_fail()
        pixels = request.quality.pixels
        if self.scene is not None:
            # A generator has a size of its own.
            pixels = Raster(self.scene.image_size, self.scene.image_size)
        image = np.zeros((pixels.height, pixels.width, 4), dtype=np.float32)
        image[..., 0] = red_of(request) / 255
        image[..., 3] = 1.0
        return image

    def images_of(self, request, watch=UNWATCHED):
        """One image; while something moves, one of fewer samples."""
        begun = time.perf_counter()
        rgba = self.image(request, watch)
        seconds = time.perf_counter() - begun
        yield Image(
            rgba, seconds, self.description, by_raycast=self.by_raycast, error=self.image_error,
            is_preview=request.quality.live, quiet_seconds=seconds,
        )  # fmt: skip

    def trade_off(self, request, watch=UNWATCHED):
        """The finer, the slower and the better."""
        self._note(request)
        scales = np.array(sorted(SCALES), np.float32)
        return np.column_stack([scales / 10, (1 - scales) / 100])

    def picture(self, request, watch=UNWATCHED):
        pixels = request.quality.pixels
        return np.full((pixels.height, pixels.width, 4), 255, dtype=np.uint8)

    def visibility(self, request, watch=UNWATCHED):
        """A peak at bin 60, the higher the later it was asked for."""
        self.others.append(request)
        peak = request.sequence * np.exp(-((np.arange(256) - 60) ** 2) / 200)
        return np.tile(peak.astype(np.float32), (len(request.regions), 1))

    def region_sensitivity(self, request, watch=UNWATCHED):
        """A peak at bin 100, so many times 1 as the region has pixels."""
        self._note(request)
        pixels = request.region.mask(request.quality.pixels.shape).sum()
        bins = np.arange(256)
        return (pixels * np.exp(-((bins - 100) ** 2) / 200)).astype(np.float32)

    def value_sensitivity(self, request, watch=UNWATCHED):
        """The lowest value of the band in every pixel."""
        self._note(request)
        return np.full((*request.quality.pixels.shape, 3), request.values[0], dtype=np.float32)

    def value_visibility(self, request, watch=UNWATCHED):
        """A hundredth of the distance of the lowest value from 100, in every pixel."""
        self._note(request)
        shape = request.quality.pixels.shape
        return np.full(shape, (request.values[0] - 100) / 100, dtype=np.float32)

    def images(self, request, watch=UNWATCHED):
        """Gray images, each .1 brighter than the last; of codes in [-1, 1], by their first."""
        self.others.append(request)
        shape = request.quality.pixels.shape
        levels = 0.1 * np.arange(1 + len(request.more), dtype=np.float32)
        if request.codes:
            levels = (np.array(request.codes, np.float32)[:, 0] + 1) / 2
        return np.ones((len(levels), *shape, 4), np.float32) * levels[:, None, None, None]

    def _note(self, request):
        self.others.append(request)
        self._wait_or_fail()

    def _wait_or_fail(self):
        if self.gate is not None:
            assert self.gate.acquire(timeout=PATIENCE_S)
        if self.error is not None:
            raise self.error

    def forget(self, channel):
        self.forgotten = channel

    def close(self):
        self.threads.append(threading.current_thread())
        self.closed = True


class RefiningEngine(FakeEngine):
    """Yields images of these widths, each of them once the gate lets it through."""

    def __init__(self, widths, gate=None):
        super().__init__(gate=gate)
        self.widths = widths

    def images_of(self, request, watch=UNWATCHED):
        for width in self.widths:
            image = next(super().images_of(request, watch))
            rgba = np.resize(image.rgba, (1, width, 4))
            yield replace(image, rgba=rgba, is_last=width == self.widths[-1])


@dataclass
class FakeBuilders:
    """Builders whose volumes and engines the test can look at and break."""

    volumes: dict[str, Volume] = field(default_factory=lambda: {"ramp": make_volume()})
    scene: Scene | None = None
    generators: list[FakeEngine] = field(default_factory=list)
    kept: list[list] = field(default_factory=list)
    references: list[FakeEngine] = field(default_factory=list)
    analysts: list[FakeEngine] = field(default_factory=list)
    settings: list[ReferenceSettings] = field(default_factory=list)
    drawn: list[Volume] = field(default_factory=list)
    generator_error: Exception | None = None
    loading: threading.Event | None = None
    map_folder: Path = Path(tempfile.gettempdir(), "tfscope-test-maps")
    spaces: list[Path | None] = field(default_factory=list)
    space_error: Exception | None = None
    failing: str = ""
    held: dict[str, threading.Event] = field(default_factory=dict)
    """Volumes whose reading waits for an event, and tells its progress before and after."""
    ended: list[str] = field(default_factory=list)
    """Names of the held volumes whose reading has ended."""

    def __post_init__(self):
        _levels.clear()

    def make(self):
        return Builders(
            self.read_volume, self.reference, self.generator, self.analyst, self.latent_space
        )

    def latent_space(self, scalar_range, window, scale, model):
        self.spaces.append(model)
        if self.space_error is not None:
            raise self.space_error
        return toy_space(self.map_folder, scalar_range, window, scale)

    def read_volume(self, path):
        if path.stem not in self.volumes:
            raise VolumeError(f"{path}: the file is missing; choose another.")
        if path.stem in self.held:
            try:
                for done in counted("slices read", range(2)):
                    assert done or self.held[path.stem].wait(PATIENCE_S)
            finally:
                self.ended.append(path.stem)
        return self.volumes[path.stem]

    def reference(self, volume, settings):
        self.settings.append(settings)
        self.drawn.append(volume)
        self.references.append(FakeEngine())
        if settings.lighting == self.failing:
            raise ValueError("no light")
        return self.references[-1]

    def analyst(self, volume, settings):
        self.analysts.append(FakeEngine())
        return self.analysts[-1]

    def generator(self, folder, kept, device="auto"):
        self.kept.append(kept)
        if self.loading is not None:
            assert self.loading.wait(PATIENCE_S)
        if self.generator_error is not None:
            raise self.generator_error
        scene = self.scene or Scene.of(self.volumes["ramp"], image_size=16)
        self.generators.append(FakeEngine(scene, description="CPU"))
        return self.generators[-1]
