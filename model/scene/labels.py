"""Labels: whole numbers that each name something, such as an organ."""

import re

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range, TransferFunction
from model.scene.volume import Volume

LAST = TF_SAMPLES - 1
FEW = 128  # most distinct values of labels that no file declares
DIMMEST = 0.3  # least luminance of a label's colour, as images are black around it
WRAPPED = 0.5  # share of labelled voxels from which a label around the others hides them
VEIL = 0.02  # opacity of such a label
GRAY = (0.5, 0.5, 0.5)


def label_range(volume: Volume) -> Range:
    """Return a range over which each label has a TF's bin of its own, exactly."""
    lo, hi = volume.data_range
    if hi - lo > LAST:
        return lo, hi
    bins = max(int(LAST // (hi - lo + 1)), 1)
    first = int(LAST - bins * (hi - lo)) // 2
    return lo - first / bins, lo + (LAST - first) / bins


def label_tf(volume: Volume) -> TransferFunction:
    """Return a TF over a volume's range that shows all labels but 0, each in a colour.

    A label around all others, as a body is, is nearly transparent. Handles are on the labels;
    colours are the file's, or as different as possible.
    """
    found, counts = volume.distribution.frequencies
    if len(found) > TF_SAMPLES:
        found = np.linspace(*volume.scalar_range, TF_SAMPLES)
        counts = np.zeros(TF_SAMPLES, np.int64)
    labelled = found != 0
    hides = (counts > WRAPPED * counts[labelled].sum()) & (labelled.sum() > 1) & labelled
    if hides.any():
        hides &= _is_around_others(volume.voxels, found[hides][0])
    opacities = np.where(hides, VEIL, 1.0) * labelled
    values = [float(value) for value in found]
    given = {label.value: label.color for label in volume.file.labels if label.color}
    others = _distinct_colors()
    colors = [
        given.get(int(value), others[int(value) % len(others)] if value else GRAY)
        for value in values
    ]
    points = tuple(zip(values, opacities.tolist(), strict=True))
    stops = tuple((value, *color) for value, color in zip(values, colors, strict=True))
    scalar_range = volume.scalar_range
    return TransferFunction(OpacityTF(scalar_range, points=points), ColorTF(scalar_range, stops))


def _is_around_others(voxels: NDArray[np.generic], label: float) -> bool:
    """Whether the bounding box of a label has those of all others inside it."""
    own, labelled = (
        [np.flatnonzero(each.any(axis=others))[[0, -1]] for others in ((1, 2), (0, 2), (0, 1))]
        for each in (voxels == label, voxels != 0)
    )
    return np.array_equal(own, labelled)


def looks_like_labels(volume: Volume) -> bool:
    """Whether a volume's name and values suggest labels."""
    lo, hi = volume.data_range
    if not re.search("label|seg", volume.name, re.IGNORECASE) or volume.scale != "linear":
        return False
    few = hi - lo <= LAST and len(volume.distribution.frequencies[0]) <= FEW
    return few and volume.distribution.is_whole


def _distinct_colors() -> list[tuple[float, float, float]]:
    # Imported here to keep the window's start fast.
    from cmap import Colormap

    colors = [stop.color.rgba[:3] for stop in Colormap("glasbey:glasbey").color_stops]
    bright = [c for c in colors if np.dot(c, (0.3, 0.59, 0.11)) >= DIMMEST]
    # The first is white.
    return [(float(r), float(g), float(b)) for r, g, b in bright[1:]]
