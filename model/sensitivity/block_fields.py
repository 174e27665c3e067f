"""Value fields of blocks of an image for all scalar values at once (paper, section 5.1.2).

They are :meth:`model.sensitivity.learned.Sensitivity.field`'s and
:func:`model.sensitivity.exact.sensitivity_field`'s, (n, n, 256) in blocks of one size: how the norm
of each block's colours changes by an edit around each scalar value.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.display import FLOOR, scale_of, shown_field

Fields = NDArray[np.float32]


def field_of_band(
    fields: Fields, values: tuple[float, float], scalar_range: Range
) -> NDArray[np.float32]:
    """Select the field (n, n) of an edit over an interval of scalar values.

    Parameters
    ----------
    fields : ndarray of float32, shape (n, n, 256)
        Of edits around each scalar value.
    values : tuple of float
        Lowest and highest value, in the data's units; see
        :func:`model.scene.tf_perturbation.edit_over`, whose edits these are.
    """
    return np.asarray(fields[..., field_bins(values, scalar_range)].mean(axis=-1))


def field_bins(values: tuple[float, float], scalar_range: Range) -> slice:
    """Bins of the TF from one scalar value to another, in the data's units."""
    lo, hi = scalar_range
    places = [round((value - lo) / (hi - lo) * (TF_SAMPLES - 1)) for value in values]
    first, last = (min(max(place, 0), TF_SAMPLES - 1) for place in places)
    return slice(first, last + 1)


def pixels_of_block(size: int, blocks: int) -> int:
    """Number of pixels of each of an image's blocks.

    Parameters
    ----------
    size : int
        Width and height of the image in pixels.
    blocks : int
        Number of blocks along either side.
    """
    return max(size // blocks, 1) ** 2


def over_pixels(field: NDArray[np.floating], size: int) -> NDArray[np.floating]:
    """Repeat a field of blocks (n, n) over the pixels of an image, (size, size)."""
    nearest = np.arange(size) * len(field) // size
    return field[nearest][:, nearest]


def largest_scales(
    changes: Iterable[NDArray[np.floating]], edits: Iterable[NDArray[np.floating]]
) -> NDArray[np.float32]:
    """Ends of the scale over the changes of pixels by many edits.

    What :func:`model.sensitivity.global_scale.global_scale` is for blocks.

    Parameters
    ----------
    changes : iterable of ndarray, shape (S, S, 3)
        Change of the image by each edit, per unit of it.
    edits : iterable of ndarray, shape (256,)

    Returns
    -------
    ndarray of float32, shape (2,)
        By the measures "change" and "signed", in the displayed unit.
    """
    ends = [FLOOR, FLOOR]
    for change, edit in zip(changes, edits, strict=True):
        ends[0] = max(ends[0], scale_of(shown_field(change, edit, "change")))
        ends[1] = max(ends[1], scale_of(shown_field(change, edit, "signed")))
    return np.array(ends, dtype=np.float32)
