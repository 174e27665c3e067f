"""A volume with its derived data that take time to compute."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.scene.default_tf import default_transfer_function
from model.scene.scene import default_scalar_window
from model.scene.transfer_function import Range, TransferFunction
from model.scene.volume import Volume


@dataclass(frozen=True, eq=False)
class OpenedVolume:
    """A volume with derived data for the window, computed in the background.

    Attributes
    ----------
    path : Path
    volume : Volume
    counts : ndarray of int64, shape (256,)
        Histogram over equal bins of the scalar range.
    fingerprint : str
    default : TransferFunction
    window : tuple of float
        Scalar values of interest.
    """

    path: Path
    volume: Volume
    counts: NDArray[np.int64]
    fingerprint: str
    default: TransferFunction
    window: Range


def open_volume(path: Path, read_volume: Callable[[Path], Volume]) -> OpenedVolume:
    """Read a volume and compute its derived data; may take seconds.

    Raises
    ------
    VolumeError
        When the file holds no usable volume.
    """
    volume = read_volume(path)
    counts, _ = volume.histogram(256)
    default, window = default_transfer_function(volume), default_scalar_window(volume)
    return OpenedVolume(path, volume, counts, volume.fingerprint, default, window)
