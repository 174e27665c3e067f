"""A volume with derived data that takes time to compute."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.scene.mask import Mask
from model.scene.scene import default_scalar_window, window_above_background
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import Range, TransferFunction
from model.scene.volume import Volume
from model.volume_files.shipped import first_transfer_function


@dataclass(frozen=True, eq=False)
class OpenedVolume:
    """A volume with derived data for the window, computed in the background."""

    path: Path
    volume: Volume  # over the displayed range, at first the robust one
    counts: NDArray[np.int64]
    """Histogram (n,) of all voxels. Bins are equally wide over the volume's scalar range, and
    wider beyond it where outliers lie far out: where bins are compared, divide by widths."""
    edges: NDArray[np.float64]
    """Ends of the bins (n + 1,) on the volume's scale, from the smallest to the largest voxel."""
    fingerprint: str
    default: TransferFunction
    window: Range  # scalar values of interest, within the scalar range
    shown: NDArray[np.float64]
    """Places (n, 3) around what the default TF shows, as fractions of the volume's lengths."""
    mask: Mask | None = None  # voxels that are shown at first; None for all

    @property
    def map_window(self) -> Range:
        """Scalar values that the map's TFs cover."""
        whole = self.volume.scalar_range
        return window_above_background(self.counts, self.edges, whole, self.window)

    @classmethod
    def of(cls, path: Path, volume: Volume, mask: Mask | None = None) -> OpenedVolume:
        """Compute the derived data over the volume's scalar range; may take a second."""
        counts, edges = volume.histogram(256, beyond=True)
        default = first_transfer_function(volume)
        window = default_scalar_window(volume)
        shown = ThinnedVolume.of(volume).shown_points(default.opacity)
        return cls(path, volume, counts, edges, volume.fingerprint, default, window, shown, mask)
