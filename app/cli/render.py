"""``render``: one image to a file, by the reference renderer or the generator."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from app.cli import options
from app.cli.console import console
from app.cli.outputs import check_outputs
from model.errors import RenderError
from model.generator.catalog import model_for, shipped_models
from model.networks.card import load_card
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.range_fitting import fit_to_range
from model.scene.scene import RendererName, Scene
from model.scene.transfer_function import Range, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource, volume_of

DEFAULT_SIZE = 256
DEFAULT_SAMPLE_DISTANCE = 0.5


@dataclass(frozen=True)
class RenderOrder:
    """Options of the ``render`` command; see :func:`app.cli.commands.render`."""

    renderer: str
    volume: VolumeSource
    model: Path | None
    view: str
    tf: Path | None
    lighting: options.LightingOption | None
    light: str | None
    size: int | None
    preintegrated: bool
    device: str
    backend: str
    precision: str
    out: Path


def render_to_file(order: RenderOrder) -> None:
    """Render an image and write it, replacing an existing file."""
    if order.out.suffix.lower() not in (".png", ".npy"):
        raise RenderError(f"{order.out}: the name must end in .png or .npy.")
    check_outputs(order.out)
    view = View.parse(order.view)
    light = LightDirection.parse(order.light) if order.light else None
    by = _render_generator if order.renderer == "generator" else _render_volume
    rgba = by(order, view, light)
    try:
        if order.out.suffix.lower() == ".npy":
            np.save(order.out, rgba)
        else:
            from skimage.io import imsave

            pixels = np.rint(np.clip(rgba[..., :3], 0, 1) * 255).astype(np.uint8)
            imsave(order.out, pixels, check_contrast=False)
    except OSError as error:
        raise RenderError(
            f"{order.out}: the image cannot be written ({error.strerror})."
        ) from error


def load_fitted(path: Path, scalar_range: Range) -> TransferFunction:
    """Load a TF; fit one made for another range to this range, and print a notice."""
    tf = TransferFunction.load(path)
    if tf.scalar_range != scalar_range:
        made, here = ("{:.6g} to {:.6g}".format(*r) for r in (tf.scalar_range, scalar_range))
        console.print(f"{path}: made for the scalar range {made} and fitted to {here}.")
    return fit_to_range(tf, scalar_range)


def _render_volume(
    order: RenderOrder, view: View, direction: LightDirection | None
) -> NDArray[np.float32]:
    from model.rendering.renderer import open_renderer

    scene = load_card(order.model).scene if order.model else None
    volume = _volume(order, scene)
    if order.tf:
        tf = load_fitted(order.tf, volume.scalar_range)
    else:
        tf = default_transfer_function(volume)
    if order.lighting is not None:
        lighting = options.lighting(order.lighting)
        light = None if lighting == "none" else LightDirection()
    else:
        lighting = scene.lighting if scene else "none"
        light = scene.light if scene else None
    if direction is not None and lighting == "none":
        raise RenderError("An unlit image has no light to be moved.", lighting="direct")
    step = scene.sample_distance if scene else DEFAULT_SAMPLE_DISTANCE
    name = cast(RendererName, order.renderer)
    renderer = open_renderer(name, volume, lighting, light, step, preintegrated=order.preintegrated)
    try:
        size = order.size or (scene.image_size if scene else DEFAULT_SIZE)
        return renderer.render(SceneInputs.of(view, tf, light=direction), size)
    finally:
        renderer.close()


def _render_generator(
    order: RenderOrder, view: View, light: LightDirection | None
) -> NDArray[np.float32]:
    from model.generator.generator import Generator

    if order.preintegrated:
        raise RenderError("Pre-integration is the ray caster's; give --renderer raycast.")
    folder = order.model or model_folder(None, order.volume.read())
    generator = Generator.load(folder, order.device, order.backend, order.precision)
    scene = generator.scene
    if order.lighting is not None and options.lighting(order.lighting) != scene.lighting:
        raise RenderError(
            f"The model was trained with the lighting '{scene.lighting}'; "
            "leave another one out, or train a model with it."
        )
    if light is not None and scene.light_range is None:
        kind = "without light" if scene.light is None else "with a fixed light"
        raise RenderError(f"The model was trained {kind}: it cannot follow another direction.")
    if order.tf:
        tf = load_fitted(order.tf, scene.scalar_range)
    else:
        tf = default_transfer_function(_volume(order, scene))
    rgba = generator.render(SceneInputs.of(view, tf, light=light))
    if order.size and order.size != scene.image_size:
        from skimage.transform import resize

        rgba = resize(rgba, (order.size, order.size), anti_aliasing=order.size < scene.image_size)
    return np.clip(rgba, 0, 1).astype(np.float32)


def _volume(order: RenderOrder, scene: Scene | None) -> Volume:
    if scene is None:
        return order.volume.read()
    return volume_of(scene.volume_fingerprint, scene.volume_name, order.volume)


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
