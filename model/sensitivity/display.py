"""Sensitivities for display: unit, scale with a floor, colours.

The unit is the change of a pixel's value (0 to 1) by an edit that raises the opacity by .01 where
it is highest. Colour maps are perceptually uniform and safe for the colour-blind.
"""

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.scene.region import block_edges
from model.scene.tf_perturbation import edit_around
from model.scene.transfer_function import TF_SAMPLES, Range

Measure = Literal["change", "signed"]
"""Measure of a region's reaction to an edit of the opacity TF.

"signed" is the paper's (Eq. 11): the change of the l2 norm of the region's colours, above 0 if they
become brighter. It is 0 for a black region, and if equal parts become brighter and darker. "change"
is the l2 norm of the colours' change."""

SMALL_EDIT = 0.01  # peak opacity of the displayed unit's edits
UNIT = "change of pixel value per +.01 opacity"

FLOOR = 1 / 2550  # least end of a scale: a tenth of an 8-bit step, the size of rounding
LEAST_DIFFERENCE = 1 / 255  # least end of a scale of differences of images: an 8-bit step
Shown = Measure | Literal["visible"]

COLOR_MAPS = {
    "change": "matplotlib:inferno",
    "signed": "crameri:berlin",
    # Green, as visibility is in the plot of the TF.
    "visible": "cmocean:algae_r",
    # Its lowest colour is not black, as most fields are much weaker than the strongest.
    "all values": "matplotlib:plasma",
}
"""Colour maps by field; the last for one that is coloured by all values' fields."""

BACKDROP = 0.45  # brightness of the grey image behind a field
_OPAQUE_FROM = 0.35  # share of the scale from which colours are opaque
_CLIP_QUANTILE = 0.998  # share of the pixels within the scale; single pixels do not set it


def per_small_edit(edit: NDArray[np.floating]) -> float:
    """Factor from derivatives per unit of an edit to changes per :data:`SMALL_EDIT`."""
    return SMALL_EDIT / float(np.abs(edit).max())


def shown_responses(
    responses: NDArray[np.floating], pixels: int, width: float
) -> NDArray[np.float64]:
    """Convert responses (256,) of a norm over this many pixels to the change of their RMS value.

    They are per unit of opacity; the width is the edits' standard deviation in bins.
    """
    middle = edit_around(0.5, (0.0, 1.0), width)
    return np.asarray(responses, dtype=np.float64) * per_small_edit(middle) / np.sqrt(3 * pixels)


def shown_field(
    changes: NDArray[np.floating], edit: NDArray[np.floating], measure: Measure
) -> NDArray[np.float64]:
    """Convert changes (S, S, 3) per unit of an edit (256,) to a displayed field (S, S)."""
    scaled = changes.astype(np.float64) * per_small_edit(edit)
    if measure == "signed":
        return np.asarray(scaled.mean(axis=-1))
    return np.asarray(np.sqrt(np.square(scaled).mean(axis=-1)))


def scale_of(field: NDArray[np.floating], least: float = FLOOR) -> float:
    """Return the end of a field's scale, or the least one."""
    return max(float(np.quantile(np.abs(field), _CLIP_QUANTILE)), least)


def color_bar(measure: Shown | Literal["all values"], count: int = 64) -> NDArray[np.float64]:
    """Return the colours of a scale from its lowest to its highest value, shape (count, 3)."""
    return _table(measure)[np.linspace(0, len(_table(measure)) - 1, count).round().astype(int)]


def overlay(
    image: NDArray[np.floating], field: NDArray[np.floating], scale: float, measure: Shown
) -> NDArray[np.float64]:
    """Colour a field (S, S) by its scale over its image (S, S, 3) in dim grey."""
    table = _table(measure)
    share = np.clip(np.nan_to_num(field) / scale, -1, 1)
    place = (share + 1) / 2 if measure == "signed" else np.abs(share)
    colors = table[np.rint(place * (len(table) - 1)).astype(int)]
    alpha = np.clip(np.abs(share) / _OPAQUE_FROM, 0, 1)[..., None]
    return _over_gray(image, colors, alpha)


def on_white(colors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Exchange light and dark of colours (..., 3): white for black, and the same hues."""
    most, least = (end(colors, axis=-1, keepdims=True) for end in (np.max, np.min))
    return np.asarray(colors + 1 - most - least)


def field_of_value(
    field: NDArray[np.float32], value: float | None, scalar_range: Range
) -> NDArray[np.float32]:
    """Select the field (rows, columns) of a scalar value from those of all (rows, columns, 256).

    None takes the mean strength over all values, each relative to its own maximum.
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


@lru_cache(maxsize=4)
def _table(measure: str) -> NDArray[np.float64]:
    """Colours of a map, shape (256, 3)."""
    # Imported here to keep the window's start fast.
    from cmap import Colormap

    return np.asarray(Colormap(COLOR_MAPS[measure]).lut(256)[:, :3], dtype=np.float64)


def global_scale(fields: NDArray[np.floating], pixels: int, width: float) -> float:
    """Return the largest scale of any value, of fields (rows, columns, 256) of blocks."""
    shown = shown_responses(fields, pixels, width)
    return max(scale_of(shown[..., index]) for index in range(shown.shape[-1]))


def overlay_globally(
    image: NDArray[np.floating], field: NDArray[np.floating], scale: float, whole: float
) -> NDArray[np.float64]:
    """Colour a field (S, S) by the scale of all values and make it opaque by its own.

    As in section 5.1.2 of the paper. One colour scale for all values makes fields comparable: its
    last colour is at `whole`, see :func:`global_scale`. The field's own scale for opacity makes
    the strongest place of a weak field visible: opacity is full at `scale`.
    """
    strength = np.abs(np.nan_to_num(field))
    table = _table("all values")
    place = np.clip(strength / whole, 0, 1)
    colors = table[np.rint(place * (len(table) - 1)).astype(int)]
    alpha = np.clip(strength / scale, 0, 1)[..., None]
    return _over_gray(image, colors, alpha)


def _over_gray(
    image: NDArray[np.floating], colors: NDArray[np.float64], alpha: NDArray[np.floating]
) -> NDArray[np.float64]:
    gray = BACKDROP * np.clip(image, 0, 1).mean(axis=-1, keepdims=True)
    return np.asarray(gray * (1 - alpha) + colors * alpha)


NEGLIGIBLE = 1e-10  # norm of displayed responses up to which they are rounding errors


def cosine(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Cosine similarity of two vectors; 0 if either is zero."""
    a, b = one.astype(np.float64), other.astype(np.float64)
    norms = np.linalg.norm(a) * np.linalg.norm(b)
    return float(a @ b / norms) if norms > 0 else 0.0


def agreement(learned: NDArray[np.float64], exact: NDArray[np.float64]) -> float | None:
    """Cosine of responses in the displayed unit; None if they are only rounding errors."""
    is_there = max(np.linalg.norm(learned), np.linalg.norm(exact)) >= NEGLIGIBLE
    return cosine(learned, exact) if is_there else None
