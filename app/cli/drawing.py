"""The images of ``render``: what draws them, and the files that they are written to."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from app.cli import options
from app.cli.console import counting, warn, warn_of
from app.cli.outputs import make_room_for
from app.cli.render import Render
from app.cli.values import HOME_VIEW, fonts, range_text, view_text
from model.errors import RenderError, os_errors_as
from model.files import writing
from model.generator.catalog import model_for, shipped_models
from model.networks.card import load_card
from model.rendering.brightness import usual_brightness
from model.rendering.movie_file import write_movie
from model.rendering.raster import Raster
from model.rendering.scale_bar import DEPTH_TEXT, Scale
from model.scene.hints import narrow_part
from model.scene.inputs import SceneInputs, outside_range
from model.scene.orientation import line_distance, turntable
from model.scene.ranges import fit_to_range, fit_to_volume
from model.scene.scene import RENDERER_NAMES, LightDirection, Lighting, RendererName, Scene
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import OpacityTF, Range, TransferFunction
from model.scene.value_scale import SCALE_NAMES, ValueScale, values_at
from model.scene.view import DEFAULT_UP, View
from model.scene.volume import Volume
from model.volume_files.shipped import first_transfer_function
from model.volume_files.source import volume_of

if TYPE_CHECKING:
    from PySide6.QtGui import QImage

DEFAULT_SIZE = 256
DEFAULT_SAMPLE_DISTANCE = 0.5

_Place = tuple[Volume, Lighting, LightDirection | None, float]
"""Volume, lighting, direction of the light and sample distance."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Drawer:
    """A renderer, which draws views as float32 (H, W, 4), with what its images show."""

    inputs: SceneInputs
    raster: Raster
    volume: Volume | None  # none for a generator that needs no voxels
    volume_name: str
    lighting: Lighting
    light: LightDirection | None
    draw: Callable[[View], NDArray[np.float32]] = lambda _: np.zeros((1, 1, 4), np.float32)
    drawn_by: Callable[[], str] = str  # names the renderer of the last image
    close: Callable[[], None] = lambda: None

    @property
    def known_volume(self) -> Volume:
        """The volume, which a scale bar or a turntable needs."""
        if self.volume is None:
            raise RenderError(
                "A scale bar or a turntable needs the volume's lengths, which the model lacks; "
                "give --volume."
            )
        return self.volume

    def facts(self) -> dict[str, str]:
        """Return the text fields of a PNG file."""
        tf = self.inputs.transfer_function
        facts = {
            "Title": f"{self.volume_name}, by {self.drawn_by()}",
            "Volume": self.volume_name,
            "View": view_text(self.inputs.view),
            "Lighting": self.lighting,
            "Renderer": self.drawn_by(),
            "Scalar range": range_text(tf.scalar_range, tf.scale),
            "Transfer function": json.dumps(tf.to_json()),
        }
        if self.light is not None:
            facts["Light"] = f"{self.light.azimuth:g},{self.light.elevation:g}"
        if self.inputs.crop is not None:
            planes = zip(self.inputs.crop.low, self.inputs.crop.high, strict=True)
            facts["Crop"] = ",".join(f"{low:g},{high:g}" for low, high in planes)
        if self.inputs.mask is not None:
            shown = np.count_nonzero(self.inputs.mask.shown)
            facts["Mask"] = f"{shown} of {math.prod(self.inputs.mask.shape)} voxels are shown"
        if self.inputs.clip is not None:
            facts["Clipping plane"] = ",".join(f"{n:.6g}" for n in self.inputs.clip.numbers())
        return facts


def render_to_file(asked: Render) -> None:
    """Render an image or a movie and write it, replacing an existing file."""
    if asked.is_array and (asked.legend or asked.scale_bar):
        raise RenderError(f"{asked.out}: an array has no legend or scale bar; choose .png.")
    if asked.is_movie and asked.background is None:
        raise RenderError("A movie has no transparent background; choose a colour.")
    drawer = (_generator_drawer if asked.renderer == "generator" else _volume_drawer)(asked)
    with closing(drawer):
        if asked.is_array:
            image = drawer.draw(drawer.inputs.view)
            make_room_for(asked.out)
            what = f"{asked.out}: the image cannot be written"
            # An open file, because NumPy appends a suffix to names in capitals.
            with os_errors_as(RenderError, what), writing(asked.out) as file:
                np.save(file, image)
        elif asked.is_movie:
            _write_turntable(asked, drawer)
        else:
            _write_picture(asked, drawer)
        if asked.error is not None:
            print(f"{asked.out}: by {drawer.drawn_by()}.")
        if drawer.volume is not None:
            warn_of(drawer.volume)


def load_fitted(path: Path, scalar_range: Range, scale: ValueScale) -> TransferFunction:
    """Load a TF; fit one made for another range to this range, and print a notice."""
    tf = TransferFunction.load(path)
    if tf.is_relative:
        tf = tf.on_scale(scale)
    if tf.scale != scale:
        raise RenderError(
            f"{path}: this TF is for {SCALE_NAMES[tf.scale]}, not for {SCALE_NAMES[scale]}; "
            "give one that was made on the same scale."
        )
    return _noticed(path, tf, fit_to_range(tf, scalar_range))


def choose_tf(
    path: Path | None, volume: Volume, keeps_range: bool, known: TransferFunction | None = None
) -> tuple[TransferFunction, Volume]:
    """Return a known TF, that of a file, or a volume's first one, and the volume over its range."""
    if known is not None and keeps_range:
        return fit_to_range(known, volume.scalar_range), volume
    if known is None and path is None:
        return first_transfer_function(volume), volume
    if path is not None and keeps_range:
        fitted = load_fitted(path, volume.scalar_range, volume.scale)
    else:
        tf = known or TransferFunction.load(cast(Path, path))
        fitted = fit_to_volume(tf, volume)
        volume = volume.over(fitted.scalar_range, fitted.scale)
        if known is not None or path is None:
            return fitted, volume
        _noticed(path, tf, fitted)
    narrow = narrow_part(fitted.opacity, fitted.color)
    if narrow is not None:
        low, high = values_at(narrow.remedy, narrow.scale)
        warn(f"{path}: {narrow.sentence.rstrip('.')}; give --range {low:.10g},{high:.10g}.")
    return fitted, volume


def _noticed(path: Path, tf: TransferFunction, fitted: TransferFunction) -> TransferFunction:
    """Print a notice where a TF was fitted, unless it has no range of its own."""
    if not tf.is_relative and tf.scalar_range != fitted.scalar_range:
        made, here = (range_text(each.scalar_range, each.scale) for each in (tf, fitted))
        print(f"{path}: made for the scalar range {made} and fitted to {here}.")
    return fitted


def model_folder(model: Path | None, volume: Volume) -> Path:
    """Return the given model's folder, or that of the model shipped for a volume."""
    folder = model or model_for(volume.fingerprint)
    if folder is None:
        names = ", ".join(str(path) for path in shipped_models()) or "none"
        raise RenderError(
            f"No shipped model was trained on '{volume.name}' (shipped: {names}); give --model."
        )
    return folder


def warn_outside(inputs: SceneInputs, scene: Scene) -> None:
    """Warn of inputs that the generator was not trained on."""
    outside = outside_range(inputs, scene)
    if outside:
        warn(f"{outside}. What the model draws there may be wrong.")


def _volume_drawer(asked: Render) -> Drawer:
    scene = load_card(asked.model).scene if asked.model else None
    lighting, light = asked.lighting, None
    if lighting is None:
        lighting, light = (scene.lighting, scene.light) if scene else ("none", None)
    elif lighting != "none":
        light = LightDirection()
    if asked.light is not None and lighting == "none":
        raise RenderError("An unlit image has no light to move.", lighting="direct")
    chosen = asked.source.is_placed
    volume = asked.source.read() if scene is None or chosen else volume_of(scene, asked.source)
    if asked.fingerprint and volume.fingerprint != asked.fingerprint:
        warn(f"{volume.name}: its voxels differ from those of the saved session.")
    tf, volume = choose_tf(asked.tf, volume, chosen or scene is not None, asked.known_tf)
    if asked.draw_missing:
        volume = volume.drawing_missing(True)
    if lighting == "path" and asked.sample_distance is not None:
        raise RenderError(
            "Path-traced light has no steps along a ray; leave --sample-distance out, or give "
            "--samples."
        )
    for given, what in (
        (asked.samples, "Samples are counted"),
        (asked.error, "Errors are estimated"),
        (asked.denoise, "Pictures are denoised"),
    ):
        if given is not None and lighting != "path":
            raise RenderError(f"{what} in path-traced light only.", lighting="path")
    size = scene.image_size if scene else DEFAULT_SIZE
    step = asked.sample_distance or (scene.sample_distance if scene else DEFAULT_SAMPLE_DISTANCE)
    nearby = line_distance(volume.proportions)
    if asked.view is None and nearby is not None:
        asked = replace(asked, view=replace(HOME_VIEW, distance=nearby))
    place = volume, lighting, light, step
    drawer = Drawer(
        inputs=asked.inputs(tf, volume),
        raster=asked.size or Raster(size, size),
        volume=volume,
        volume_name=volume.name,
        lighting=lighting,
        light=asked.light or light,
    )
    return (_path_traced if lighting == "path" else _rendered)(asked, drawer, place)


def _rendered(asked: Render, drawer: Drawer, place: _Place) -> Drawer:
    from model.rendering.renderer import FallbackRenderer, Renderer, open_renderer

    name = cast(RendererName, asked.renderer)
    renderer: Renderer = FallbackRenderer(*place) if name == "vtk" else open_renderer(name, *place)
    failures: list[str] = []

    def draw(view: View) -> NDArray[np.float32]:
        image = renderer.render(replace(drawer.inputs, view=view), drawer.raster)
        failure = getattr(renderer, "reason", "")
        if failure and not failures:
            failures.append(failure)
            warn(failure)
        return image

    def drawn_by() -> str:
        by_raycast = getattr(renderer, "by_raycast", False)
        by = RENDERER_NAMES["raycast" if by_raycast else name]
        return f"the {by}" if by.islower() else by

    return replace(drawer, draw=draw, drawn_by=drawn_by, close=renderer.close)


def _path_traced(asked: Render, drawer: Drawer, place: _Place) -> Drawer:
    from model.generator.path_light_cleaning import cleaning_of
    from model.rendering.path_tracing import denoising
    from model.rendering.path_tracing.refinement import MOST_SAMPLES, Refined, RefiningRenderer
    from model.rendering.path_tracing.renderer import SAMPLES, PathTracer

    if asked.denoise and not denoising.available():
        raise RenderError(
            "Open Image Denoise is not installed: it has no package for this machine, or the "
            "environment lacks pyoidn. Leave --denoise out, or give more --samples."
        )
    volume, _, light, step = place
    tracer = PathTracer(volume, light, step)
    cleaning, release = cleaning_of(volume, light, asked.denoise is not False)
    renderer = RefiningRenderer(tracer, cleaning)
    samples = asked.samples or (SAMPLES if asked.error is None else MOST_SAMPLES)
    finished: list[tuple[Refined, float]] = []

    def draw(view: View) -> NDArray[np.float32]:
        begun = time.perf_counter()
        seen = replace(drawer.inputs, view=view), drawer.raster, samples
        if asked.error is None:
            last = renderer.drawn(*seen)
        else:
            *_, last = renderer.refined(*seen, error=asked.error)
        assert last is not None
        finished[:] = [(last, time.perf_counter() - begun)]
        return last.rgba

    def drawn_by() -> str:
        by = "the path tracer"
        for last, seconds in finished:
            samples = f"{last.samples} sample{'s' * (last.samples > 1)} a pixel"
            by += f", {samples}{last.method and f', {last.method},'} in {seconds:.2g} s"
            if last.samples > 1:
                by += f", estimated error {last.error:.2g}".replace(" 0.", " .")
        return by

    def close() -> None:
        tracer.close()
        release()

    return replace(drawer, draw=draw, drawn_by=drawn_by, close=close)


def _generator_drawer(asked: Render) -> Drawer:
    _check_for_model(asked)
    folder = asked.model or model_folder(None, asked.source.read())
    scene = load_card(folder).scene
    if asked.lighting is not None and asked.lighting != scene.lighting:
        raise RenderError(
            f"The model was trained with the lighting '{scene.lighting}'; "
            "leave --lighting out, or train a model with it."
        )
    if asked.light is not None and scene.light_range is None:
        kind = "without light" if scene.light is None else "with a fixed light"
        raise RenderError(f"The model was trained {kind}; leave --light out.")
    volume = None
    if not asked.tf or asked.legend or asked.scale_bar or asked.is_movie:
        volume = volume_of(scene, asked.source)
    if asked.known_tf is not None:
        tf = fit_to_range(asked.known_tf, scene.scalar_range)
    elif asked.tf or volume is None:
        tf = load_fitted(cast(Path, asked.tf), scene.scalar_range, scene.scale)
    else:
        tf = first_transfer_function(volume)
    inputs = asked.inputs(tf)
    warn_outside(inputs, scene)
    if asked.mask is not None:
        warn("The model draws the whole volume: the mask has no effect.")
    from model.generator.generator import Generator

    generator = Generator.load(folder, asked.device)
    own = scene.image_size
    raster = asked.size or Raster(own, own)

    def draw(view: View) -> NDArray[np.float32]:
        rgba = generator.render(replace(inputs, view=view))
        if raster.shorter != own:
            from skimage.transform import resize

            side = raster.shorter
            rgba = resize(rgba, (side, side), anti_aliasing=side < own)
        return np.clip(rgba, 0, 1).astype(np.float32)

    return Drawer(
        draw=draw,
        drawn_by=lambda: f"the model {folder}",
        inputs=inputs,
        raster=raster,
        volume=volume,
        volume_name=scene.volume_name,
        lighting=scene.lighting,
        light=asked.light or scene.light,
    )


def _check_for_model(asked: Render) -> None:
    if (asked.samples, asked.denoise, asked.error) != (None, None, None):
        raise RenderError(
            "Samples, error and denoising are for path-traced light; leave them out, or give "
            "--renderer raycast and --lighting path."
        )
    if asked.sample_distance is not None:
        raise RenderError(
            "A model's images have no samples along rays; leave --sample-distance out, or give "
            "--renderer raycast or vtk."
        )
    if asked.source.is_placed:
        raise RenderError(options.MODEL_RANGE)


def _write_picture(asked: Render, drawer: Drawer) -> None:
    from app.picture import save_image

    image = _figure(asked, drawer, drawer.inputs.view)
    facts, brightness = drawer.facts(), _brightness(asked, drawer)
    if brightness != 1:
        facts["Brightness"] = f"{brightness:g}"
    if asked.scale_bar:
        facts["Scale bar"] = f"Holds {DEPTH_TEXT}"
    for keyword, text in facts.items():
        image.setText(keyword, text)
    make_room_for(asked.out)
    save_image(asked.out, image)


def _write_turntable(asked: Render, drawer: Drawer) -> None:
    """Write a full turn about the volume's up axis as a movie."""
    from app.picture import pixels_of

    count = max(round(asked.seconds * asked.rate), 2)
    volume = drawer.known_volume
    shown = _shown_points(volume, drawer.inputs.opacity_tf)
    middle = tuple((shown.min(axis=0) + shown.max(axis=0)) / 2)
    up = asked.up or volume.up or DEFAULT_UP
    views = turntable(drawer.inputs.view, count, up, volume.proportions, middle)
    size = drawer.raster
    if asked.out.suffix.lower() == ".mp4" and (size.width % 2 or size.height % 2):
        even = f"{size.width // 2 * 2} x {size.height // 2 * 2}"
        warn(f"{asked.out}: an MP4 needs even sides, so it gets {even} pixels.")
    with counting("Drawing pictures", count) as show:

        def frames() -> Iterator[NDArray[np.uint8]]:
            for number, view in enumerate(views, 1):
                yield pixels_of(_figure(asked, drawer, view))
                show(number)

        make_room_for(asked.out)
        write_movie(asked.out, frames(), asked.rate)


def _figure(asked: Render, drawer: Drawer, view: View) -> QImage:
    from app.window.figure import FigureChoice, Subject, figure

    rgba = drawer.draw(view)
    if asked.legend or asked.scale_bar:
        fonts()
    raster = drawer.raster
    marks = asked.legend, asked.scale_bar
    choice = FigureChoice(raster.width, raster.height, asked.background, *marks)
    units = "" if drawer.volume is None else drawer.volume.units
    scale = None
    if asked.scale_bar:
        shown = _shown_points(drawer.known_volume, drawer.inputs.opacity_tf)
        scale = Scale.of(drawer.known_volume, shown)
    images = {"reference": (rgba, _brightness(asked, drawer))}
    inputs = replace(drawer.inputs, view=view)
    return figure(choice, images, inputs, Subject(units, scale, view=drawer.inputs.view))


def _brightness(asked: Render, drawer: Drawer) -> float:
    return usual_brightness(drawer.lighting) if asked.brightness is None else asked.brightness


@lru_cache(maxsize=1)
def _shown_points(volume: Volume, opacity: OpacityTF) -> NDArray[np.float64]:
    """Places around what a TF shows, as fractions of the volume's lengths."""
    return ThinnedVolume.of(volume).shown_points(opacity)
