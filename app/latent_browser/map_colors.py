"""Colours of the map's points, and the legend that explains them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray

from app.short_numbers import significant
from app.state.latent_state import LatentState
from model.scene.transfer_function import Range
from model.scene.value_scale import values_at

if TYPE_CHECKING:
    from app.state.latent_session import LatentSession

HIDDEN = (45, 46, 49)
"""Colour of points that are filtered out."""

NOTHING = (64, 66, 70)
"""Colour of TFs that show nothing or a solid block, and where a quantity is unknown."""


@dataclass(frozen=True, eq=False)
class Legend:
    """Meaning of the colours.

    Attributes
    ----------
    low, high : str
        Numbers at the ends of the colour bar.
    """

    title: str
    low: str
    high: str


@dataclass(frozen=True, eq=False)
class Shades:
    """Colour (n, 3), uint8, of every point, the order to draw them in, and the legend."""

    colors: NDArray[np.uint8]
    order: NDArray[np.int64]
    legend: Legend
    shown: NDArray[np.bool_]


def shades_of(
    session: LatentSession,
    latent: LatentState,
    scalar_range: Range,
    units: str,
) -> Shades:
    """Colour the points of the map.

    Parameters
    ----------
    session : LatentSession
        With a map.
    units : str
        Unit of the scalar values; may be empty.
    """
    map_, overview = session.map, session.overview
    assert map_ is not None
    count = len(map_.codes)
    choices = latent.choices
    values, title, number = _quantity(session, latent, scalar_range, units)
    known = np.isfinite(values)
    low, high = (0.0, 1.0)
    if known.any():
        low, high = (float(v) for v in np.quantile(values[known], [0.01, 0.99]))
    ends = np.array([low, high])
    if choices.coloring == "value":
        low, high = session.space.frame.window if session.space else scalar_range
        ends = values_at((low, high), session.space.frame.scale if session.space else "linear")
    share = np.clip((np.nan_to_num(values) - low) / max(high - low, 1e-12), 0, 1)
    table = lookup_table()
    colors = table[(share * (len(table) - 1)).astype(np.int64)]
    shown = known.copy()
    if overview is not None and choices.coloring in ("value", "opacity"):
        shown &= overview.shows_something
    colors[~shown] = NOTHING
    wanted = np.ones(count, dtype=bool) if session.wanted is None else session.wanted
    colors[~wanted] = HIDDEN
    order = np.lexsort((np.arange(count), 2 * wanted + shown))
    legend = Legend(title, *(number(float(end)) for end in ends))
    return Shades(colors, order, legend, wanted)


@cache
def lookup_table() -> NDArray[np.uint8]:
    """Colours (256, 3) of the map, perceptually uniform."""
    table = pg.colormap.get("viridis").getLookupTable(0.12, 1.0, 256)
    return np.asarray(table[:, :3], dtype=np.uint8)


def _quantity(
    session: LatentSession,
    latent: LatentState,
    scalar_range: Range,
    units: str,
) -> tuple[NDArray[np.floating], str, Callable[[float], str]]:
    """Values (n,), NaN where unknown, their name with unit, and how a number is written."""
    map_, overview = session.map, session.overview
    assert map_ is not None
    unknown = np.full(len(map_.codes), np.nan)
    unit = f" ({units})" if units else ""
    match latent.choices.coloring:
        case "value":
            values = unknown if overview is None else overview.dominant_values(scalar_range)
            return values, f"Most seen value{unit}", partial(significant, digits=3)
        case "opacity":
            values = unknown if overview is None else overview.opacity
            return values, "Mean opacity of the picture", "{:.2f}".format
        case "modes":
            return map_.samples.mode_counts.astype(np.float64), "Modes", "{:.0f}".format
        case "distance":
            code = session.present_code
            distances = unknown if code is None else map_.distances(code)
            return distances, "Distance to the present TF", "{:.1f}".format
