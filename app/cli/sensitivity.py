"""``sensitivity``: the derivative of an image by the opacity TF, as numbers or as an image."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.cli import options
from app.cli.outputs import check_outputs
from app.cli.plots import Curve, Plot, save_plots
from app.cli.render import DEFAULT_SIZE, load_fitted, model_folder
from model.errors import RenderError
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import default_scalar_window
from model.scene.tf_perturbation import EDIT_WIDTH, response_to_edits
from model.scene.transfer_function import TF_SAMPLES, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.display import beside_overlay, field_of_value
from model.volume_files.source import VolumeSource


@dataclass(frozen=True)
class SensitivityOrder:
    """Options of the ``sensitivity`` command; see :func:`app.cli.commands.sensitivity`."""

    volume: VolumeSource
    model: Path | None
    view: str
    tf: Path | None
    size: int | None
    region: str | None
    block: int
    value: float | None
    edit_width: float | None
    exact: bool
    lighting: options.LightingOption | None
    device: str
    out: Path


@dataclass(frozen=True)
class _Differentiated:
    """An image and its sensitivity.

    Attributes
    ----------
    image : ndarray of float32, shape (S, S, 3)
    sensitivity : ndarray of float32, shape (256,) or (n, n, 256)
    """

    image: NDArray[np.float32]
    sensitivity: NDArray[np.float32]


def save_sensitivity(order: SensitivityOrder) -> None:
    """Differentiate an image and write the result, replacing an existing file."""
    if order.out.suffix.lower() not in (".png", ".npz"):
        raise RenderError(f"{order.out}: the name must end in .png or .npz.")
    check_outputs(order.out)
    if order.exact and order.model is not None:
        raise RenderError("The exact sensitivity has no model; leave --exact or --model out.")
    if order.lighting is not None and not order.exact:
        raise RenderError("A model has the light that it was trained with; give --exact as well.")
    view = View.parse(order.view)
    region = Region.parse(order.region) if order.region else None
    volume = order.volume.read()
    tf = _transfer_function(order, volume)
    lo, hi = volume.scalar_range
    if order.value is not None and not lo <= order.value <= hi:
        raise RenderError(
            f"The value {order.value:g} is outside the volume's range; give {lo:g} to {hi:g}."
        )
    by = _by_renderer if order.exact else _by_generator
    result = by(order, volume, SceneInputs.of(view, tf), region)
    try:
        if order.out.suffix.lower() == ".npz":
            _save_numbers(order.out, result, volume, tf)
        elif region is not None:
            _save_plot(order, result, volume, tf, region)
        else:
            from skimage.io import imsave

            field = field_of_value(result.sensitivity, order.value, volume.scalar_range)
            picture = beside_overlay(result.image, field, order.block)
            imsave(order.out, np.rint(picture * 255).astype(np.uint8), check_contrast=False)
    except OSError as error:
        raise RenderError(f"{order.out}: it cannot be written ({error.strerror}).") from error


def _by_renderer(
    order: SensitivityOrder, volume: Volume, inputs: SceneInputs, region: Region | None
) -> _Differentiated:
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.sensitivity.exact import sensitivity_field
    from model.sensitivity.rendered import region_responses

    size, width = order.size or DEFAULT_SIZE, _edit_width(order)
    renderer = RaycastRenderer(
        volume, options.lighting(order.lighting or options.LightingOption.NONE)
    )
    try:
        image = renderer.render(inputs, size)[..., :3]
        if not renderer.is_differentiable and (region is None or width < 1):
            raise RenderError(
                "Under global light there is the sensitivity of a region to edits at least 1 wide; "
                "give --region, or another --lighting."
            )
        if region is not None:
            found = region_responses(renderer, inputs, size, region, width)
        else:
            slopes = sensitivity_field(renderer, inputs, size, order.block)
            found = response_to_edits(slopes, width)
    finally:
        renderer.close()
    return _Differentiated(image, found)


def _by_generator(
    order: SensitivityOrder, volume: Volume, inputs: SceneInputs, region: Region | None
) -> _Differentiated:
    from model.generator.generator import Generator
    from model.sensitivity.learned import Sensitivity

    generator = Generator.load(model_folder(order.model, volume), order.device)
    scene = generator.scene
    if scene.volume_fingerprint != volume.fingerprint:
        raise RenderError(
            f"The model was trained on '{scene.volume_name}', not on '{volume.name}'; "
            "name its volume by --volume."
        )
    if order.size not in (None, scene.image_size):
        raise RenderError(
            f"The model draws {scene.image_size} x {scene.image_size} pixels; leave --size out."
        )
    found = Sensitivity(generator, inputs, _edit_width(order))
    sensitivity = found.region(region) if region is not None else found.field(order.block)
    return _Differentiated(np.clip(found.image, 0, 1), sensitivity)


def _edit_width(order: SensitivityOrder) -> float:
    return EDIT_WIDTH if order.edit_width is None else order.edit_width


def _transfer_function(order: SensitivityOrder, volume: Volume) -> TransferFunction:
    if order.tf is None:
        return default_transfer_function(volume)
    return load_fitted(order.tf, volume.scalar_range)


def _save_numbers(out: Path, result: _Differentiated, volume: Volume, tf: TransferFunction) -> None:
    np.savez_compressed(
        out,
        scalar_values=np.linspace(*volume.scalar_range, TF_SAMPLES),
        opacity=tf.opacity.sample(),
        sensitivity=result.sensitivity,
        image=result.image,
    )


def _save_plot(
    order: SensitivityOrder,
    result: _Differentiated,
    volume: Volume,
    tf: TransferFunction,
    region: Region,
) -> None:
    values = np.linspace(*volume.scalar_range, TF_SAMPLES)
    label = f"scalar value{f' ({volume.units})' if volume.units else ''}"
    place = f"({region.left}, {region.top}) to ({region.right}, {region.bottom})"
    kind = "exact" if order.exact else "of the generator"
    if order.lighting == "global":
        kind = "by differences"
    sensitivity = Curve("sensitivity", values, result.sensitivity)
    limit = _limit(result.sensitivity, volume)
    title = f"Sensitivity of the region {place}, {kind}"
    if limit is not None and np.abs(result.sensitivity).max() > limit:
        title += f"; reaches {result.sensitivity[np.abs(result.sensitivity).argmax()]:.3g}"
    opacity = Curve("opacity", values, tf.opacity.sample())
    plots = [
        Plot(title, label, "change of the l2 norm per opacity", (sensitivity,), y_limit=limit),
        Plot("Opacity TF", label, "opacity", (opacity,)),
    ]
    save_plots(order.out, plots, height=300)


def _limit(sensitivity: NDArray[np.float32], volume: Volume) -> float | None:
    """Limit of the plot's axis, by the values of the scalar window.

    Sensitivities to background values may be 100 times larger.
    """
    values = np.linspace(*volume.scalar_range, TF_SAMPLES)
    lo, hi = default_scalar_window(volume)
    inside = np.abs(sensitivity[(values >= lo) & (values <= hi)])
    return 1.2 * float(inside.max(initial=0.0)) or None
