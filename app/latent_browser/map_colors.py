"""Colours of the map's points: the scalar value that each TF shows most."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray

from app.short_numbers import significant
from model.scene.value_scale import values_at

if TYPE_CHECKING:
    from app.state.latent_session import LatentSession

HIDDEN = (45, 46, 49)
"""Colour of points that are filtered out."""

NOTHING = (64, 66, 70)
"""Colour of TFs that show nothing or a solid block, and of all until that is known."""


@dataclass(frozen=True, eq=False)
class Shades:
    """Colours of the map.

    Attributes
    ----------
    colors : ndarray of uint8, shape (n, 3)
        Of each point.
    order : ndarray of int64, shape (n,)
        Points in the order in which they are drawn.
    low, high : str
        Texts at the ends of the colour bar.
    """

    colors: NDArray[np.uint8]
    order: NDArray[np.int64]
    low: str
    high: str


def shades_of(session: LatentSession, units: str) -> Shades:
    """Colour the points of a session's map.

    Parameters
    ----------
    units : str
        Unit of the scalar values; may be empty.
    """
    map_, overview, space = session.map, session.overview, session.space
    assert map_ is not None and space is not None
    count, frame, table = len(map_.codes), space.frame, lookup_table()
    colors = np.tile(np.array(NOTHING, np.uint8), (count, 1))
    shown = np.zeros(count, dtype=bool)
    low, high = frame.window
    if overview is not None:
        shown = overview.shows_something
        values = overview.dominant_values(frame.scalar_range)[shown]
        share = np.clip((values - low) / (high - low), 0, 1)
        colors[shown] = table[(share * (len(table) - 1)).astype(np.int64)]
    wanted = np.ones(count, dtype=bool) if session.wanted is None else session.wanted
    colors[~wanted] = HIDDEN
    order = np.lexsort((np.arange(count), 2 * wanted + shown))
    first, last = (significant(float(end), digits=3) for end in values_at((low, high), frame.scale))
    return Shades(colors, order, f"Value {first}", f"{last} {units}".strip())


@cache
def lookup_table() -> NDArray[np.uint8]:
    """Colours (256, 3) of the map, perceptually uniform."""
    table = pg.colormap.get("viridis").getLookupTable(0.12, 1.0, 256)
    return np.asarray(table[:, :3], dtype=np.uint8)
