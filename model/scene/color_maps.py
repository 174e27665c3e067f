"""Perceptually uniform colour maps as colour TFs, from the library `cmap`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import ColorTF, Range

COLOR_MAPS: dict[str, str] = {
    "Viridis": "bids:viridis",
    "Magma": "bids:magma",
    "Inferno": "bids:inferno",
    "Plasma": "bids:plasma",
    "Cividis": "cividis:cividis",
    "Batlow": "crameri:batlow",
    "Grey": "matlab:gray",
    "Blue, white, red (diverging)": "matplotlib:coolwarm",
}
"""Names of colour maps in `cmap`, by the names that users see."""

MAP_STOPS = 9
"""Number of stops of a colour TF made from a map: as many as a user can move."""


def map_colors(name: str, count: int) -> NDArray[np.float64]:
    """Return colours (count, 3), in [0, 1], spread evenly over a map of :data:`COLOR_MAPS`."""
    # Imported here: the window is to start without it.
    from cmap import Colormap

    colors = Colormap(COLOR_MAPS[name])(np.linspace(0.0, 1.0, count))
    return np.asarray(colors, dtype=np.float64)[:, :3].clip(0.0, 1.0)


def color_tf_of_map(name: str, scalar_range: Range) -> ColorTF:
    """Return a colour TF of nine stops, evenly over a range.

    Parameters
    ----------
    name : str
        A key of :data:`COLOR_MAPS`.
    """
    lo, hi = scalar_range
    values = [lo, *np.linspace(lo, hi, MAP_STOPS)[1:-1].tolist(), hi]
    colors = map_colors(name, MAP_STOPS).tolist()
    stops = tuple((v, r, g, b) for v, (r, g, b) in zip(values, colors, strict=True))
    return ColorTF(scalar_range, stops)


def reversed_colors(color: ColorTF) -> ColorTF:
    """Return the colour TF mirrored in the middle of its range."""
    lo, hi = color.scalar_range
    # The ends stay exact; in a narrow range far from zero, lo + hi - hi would be rounded.
    mirrored = {lo: hi, hi: lo}
    stops = tuple(
        (mirrored.get(value, min(max(lo + (hi - value), lo), hi)), *rgb)
        for value, *rgb in reversed(color.stops)
    )
    return ColorTF(color.scalar_range, stops)  # type: ignore[arg-type]
