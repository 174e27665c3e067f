"""Places for labels and cards where they cover as little as possible."""

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QRect, QRectF, QSize, QSizeF

Box = QRect | QRectF

TOGETHER = 256  # corners that are judged at the same time


def freest(
    corners: Iterable[tuple[float, float]], size: QSize | QSizeF, *layers: Sequence[Box]
) -> tuple[float, float]:
    """Return the first corner (upper left) at which a box covers the fewest boxes of each layer."""
    edges = [
        [(b.x(), b.y(), b.x() + b.width(), b.y() + b.height()) for b in boxes] for boxes in layers
    ]
    ends = [np.array(each, dtype=np.float64).reshape(-1, 2, 2) for each in edges]
    places, found = np.array(list(corners), dtype=np.float64), []
    for first in range(0, len(places), TOGETHER):
        low = places[first : first + TOGETHER, None]
        high = np.add(low, (size.width(), size.height()))
        counts = [((low < e[:, 1]) & (high > e[:, 0])).all(axis=2).sum(axis=1) for e in ends]
        best = int(np.lexsort((*reversed(counts),))[0])
        found.append((*(int(each[best]) for each in counts), first + best))
        if not any(found[-1][:-1]):
            # Most often one of the first is free.
            break
    left, top = places[min(found)[-1]]
    return float(left), float(top)
