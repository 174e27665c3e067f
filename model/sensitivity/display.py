"""Sensitivities as they are shown: in a unit, by a scale with a floor, in colours.

The unit is the change of a pixel's value (0 to 1) by an edit that raises the opacity by
.01 where it is highest. Fields of changes have a sequential colour map, signed ones a
diverging one; both are perceptually uniform and safe for the colour-blind.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.scene.region import block_edges
from model.scene.tf_perturbation import edit_around
from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.measure import Measure

SMALL_EDIT = 0.01
"""Opacity that the edits of the displayed unit add where they are highest."""

UNIT = "change of pixel value per +.01 opacity"

FLOOR = 1 / 2550
"""Smallest value at the end of a scale: a tenth of an 8-bit step. What is below is rounding."""

LEAST_DIFFERENCE = 1 / 255
"""Smallest value at the end of a scale of differences between images: an 8-bit step."""

Shown = Measure | Literal["visible"]
"""Fields that are shown: by a measure, or how much of a pixel shows some values."""

COLOR_MAPS: dict[Shown, str] = {
    "change": "matplotlib:inferno",
    "signed": "crameri:berlin",
    # Green, as visibility is in the plot of the TF.
    "visible": "cmocean:algae_r",
}

BACKDROP = 0.45
"""Brightness of the grey image behind a field."""

_OPAQUE_FROM = 0.35
"""Part of the scale from which colours are opaque."""

_CLIP_QUANTILE = 0.998
"""Share of the pixels within the scale; single pixels do not set it."""


def per_small_edit(edit: NDArray[np.floating]) -> float:
    """Factor from derivatives per unit of an edit to changes per :data:`SMALL_EDIT`.

    Parameters
    ----------
    edit : ndarray, shape (256,)
    """
    return SMALL_EDIT / float(np.abs(edit).max())


def shown_responses(
    responses: NDArray[np.floating], pixels: int, width: float
) -> NDArray[np.float64]:
    """Convert a region's responses to the displayed unit: the change of its pixels' RMS value.

    Parameters
    ----------
    responses : ndarray, shape (256,)
        Change of a norm over the region's colours, per unit of opacity.
    pixels : int
        Number of the region's pixels.
    width : float
        Standard deviation of the edits in bins.
    """
    middle = edit_around(0.5, (0.0, 1.0), width)
    return np.asarray(responses, dtype=np.float64) * per_small_edit(middle) / np.sqrt(3 * pixels)


def shown_field(
    changes: NDArray[np.floating], edit: NDArray[np.floating], measure: Measure
) -> NDArray[np.float64]:
    """Convert changes of an image's colours to one number per pixel, in the displayed unit.

    Parameters
    ----------
    changes : ndarray, shape (S, S, 3)
        Per unit of the edit.
    edit : ndarray, shape (256,)
    measure : {"change", "signed"}
        Root mean square over the colours, or their mean.

    Returns
    -------
    ndarray of float64, shape (S, S)
    """
    scaled = changes.astype(np.float64) * per_small_edit(edit)
    if measure == "signed":
        return np.asarray(scaled.mean(axis=-1))
    return np.asarray(np.sqrt(np.square(scaled).mean(axis=-1)))


def scale_of(field: NDArray[np.floating], least: float = FLOOR) -> float:
    """Return the value at the end of a field's scale, or the least one."""
    return max(float(np.quantile(np.abs(field), _CLIP_QUANTILE)), least)


def color_bar(measure: Shown, count: int = 64) -> NDArray[np.float64]:
    """Return the colours of a scale from its lowest to its highest value, shape (count, 3)."""
    return _table(measure)[np.linspace(0, len(_table(measure)) - 1, count).round().astype(int)]


def overlay(
    image: NDArray[np.floating],
    field: NDArray[np.floating],
    scale: float,
    measure: Shown,
) -> NDArray[np.float64]:
    """Colour a field over its image, which is shown in dim grey.

    Parameters
    ----------
    image : ndarray, shape (S, S, 3)
        In [0, 1].
    field : ndarray, shape (S, S)
        In the displayed unit.
    scale : float
        Value of the full colour; see :func:`scale_of`.
    measure : {"change", "signed", "visible"}

    Returns
    -------
    ndarray of float64, shape (S, S, 3), in [0, 1]
    """
    table = _table(measure)
    share = np.clip(np.nan_to_num(field) / scale, -1, 1)
    place = (share + 1) / 2 if measure == "signed" else np.abs(share)
    colors = table[np.rint(place * (len(table) - 1)).astype(int)]
    alpha = np.clip(np.abs(share) / _OPAQUE_FROM, 0, 1)[..., None]
    gray = BACKDROP * np.clip(image, 0, 1).mean(axis=-1, keepdims=True)
    return np.asarray(gray * (1 - alpha) + colors * alpha)


def field_of_value(
    field: NDArray[np.float32], value: float | None, scalar_range: Range
) -> NDArray[np.float32]:
    """Select the field of one scalar value from those of all.

    Parameters
    ----------
    field : ndarray of float32, shape (rows, columns, 256)
        Over scalar values from one end of the range to the other.
    value : float or None
        In the data's units, inside the range; None takes the mean strength over all
        values, each relative to its own maximum.

    Returns
    -------
    ndarray of float32, shape (rows, columns)
    """
    if value is None:
        strength = np.abs(field)
        return np.asarray((strength / (strength.max(axis=(0, 1)) + 1e-12)).mean(axis=-1))
    lo, hi = scalar_range
    position = (value - lo) / (hi - lo) * (TF_SAMPLES - 1)
    lower = min(int(position), TF_SAMPLES - 2)
    share = position - lower
    return np.asarray((1 - share) * field[..., lower] + share * field[..., lower + 1])


def spread_blocks(field: NDArray[np.float32], size: int, block: int) -> NDArray[np.float32]:
    """Repeat a field of blocks (rows, columns) over the pixels of an image, (size, size)."""
    edges = np.diff(block_edges(size, block))
    return field.repeat(edges, axis=0).repeat(edges, axis=1)


@lru_cache(maxsize=3)
def _table(measure: Shown) -> NDArray[np.float64]:
    """Colours of a map, shape (256, 3)."""
    # Imported here: the window starts without it.
    from cmap import Colormap

    return np.asarray(Colormap(COLOR_MAPS[measure]).lut(256)[:, :3], dtype=np.float64)
