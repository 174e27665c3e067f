"""Renderers and generators as engines, and their builders for worker threads."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.engines import requests
from app.engines.drawer import Drawer
from app.engines.pace import FIRST_SCALE, FIRST_SLOW_SCALE, Sizes
from app.engines.renderer_engine import ReferenceEngine, RendererEngine
from model.kernel_cache import KernelGroup
from model.rendering.renderer import FallbackRenderer, Renderer, open_renderer
from model.rendering.scalars import KERNEL_TYPES, keeps_type
from model.scene.inputs import SceneInputs
from model.scene.scene import PATH_CURVES, PATH_FIELDS, RendererName, Scene
from model.scene.tf_perturbation import edit_over
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale
from model.scene.volume import Volume

if TYPE_CHECKING:
    from model.generator.generator import Generator
    from model.latent.latent_space import LatentSpace
    from model.networks.names import BackendName
    from model.sensitivity.learned import Sensitivity
    from model.volume_files import Choice, RawLayout

BACKEND_NAMES: dict[BackendName, str] = {"eager": "", "openvino": "OpenVINO"}

SMOOTH_REMARK = "Slices are thick, so voxels are smoothed, unless you choose a renderer."
SOFT_REMARK = "Only the ray caster draws soft light."  # why VTK cannot draw soft light


@dataclass(frozen=True)
class Builders:
    """Functions that read volumes and build engines; tests replace them by fakes.

    The analyst is a ray caster that computes sensitivities and draws the latent map's pictures,
    whichever renderer draws the reference. A latent space is that of a scalar range and a window of
    it, or that of a model's folder. Kernel groups are those of images first, then those of the
    analyst. A volume is read from a path, with a raw file's layout (``raw``) and the choice among
    several volumes (``choice``) if needed.
    """

    read_volume: Callable[..., Volume]
    reference: Callable[[Volume, requests.ReferenceSettings], requests.Engine]
    generator: Callable[..., requests.Engine]
    analyst: Callable[[Volume, requests.ReferenceSettings], requests.Engine]
    latent_space: Callable[[Range, Range, ValueScale, Path | None], LatentSpace]
    kernels: Callable[[Volume, requests.ReferenceSettings], tuple[KernelGroup, ...]] = lambda *_: ()

    def on(self, device: str) -> Builders:
        """Return the same with generators on a device: "auto", "cpu" or "cuda"."""
        return replace(self, generator=partial(self.generator, device=device))


class GeneratorEngine(requests.Engine):
    """A trained generator as an engine, kept for the next one; images always have its size."""

    scene: Scene

    def __init__(self, generator: Generator, kept: list[Generator]) -> None:
        self._generator, self.scene = generator, generator.scene
        self._kept = kept
        self._differentiated: tuple[object, Sensitivity] | None = None

    @property
    def description(self) -> str:
        """Device, backend and precision, for display."""
        device = {"cpu": "CPU", "cuda": "GPU"}.get(self._generator.device.type, "")
        name, precision = self._generator.backend
        words = [device, BACKEND_NAMES[name], "" if precision == "float32" else precision]
        return ", ".join(filter(None, words))

    def images_of(
        self, request: requests.ImageRequest, watch: requests.Watch = requests.UNWATCHED
    ) -> Iterator[requests.Image]:
        """Generate one image."""
        begun = time.perf_counter()
        rgba = self._generator.render(request.inputs)
        yield requests.Image(rgba, time.perf_counter() - begun, self.description)

    def picture(
        self, request: requests.PictureRequest, watch: requests.Watch = requests.UNWATCHED
    ) -> NDArray[np.uint8]:
        """Generate an image; its size is the generator's."""
        image = self._generator.render(request.inputs)
        return np.rint(255 * np.clip(image, 0, 1)).astype(np.uint8)

    def images(
        self, request: requests.BatchRequest, watch: requests.Watch = requests.UNWATCHED
    ) -> requests.Array:
        """Generate all images in one pass, of latent codes if there are any."""
        if request.codes:
            codes = np.array(request.codes, dtype=np.float32)
            return self._generator.render_latent(codes, request.inputs)
        return self._generator.render_batch([request.inputs, *request.more])

    def region_sensitivity(
        self, request: requests.RegionSensitivityRequest, watch: requests.Watch = requests.UNWATCHED
    ) -> requests.Array:
        """Differentiate the generated image; the region is in its pixels."""
        found = self._sensitivity(request.inputs, request.width)
        if request.measure == "change":
            return found.change_norms(request.region)
        return found.region(request.region)

    def value_sensitivity(
        self, request: requests.ValueSensitivityRequest, watch: requests.Watch = requests.UNWATCHED
    ) -> requests.Array:
        """Differentiate the generated image forwards."""
        edit = edit_over(request.values, self.scene.scalar_range, request.width)
        return self._sensitivity(request.inputs, request.width).change(edit)

    def close(self) -> None:
        """Keep the generator: not before, as two threads must not use it at once."""
        self._kept[:] = [self._generator]

    def _sensitivity(self, inputs: SceneInputs, width: float) -> Sensitivity:
        """The derivatives of an image; those of the last image are cached.

        The forward pass is half of the time for another region of the same image, and the
        derivatives by the code most of the time for another value's field.
        """
        from model.sensitivity.learned import Sensitivity

        question = inputs, width
        if self._differentiated is None or self._differentiated[0] != question:
            self._differentiated = None
            self._differentiated = question, Sensitivity(self._generator, inputs, width)
        return self._differentiated[1]


def _read_volume(path: Path, raw: RawLayout | None = None, choice: Choice | None = None) -> Volume:
    from model.volume_files import Choice, read_volume

    return read_volume(path, raw=raw, choice=choice or Choice())


def _reference_engine(volume: Volume, settings: requests.ReferenceSettings) -> requests.Engine:
    from model.rendering.raycast.renderer import RaycastRenderer

    name, lighting = settings.renderer, settings.lighting
    place = volume, lighting, settings.light, settings.sample_distance
    if lighting == "path":
        return _path_tracing_engine(volume, settings)
    if settings.passes and name == "vtk":
        return RendererEngine(_drawer(settings, open_renderer("vtk", *place)))
    if name == "vtk" and lighting != "soft":
        return RendererEngine(_drawer(settings, FallbackRenderer(*place)))
    caster = RaycastRenderer(*place, is_blurred=settings.smooths)
    drawer = _drawer(settings, caster, "raycast")
    if name == "raycast":
        return RendererEngine(drawer)
    if settings.smooths or lighting == "soft":
        remark = SMOOTH_REMARK if settings.smooths else SOFT_REMARK
        return RendererEngine(replace(drawer, remark=remark))
    spares = not settings.is_truth
    return ReferenceEngine(drawer, partial(FallbackRenderer, *place, spares, caster))


def _drawer(
    settings: requests.ReferenceSettings, renderer: Renderer, name: RendererName = "vtk"
) -> Drawer:
    sizes = Sizes(FIRST_SLOW_SCALE if settings.lighting == "soft" else FIRST_SCALE)
    distances = settings.sample_distance, settings.smooth_distance
    return Drawer(renderer, distances[0], name, distances[1], settings.passes, sizes=sizes)


def _path_tracing_engine(volume: Volume, settings: requests.ReferenceSettings) -> requests.Engine:
    from app.engines.path_tracing import PathTracingEngine
    from model.generator.path_light_cleaning import cleaning_of
    from model.rendering.path_tracing.refinement import RefiningRenderer
    from model.rendering.path_tracing.renderer import PathTracer

    place = settings.light, settings.sample_distance
    cleaning, release = cleaning_of(volume, settings.light, settings.denoises)
    refining = RefiningRenderer(PathTracer(volume, *place), cleaning, settings.samples)
    soft = replace(settings, lighting=PATH_FIELDS)

    def open_soft() -> Drawer:
        return _drawer(soft, open_renderer("raycast", volume, PATH_FIELDS, *place), "raycast")

    may_preview = open_soft if settings.renderer == "auto" else None
    return PathTracingEngine(refining, settings.sample_distance, release, may_preview)


def _analyst_engine(volume: Volume, settings: requests.ReferenceSettings) -> requests.Engine:
    # The window needs these modules to show answers; loaded here, they do not block it.
    for library in ("cmap", "scipy.ndimage", "skimage.measure", "skimage.transform"):
        import_module(library)
    if settings.lighting == "path":
        from app.engines.path_tracing import PathAnalyst
        from model.rendering.path_tracing import denoising

        is_clean = settings.denoises and denoising.installed()
        tracing = partial(_reference_engine, volume, settings) if is_clean else None
        place = settings.light, settings.sample_distance
        return PathAnalyst(volume, *place, tracing)
    return _reference_engine(volume, replace(settings, renderer="raycast"))


def _generator_engine(folder: Path, kept: list[Generator], device: str = "auto") -> requests.Engine:
    from model.generator.generator import Generator

    generator = kept.pop() if kept else Generator.load(folder, device, fastest=True)
    return GeneratorEngine(generator, kept)


def _latent_space(
    scalar_range: Range, window: Range, scale: ValueScale, model: Path | None
) -> LatentSpace:
    from model.latent.latent_space import LatentSpace

    if model is not None:
        return LatentSpace.of_model(model)
    return LatentSpace.shipped(scalar_range, window, scale)


def _kernels(volume: Volume, settings: requests.ReferenceSettings) -> tuple[KernelGroup, ...]:
    is_native = keeps_type(volume, KERNEL_TYPES)
    voxels = volume.voxels.dtype.name if is_native else "float32"
    is_traced = settings.lighting == "path"
    light = PATH_FIELDS if is_traced else settings.lighting
    own = KernelGroup(voxels, light, "images"), KernelGroup(voxels, light, "questions")
    if not is_traced:
        return own
    # Path-traced pictures need those of soft light, too, and the analyst draws in it.
    curves = KernelGroup(voxels, PATH_CURVES, "questions")
    return KernelGroup(voxels, "path", "images"), *own, curves


REAL_BUILDERS = Builders(
    _read_volume, _reference_engine, _generator_engine, _analyst_engine, _latent_space, _kernels
)
