"""The paper's two scales of a value's field: colours by all values, opacity by the one selected.

Section 5.1.2 of the paper colours the field of a selected value by the range over the fields of
all values, so that colours compare between selections, and maps the field's own range to opacity,
so that where a weak field is strongest can be seen. :mod:`model.sensitivity.display` has the
scale that is the window's own: both by the selected field.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from model.sensitivity.display import BACKDROP, scale_of, shown_responses

GLOBAL_COLOR_MAP = "matplotlib:plasma"
"""Sequential map whose lowest colour is no black: most fields are weak beside the strongest."""


def global_scale(fields: NDArray[np.floating], pixels: int, width: float) -> float:
    """Return the value at the end of the scale of all values' fields, in the displayed unit.

    Parameters
    ----------
    fields : ndarray, shape (rows, columns, 256)
        Sensitivity of each block of the image to edits at each scalar value.
    pixels : int
        Number of a block's pixels.
    width : float
        Standard deviation of the edits in bins.
    """
    return scale_of(shown_responses(fields, pixels, width))


def overlay_globally(
    image: NDArray[np.floating],
    field: NDArray[np.floating],
    scale: float,
    whole: float,
) -> NDArray[np.float64]:
    """Colour a field by the scale of all values and make it opaque by its own, over dim grey.

    Parameters
    ----------
    image : ndarray, shape (S, S, 3)
        In [0, 1].
    field : ndarray, shape (S, S)
        Of changes or signed ones, whose size is shown; in the displayed unit.
    scale : float
        Value of full opacity: the end of the selected field's scale.
    whole : float
        Value of the last colour; see :func:`global_scale`.

    Returns
    -------
    ndarray of float64, shape (S, S, 3), in [0, 1]
    """
    strength = np.abs(np.nan_to_num(field))
    table = _table()
    place = np.clip(strength / whole, 0, 1)
    colors = table[np.rint(place * (len(table) - 1)).astype(int)]
    alpha = np.clip(strength / scale, 0, 1)[..., None]
    gray = BACKDROP * np.clip(image, 0, 1).mean(axis=-1, keepdims=True)
    return np.asarray(gray * (1 - alpha) + colors * alpha)


def global_color_bar(count: int = 64) -> NDArray[np.float64]:
    """Return the colours of that scale from 0 to its end, shape (count, 3)."""
    return _table()[np.linspace(0, len(_table()) - 1, count).round().astype(int)]


@lru_cache(maxsize=1)
def _table() -> NDArray[np.float64]:
    """Colours of the map, shape (256, 3)."""
    # Imported here: the window starts without it.
    from cmap import Colormap

    return np.asarray(Colormap(GLOBAL_COLOR_MAP).lut(256)[:, :3], dtype=np.float64)
