"""``render``: one image to a file, by the reference renderer or the generator."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from app.cli.captions import range_text
from app.cli.console import console, warn
from app.cli.render_order import Drawer, RenderOrder
from app.cli.render_outputs import write_array, write_figure, write_turntable
from model.errors import RenderError
from model.generator.catalog import model_for, shipped_models
from model.networks.card import load_card
from model.rendering.movie_file import SUFFIXES
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs, outside_range
from model.scene.light import LightDirection
from model.scene.narrow_part import narrow_part
from model.scene.range_fitting import fit_to_range, fit_to_volume
from model.scene.scene import Lighting, RendererName, Scene
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import SCALE_NAMES, ValueScale, values_at
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.first_tf import first_transfer_function
from model.volume_files.source import volume_of

DEFAULT_SIZE = 256
DEFAULT_SAMPLE_DISTANCE = 0.5

MODEL_RANGE = (
    "A model draws over the range and scale that it was trained on; leave --range and --scale out."
)


def render_to_file(order: RenderOrder) -> None:
    """Render an image and write it, replacing an existing file."""
    if order.light is not None and order.lighting == "none":
        raise RenderError("An unlit image has no light to be moved.", lighting="direct")
    is_movie = order.out.suffix.lower() in SUFFIXES
    if order.is_array and (order.legend or order.scale_bar):
        raise RenderError(f"{order.out}: an array has no legend or scale bar; choose .png.")
    if is_movie and order.background is None:
        raise RenderError("A movie has no transparent background; choose a colour.")
    drawer = (_generator_drawer if order.renderer == "generator" else _volume_drawer)(order)
    try:
        if order.is_array:
            write_array(order.out, drawer.draw(order.view))
        elif is_movie:
            write_turntable(order, drawer)
        else:
            write_figure(order, drawer)
        if order.error is not None:
            console.print(f"{order.out}: by {drawer.drawn_by()}.")
    finally:
        drawer.close()


def load_fitted(path: Path, scalar_range: Range, scale: ValueScale) -> TransferFunction:
    """Load a TF; fit one made for another range to this range, and print a notice.

    Raises
    ------
    RenderError
        When the TF is over another scale.
    """
    tf = TransferFunction.load(path)
    if tf.is_relative:
        tf = tf.on_scale(scale)
    if tf.scale != scale:
        raise RenderError(
            f"{path}: this TF lies over {SCALE_NAMES[tf.scale]}, and here TFs lie over "
            f"{SCALE_NAMES[scale]}; give one that was made on the same scale."
        )
    return _noticed(path, tf, fit_to_range(tf, scalar_range))


def choose_tf(
    path: Path | None, volume: Volume, keeps_range: bool, known: TransferFunction | None = None
) -> tuple[TransferFunction, Volume]:
    """Return the TF of a file, or a volume's first one, and the volume over the TF's range.

    Parameters
    ----------
    keeps_range : bool
        Whether the volume's range or scale was chosen, so that the TF is fitted to it; otherwise
        the file's range is taken where it fits the volume, and its scale.
    known : TransferFunction, optional
        In place of a file's.
    """
    if known is not None:
        if keeps_range:
            return fit_to_range(known, volume.scalar_range), volume
        fitted = fit_to_volume(known, volume)
        return fitted, volume.over(fitted.scalar_range, fitted.scale)
    if path is None:
        return first_transfer_function(volume), volume
    if keeps_range:
        fitted = load_fitted(path, volume.scalar_range, volume.scale)
    else:
        tf = TransferFunction.load(path)
        fitted = _noticed(path, tf, fit_to_volume(tf, volume))
        volume = volume.over(fitted.scalar_range, fitted.scale)
    narrow = narrow_part(fitted.opacity, fitted.color)
    if narrow is not None:
        low, high = values_at(narrow.remedy, narrow.scale)
        warn(f"{path}: {narrow.sentence.rstrip('.')}; give --range {low:.10g},{high:.10g}.")
    return fitted, volume


def _noticed(path: Path, tf: TransferFunction, fitted: TransferFunction) -> TransferFunction:
    """Print a notice where a TF was fitted, unless it has no range of its own."""
    if not tf.is_relative and tf.scalar_range != fitted.scalar_range:
        made, here = (range_text(each.scalar_range, each.scale) for each in (tf, fitted))
        console.print(f"{path}: made for the scalar range {made} and fitted to {here}.")
    return fitted


def warn_outside(inputs: SceneInputs, scene: Scene) -> None:
    """Say on standard error what a generator is asked for and was not trained on."""
    outside = outside_range(inputs, scene)
    if outside:
        warn(f"{outside}. What the model draws there may be wrong.")


def _volume_drawer(order: RenderOrder) -> Drawer:
    scene = load_card(order.model).scene if order.model else None
    lighting, light = _lighting_of(order, scene)
    chosen = order.volume.is_placed
    volume = order.volume.read() if scene is None or chosen else volume_of(scene, order.volume)
    if order.fingerprint and volume.fingerprint != order.fingerprint:
        warn(f"{volume.name}: the session was saved with other voxels than these.")
    tf, volume = choose_tf(order.tf, volume, chosen or scene is not None, order.known_tf)
    if order.draws_missing:
        volume = volume.drawing_missing(True)
    from model.rendering.fallback import FallbackRenderer
    from model.rendering.renderer import Renderer, open_renderer

    step = scene.sample_distance if scene else DEFAULT_SAMPLE_DISTANCE
    if order.sample_distance is not None:
        step = _other_distance(order.sample_distance, lighting)
    name = cast(RendererName, order.renderer)
    if lighting != "path":
        _refuse_of_paths(order)
    if lighting == "path":
        return _path_drawer(order, volume, tf, light, scene)
    renderer: Renderer
    if name == "vtk":
        renderer = FallbackRenderer(volume, lighting, light, step)
    else:
        renderer = open_renderer(name, volume, lighting, light, step)
    inputs = order.inputs(tf)
    size = scene.image_size if scene else DEFAULT_SIZE
    raster = order.size or Raster(size, size)
    told: list[str] = []

    def draw(view: View) -> NDArray[np.float32]:
        image = renderer.render(replace(inputs, view=view), raster)
        failure = getattr(renderer, "reason", "")
        if failure and not told:
            told.append(failure)
            warn(failure)
        return image

    def drawn_by() -> str:
        return "the ray caster" if told or name == "raycast" else "VTK"

    light = order.light or light
    return Drawer(
        draw, inputs, volume, volume.name, lighting, light, drawn_by, raster, renderer.close
    )


def _lighting_of(order: RenderOrder, scene: Scene | None) -> tuple[Lighting, LightDirection | None]:
    """Return the order's lighting, or that of a model's scene, and the light's usual direction."""
    if order.lighting is not None:
        lighting = order.lighting
        light = None if lighting == "none" else LightDirection()
    else:
        lighting = scene.lighting if scene else "none"
        light = scene.light if scene else None
    if order.light is not None and lighting == "none":
        raise RenderError("An unlit image has no light to be moved.", lighting="direct")
    return lighting, light


def _other_distance(distance: float, lighting: Lighting) -> float:
    """Return a sample distance that was asked for, unless the light is of another one.

    Raises
    ------
    RenderError
        In path-traced light.
    """
    if lighting == "path":
        raise RenderError(
            "Path-traced light has no steps along a ray; leave --sample-distance out, or give "
            "--samples."
        )
    return distance


def _refuse_of_paths(order: RenderOrder) -> None:
    for option, what in (
        (order.samples, "Samples are counted"),
        (order.error, "Errors are estimated"),
        (order.denoise, "Pictures are denoised"),
    ):
        if option is not None:
            raise RenderError(f"{what} in path-traced light only.", lighting="path")


def _path_drawer(
    order: RenderOrder,
    volume: Volume,
    tf: TransferFunction,
    light: LightDirection | None,
    scene: Scene | None,
) -> Drawer:
    from model.generator.path_light_generator import cleaning_of
    from model.rendering.path_tracing import denoising
    from model.rendering.path_tracing.refinement import MOST_SAMPLES, Refined, drawn
    from model.rendering.path_tracing.renderer import SAMPLES, PathTracer

    if order.denoise and not denoising.available():
        raise RenderError(
            "Open Image Denoise is not installed: it has no package for this machine, or the "
            "environment lacks pyoidn. Leave --denoise out, or give more --samples."
        )
    step = scene.sample_distance if scene else DEFAULT_SAMPLE_DISTANCE
    tracer = PathTracer(volume, light, step)
    cleaning, release = cleaning_of(volume, light, order.denoise is not False)
    inputs = order.inputs(tf)
    size = scene.image_size if scene else DEFAULT_SIZE
    raster = order.size or Raster(size, size)
    error = order.error or 0.0
    samples = order.samples or (SAMPLES if order.error is None else MOST_SAMPLES)
    finished: list[tuple[Refined, float]] = []

    def draw(view: View) -> NDArray[np.float32]:
        begun = time.perf_counter()
        seen = replace(inputs, view=view)
        last = drawn(tracer, seen, raster, samples, cleaning=cleaning, error=error)
        finished[:] = [(last, time.perf_counter() - begun)]
        return last.rgba

    def drawn_by() -> str:
        by = "the path tracer"
        for last, seconds in finished:
            samples = f"{last.samples} sample{'s' * (last.samples > 1)} a pixel"
            by += f", {samples}{last.deed and f', {last.deed},'}"
            by += f" in {seconds:.2g} s"
            if last.samples > 1:
                by += f", estimated error {last.error:.2g}".replace(" 0.", " .")
        return by

    def close() -> None:
        tracer.close()
        release()

    light = order.light or light
    return Drawer(draw, inputs, volume, volume.name, "path", light, drawn_by, raster, close)


def _generator_drawer(order: RenderOrder) -> Drawer:
    _refuse_for_a_model(order)
    folder = order.model or model_folder(None, order.volume.read())
    scene = load_card(folder).scene
    if order.lighting is not None and order.lighting != scene.lighting:
        raise RenderError(
            f"The model was trained with the lighting '{scene.lighting}'; "
            "leave another one out, or train a model with it."
        )
    if order.light is not None and scene.light_range is None:
        kind = "without light" if scene.light is None else "with a fixed light"
        raise RenderError(f"The model was trained {kind}: it cannot follow another direction.")
    volume = None
    if not order.tf or order.legend or order.scale_bar or order.out.suffix.lower() in SUFFIXES:
        volume = volume_of(scene, order.volume)
    if order.known_tf is not None:
        tf = fit_to_range(order.known_tf, scene.scalar_range)
    elif order.tf or volume is None:
        tf = load_fitted(cast(Path, order.tf), scene.scalar_range, scene.scale)
    else:
        tf = first_transfer_function(volume)
    inputs = order.inputs(tf)
    warn_outside(inputs, scene)
    from model.generator.generator import Generator

    generator = Generator.load(folder, order.device)
    own = scene.image_size
    raster = order.size or Raster(own, own)

    def draw(view: View) -> NDArray[np.float32]:
        rgba = generator.render(replace(inputs, view=view))
        if raster.shorter != own:
            from skimage.transform import resize

            side = raster.shorter
            rgba = resize(rgba, (side, side), anti_aliasing=side < own)
        return np.clip(rgba, 0, 1).astype(np.float32)

    return Drawer(
        draw,
        inputs,
        volume,
        scene.volume_name,
        scene.lighting,
        order.light or scene.light,
        lambda: f"the model {folder}",
        raster,
        lambda: None,
    )


def _refuse_for_a_model(order: RenderOrder) -> None:
    """Refuse what only renderers have."""
    if order.paths_are_asked_for:
        raise RenderError(
            "Samples, error and denoising are the path tracer's; leave them out, or choose its "
            "light."
        )
    if order.sample_distance is not None:
        raise RenderError(
            "A model's images have no samples along rays; leave --sample-distance out, or give "
            "--renderer raycast or vtk."
        )
    if order.volume.is_placed:
        raise RenderError(MODEL_RANGE)


def model_folder(model: Path | None, volume: Volume) -> Path:
    """Return the given model's folder, or that of the model shipped for a volume.

    Raises
    ------
    RenderError
        When no model is given and none is shipped for the volume.
    """
    folder = model or model_for(volume.fingerprint)
    if folder is None:
        names = ", ".join(str(path) for path in shipped_models()) or "none"
        raise RenderError(
            f"No shipped model was trained on '{volume.name}' (shipped: {names}); give --model."
        )
    return folder
