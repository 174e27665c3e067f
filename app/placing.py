"""Places for labels and cards where they cover as little as possible."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QRect, QRectF, QSize, QSizeF

Box = QRect | QRectF


def freest(
    corners: Iterable[tuple[float, float]], size: QSize | QSizeF, *layers: Sequence[Box]
) -> tuple[float, float]:
    """Return the upper left corner at which a box covers the fewest others, by layers."""
    places = np.array(list(corners), dtype=np.float64)
    low, high = places[:, None], places[:, None] + (size.width(), size.height())
    counts = []
    for boxes in layers:
        edges = [(b.x(), b.y(), b.x() + b.width(), b.y() + b.height()) for b in boxes]
        ends = np.array(edges, dtype=np.float64).reshape(-1, 2, 2)
        overlaps = (low < ends[:, 1]) & (high > ends[:, 0])
        counts.append(overlaps.all(axis=2).sum(axis=1))
    best = places[np.lexsort((*reversed(counts),))[0]]
    return float(best[0]), float(best[1])
