"""``sensitivity``: the exact derivative of a rendering, as numbers or as a picture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from skimage.io import imsave
from skimage.transform import resize

from app.cli import options
from app.plots import Curve, Plot, save_plots
from model.default_transfer_function import default_transfer_function
from model.errors import RenderError
from model.range_fitting import fit_to_range
from model.transfer_function import TF_SAMPLES, TransferFunction
from model.view import View
from model.volume import Volume

if TYPE_CHECKING:
    from model.rendering.raycast.renderer import RaycastRenderer

RISING, FALLING = np.array([1.0, 0.35, 0.1]), np.array([0.2, 0.5, 1.0])
"""Colours of a field: more opacity brightens, more opacity darkens."""

BACKDROP = 0.35
"""Brightness of the image behind a field."""


@dataclass(frozen=True)
class SensitivityOrder:
    """What to differentiate: the command's options, see there."""

    volume: options.VolumeSource
    view: str
    tf: Path | None
    size: int
    region: str | None
    block: int
    value: float | None
    exact: bool
    out: Path


def save_sensitivity(order: SensitivityOrder) -> None:
    """Differentiate a rendering and write the result; an existing file is replaced."""
    from model.exact_sensitivity import Region
    from model.rendering.raycast.renderer import RaycastRenderer

    if not order.exact:
        raise RenderError(
            "The sensitivity of a generator is not there yet; add --exact for the renderer's own."
        )
    if order.out.suffix.lower() not in (".png", ".npz"):
        raise RenderError(f"{order.out}: the name must end in .png or .npz.")
    view = View.parse(order.view)
    region = Region.parse(order.region) if order.region else None
    volume = order.volume.read()
    tf = _transfer_function(order, volume)
    lo, hi = volume.scalar_range
    if order.value is not None and not lo <= order.value <= hi:
        raise RenderError(
            f"The value {order.value:g} is outside the volume's range; give {lo:g} to {hi:g}."
        )
    renderer = RaycastRenderer(volume)
    try:
        if region is not None:
            _save_region(order, renderer, volume, view, tf, region)
        else:
            _save_field(order, renderer, volume, view, tf)
    except OSError as error:
        raise RenderError(f"{order.out}: it cannot be written ({error.strerror}).") from error
    finally:
        renderer.close()


def _transfer_function(order: SensitivityOrder, volume: Volume) -> TransferFunction:
    if order.tf is None:
        return default_transfer_function(volume)
    return fit_to_range(TransferFunction.load(order.tf), volume.scalar_range)


def _save_region(
    order: SensitivityOrder,
    renderer: RaycastRenderer,
    volume: Volume,
    view: View,
    tf: TransferFunction,
    region: object,
) -> None:
    from model.exact_sensitivity import Region, region_sensitivity

    assert isinstance(region, Region)
    sensitivity = region_sensitivity(renderer, view, tf, order.size, region)
    values = np.linspace(*volume.scalar_range, TF_SAMPLES)
    opacity = tf.opacity.sample()
    if order.out.suffix.lower() == ".npz":
        rgba = renderer.render(view, tf.opacity, tf.color, order.size)
        np.savez_compressed(
            order.out, scalar_values=values, sensitivity=sensitivity, opacity=opacity, image=rgba
        )
        return
    label = f"scalar value{f' ({volume.units})' if volume.units else ''}"
    place = f"({region.left}, {region.top}) to ({region.right}, {region.bottom})"
    save_plots(
        order.out,
        [
            Plot(
                f"Sensitivity of the region {place}, exact",
                label,
                "change of the norm per opacity",
                (Curve("sensitivity", values, sensitivity),),
                y_limit=_limit(sensitivity),
            ),
            Plot("Opacity TF", label, "opacity", (Curve("opacity", values, opacity),)),
        ],
        height=300,
    )


def _limit(sensitivity: NDArray[np.float32]) -> float | None:
    """End of the axis: background values react a hundred times as strongly as all others."""
    limit = 1.2 * float(np.percentile(np.abs(sensitivity), 97))
    return limit or None


def _save_field(
    order: SensitivityOrder,
    renderer: RaycastRenderer,
    volume: Volume,
    view: View,
    tf: TransferFunction,
) -> None:
    from model.exact_sensitivity import sensitivity_field

    field = sensitivity_field(renderer, view, tf, order.size, order.block)
    rgba = renderer.render(view, tf.opacity, tf.color, order.size)
    if order.out.suffix.lower() == ".npz":
        values = np.linspace(*volume.scalar_range, TF_SAMPLES)
        opacity = tf.opacity.sample()
        np.savez_compressed(
            order.out, scalar_values=values, sensitivity=field, opacity=opacity, image=rgba
        )
        return
    picture = _picture(_of_value(field, order.value, volume), rgba, order.block)
    imsave(order.out, np.rint(picture * 255).astype(np.uint8), check_contrast=False)


def _of_value(
    field: NDArray[np.float32], value: float | None, volume: Volume
) -> NDArray[np.float32]:
    """The field of one scalar value; without one, the mean of all, each by its own maximum."""
    if value is None:
        strength = np.abs(field)
        return np.asarray((strength / (strength.max(axis=(0, 1)) + 1e-12)).mean(axis=-1))
    lo, hi = volume.scalar_range
    position = (value - lo) / (hi - lo) * (TF_SAMPLES - 1)
    lower = min(int(position), TF_SAMPLES - 2)
    share = position - lower
    return np.asarray((1 - share) * field[..., lower] + share * field[..., lower + 1])


def _picture(
    field: NDArray[np.float32], rgba: NDArray[np.float32], block: int
) -> NDArray[np.float64]:
    """The rendering, and beside it the field in colour over the dimmed rendering."""
    size = len(rgba)
    blocks = np.kron(field, np.ones((block, block)))[:size, :size]
    if block > 1:
        # Soft steps between the blocks; their values are kept at the middles.
        blocks = resize(field, (size, size), order=1, mode="edge", anti_aliasing=False)
    strength = np.clip(blocks / (np.abs(field).max() or 1.0), -1, 1)[..., None]
    color = np.where(strength > 0, RISING, FALLING)
    gray = BACKDROP * rgba[..., :3].mean(axis=-1, keepdims=True)
    overlay = gray * (1 - np.abs(strength)) + color * np.abs(strength)
    return np.concatenate([rgba[..., :3], overlay], axis=1)
