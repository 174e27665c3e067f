"""Names of a grid's axes in the patient: right, left, anterior, posterior, superior, inferior."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

OPPOSITES = {"R": "L", "L": "R", "A": "P", "P": "A", "S": "I", "I": "S"}


def axis_labels(directions: NDArray[np.float64] | None, space: str) -> tuple[str, ...]:
    """Name the patient's direction that each axis of a grid is closest to.

    Parameters
    ----------
    directions : ndarray of float64, shape (3, 3), or None
        Row k is the step from one voxel to the next along the grid's axis k, in the file's
        space; None if unknown.
    space : str
        Directions of that space's axes, such as ``"LPS"``; others are unknown.

    Returns
    -------
    tuple of str
        Labels of +x, -x, +y, -y, +z and -z, a different one each; empty when unknown.
    """
    if directions is None or not is_space(space) or not np.isfinite(directions).all():
        return ()
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    if not (lengths > 0).all():
        return ()
    unit = directions / lengths
    # Oblique grids: all three axes together, so that no two get the same name.
    order = max(
        itertools.permutations(range(3)),
        key=lambda axes: sum(abs(unit[k, axis]) for k, axis in enumerate(axes)),
    )
    labels: list[str] = []
    for k, axis in enumerate(order):
        label = space[axis] if unit[k, axis] > 0 else OPPOSITES[space[axis]]
        labels += [label, OPPOSITES[label]]
    return tuple(labels)


def is_space(letters: str) -> bool:
    """Return True for three letters that name one direction of each pair, such as ``"LPS"``."""
    pairs = ["RL", "AP", "SI"]
    return len(letters) == 3 and all(sum(each in pair for each in letters) == 1 for pair in pairs)
