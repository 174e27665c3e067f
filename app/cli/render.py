"""``render``: one image to a file, by the reference renderer or the generator."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from app.cli import choices
from app.cli.captions import range_text, view_text
from app.cli.console import console, warn
from app.cli.outputs import make_room_for
from model.errors import RenderError, reason
from model.files import writing
from model.generator.catalog import model_for, shipped_models
from model.networks.card import load_card
from model.scene.crop import CropBox
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs, outside_range
from model.scene.light import LightDirection
from model.scene.narrow_part import narrow_part
from model.scene.range_fitting import fit_to_range, fit_to_volume
from model.scene.scene import Lighting, RendererName, Scene
from model.scene.tf_perturbation import with_opacity
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import SCALE_NAMES, ValueScale, values_at
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource, volume_of

DEFAULT_SIZE = 256
DEFAULT_SAMPLE_DISTANCE = 0.5

MODEL_RANGE = (
    "A model draws over the range and scale that it was trained on; leave --range and --scale out."
)


@dataclass(frozen=True)
class RenderOrder:
    """Options of the ``render`` command; see :func:`app.cli.image_commands.render`."""

    renderer: str
    volume: VolumeSource
    model: Path | None
    view: View
    tf: Path | None
    lighting: choices.LightingOption | None
    light: LightDirection | None
    crop: CropBox | None
    size: int | None
    brightness: float | None
    draws_missing: bool
    preintegrated: bool
    device: str
    backend: str
    precision: str
    out: Path
    code: tuple[float, ...] | None = None


@dataclass(frozen=True, eq=False)
class _Rendered:
    """A rendered image and what it shows.

    Attributes
    ----------
    rgba : ndarray of float32, shape (S, S, 4)
    inputs : SceneInputs
    volume_name : str
    lighting : {"none", "direct", "global"}
    light : LightDirection or None
        None where it is unlit.
    renderer : str
        Who drew it, for people.
    """

    rgba: NDArray[np.float32]
    inputs: SceneInputs
    volume_name: str
    lighting: Lighting
    light: LightDirection | None
    renderer: str

    def facts(self) -> dict[str, str]:
        """Return the texts of a PNG file."""
        tf = self.inputs.transfer_function
        facts = {
            "Title": f"{self.volume_name}, by {self.renderer}",
            "Volume": self.volume_name,
            "View": view_text(self.inputs.view),
            "Lighting": self.lighting,
            "Renderer": self.renderer,
            "Scalar range": range_text(tf.scalar_range, tf.scale),
            "Transfer function": json.dumps(tf.to_json()),
        }
        if self.light is not None:
            facts["Light"] = f"{self.light.azimuth:g},{self.light.elevation:g}"
        if self.inputs.crop is not None:
            planes = zip(self.inputs.crop.low, self.inputs.crop.high, strict=True)
            facts["Crop"] = ",".join(f"{low:g},{high:g}" for low, high in planes)
        return facts


def render_to_file(order: RenderOrder) -> None:
    """Render an image and write it, replacing an existing file."""
    if order.light is not None and order.lighting == choices.LightingOption.NONE:
        raise RenderError("An unlit image has no light to be moved.", lighting="direct")
    if order.code is not None and order.renderer != "generator":
        raise RenderError("A latent code is a model's.", renderer="generator")
    by = _render_generator if order.renderer == "generator" else _render_volume
    rendered = by(order)
    make_room_for(order.out)
    if order.out.suffix.lower() == ".npy":
        try:
            # An open file, as numpy appends a suffix to names in capitals.
            with writing(order.out) as file:
                np.save(file, rendered.rgba)
        except OSError as error:
            raise RenderError(
                f"{order.out}: the image cannot be written ({reason(error)})."
            ) from error
    else:
        from app.figures.picture import save_picture
        from model.rendering.brightness import brighten, usual_brightness

        facts, brightness = rendered.facts(), order.brightness
        if brightness is None:
            brightness = usual_brightness(rendered.lighting)
        if brightness != 1:
            facts["Brightness"] = f"{brightness:g}"
        colors = np.clip(rendered.rgba[..., :3], 0, 1)
        brighten(colors, brightness)
        save_picture(order.out, colors, facts)


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
    path: Path | None, volume: Volume, keeps_range: bool
) -> tuple[TransferFunction, Volume]:
    """Return the TF of a file, or a volume's first one, and the volume over the TF's range.

    Parameters
    ----------
    path : Path or None
    volume : Volume
    keeps_range : bool
        Whether the volume's range or scale was chosen, so that the TF is fitted to it; otherwise
        the file's range is taken where it fits the volume, and its scale.
    """
    if path is None:
        return default_transfer_function(volume), volume
    if keeps_range:
        fitted = load_fitted(path, volume.scalar_range, volume.scale)
    else:
        tf = TransferFunction.load(path)
        fitted = _noticed(path, tf, fit_to_volume(tf, volume))
        volume = volume.over(fitted.scalar_range, fitted.scale)
    narrow = narrow_part(fitted.opacity)
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


def _render_volume(order: RenderOrder) -> _Rendered:
    scene = load_card(order.model).scene if order.model else None
    if order.lighting is not None:
        lighting = choices.lighting(order.lighting)
        light = None if lighting == "none" else LightDirection()
    else:
        lighting = scene.lighting if scene else "none"
        light = scene.light if scene else None
    if order.light is not None and lighting == "none":
        raise RenderError("An unlit image has no light to be moved.", lighting="direct")
    chosen = order.volume.is_placed
    volume = order.volume.read() if scene is None or chosen else volume_of(scene, order.volume)
    tf, volume = choose_tf(order.tf, volume, chosen or scene is not None)
    if order.draws_missing:
        volume = volume.drawing_missing(True)
    from model.rendering.fallback import FallbackRenderer
    from model.rendering.renderer import Renderer, open_renderer

    step = scene.sample_distance if scene else DEFAULT_SAMPLE_DISTANCE
    name = cast(RendererName, order.renderer)
    renderer: Renderer
    if name == "vtk" and not order.preintegrated:
        renderer = FallbackRenderer(volume, lighting, light, step)
    else:
        renderer = open_renderer(
            name, volume, lighting, light, step, preintegrated=order.preintegrated
        )
    inputs = SceneInputs.of(order.view, tf, light=order.light, crop=order.crop)
    try:
        size = order.size or (scene.image_size if scene else DEFAULT_SIZE)
        rgba = renderer.render(inputs, size)
    finally:
        renderer.close()
    by = {"vtk": "VTK", "raycast": "the ray caster"}[name]
    if isinstance(renderer, FallbackRenderer) and renderer.reason:
        warn(renderer.reason)
        by = "the ray caster"
    if order.preintegrated:
        by += ", pre-integrated"
    return _Rendered(rgba, inputs, volume.name, lighting, order.light or light, by)


def _render_generator(order: RenderOrder) -> _Rendered:
    if order.preintegrated:
        raise RenderError("Pre-integration is the ray caster's; give --renderer raycast.")
    if order.volume.is_placed:
        raise RenderError(MODEL_RANGE)
    folder = order.model or model_folder(None, order.volume.read())
    scene = load_card(folder).scene
    if order.lighting is not None and choices.lighting(order.lighting) != scene.lighting:
        raise RenderError(
            f"The model was trained with the lighting '{scene.lighting}'; "
            "leave another one out, or train a model with it."
        )
    if order.light is not None and scene.light_range is None:
        kind = "without light" if scene.light is None else "with a fixed light"
        raise RenderError(f"The model was trained {kind}: it cannot follow another direction.")
    if order.tf:
        tf = load_fitted(order.tf, scene.scalar_range, scene.scale)
    else:
        tf = default_transfer_function(volume_of(scene, order.volume))
    inputs = SceneInputs.of(order.view, tf, light=order.light, crop=order.crop)
    warn_outside(inputs, scene)
    from model.generator.generator import Generator

    generator = Generator.load(folder, order.device, order.backend, order.precision)
    drawn_from = ""
    if order.code is None:
        rgba = generator.render(inputs)
    else:
        code = np.array(order.code, dtype=np.float32)
        rgba = generator.render_latent(code, inputs)
        inputs = with_opacity(inputs, generator.decode(code))
        drawn_from = f", from the latent code {','.join(f'{n:g}' for n in order.code)}"
    if order.size and order.size != scene.image_size:
        from skimage.transform import resize

        rgba = resize(rgba, (order.size, order.size), anti_aliasing=order.size < scene.image_size)
    return _Rendered(
        np.clip(rgba, 0, 1).astype(np.float32),
        inputs,
        scene.volume_name,
        scene.lighting,
        order.light or scene.light,
        f"the model {folder}{drawn_from}",
    )


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
