"""Colour maps as colour TFs, from the library `cmap`, and CIELAB colours for the networks."""

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
    """Return a colour TF of nine stops, evenly over a range."""
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


LAB_LOW = np.array([0.0, -86.185, -107.863])
LAB_HIGH = np.array([100.0, 98.254, 94.482])
"""Extent of the RGB cube in CIELAB (L, a, b)."""


def rgb_to_lab(rgb: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert sRGB (..., 3) to CIELAB, each channel scaled so that the RGB cube fills [-1, 1].

    Values outside [0, 1] are clipped first: CIELAB is undefined there.
    """
    # Imported here: it takes most of a second, and few commands need it.
    from skimage.color import rgb2lab

    lab = rgb2lab(np.clip(rgb, 0.0, 1.0))
    return (2 * (lab - LAB_LOW) / (LAB_HIGH - LAB_LOW) - 1).astype(np.float32)
