"""The scalar values over which a codec's opacity TFs lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, OpacityTF, Range, check_range
from model.scene.value_scale import ValueScale


@dataclass(frozen=True)
class TFFrame:
    """Stretches a codec's TFs over [0, 1] to a scalar window.

    Below the window, where the background is, a stretched TF shows nothing; above it, the
    last opacity holds.

    Attributes
    ----------
    scalar_range : tuple of float
        The volume's lowest and highest value, on the scale.
    window : tuple of float
        Values of the TF's first and last sample; inside the scalar range.
    scale : {"linear", "log"}
        Scale of the TFs.

    Raises
    ------
    TransferFunctionError
        For a window that is not increasing.
    """

    scalar_range: Range
    window: Range
    scale: ValueScale = "linear"

    def __post_init__(self) -> None:
        check_range(self.window)

    def opacity_tf(self, opacities: NDArray[np.floating]) -> OpacityTF:
        """Return the TF of 256 opacities over the window, which are clipped to [0, 1]."""
        values = np.linspace(*self.window, TF_SAMPLES)
        points = [*zip(values.tolist(), np.clip(opacities, 0, 1).tolist(), strict=True)]
        if self.window[0] > self.scalar_range[0]:
            points.insert(0, (points[0][0], 0.0))
        return OpacityTF(self.scalar_range, points=tuple(points), scale=self.scale)

    def opacities(self, opacity_tf: OpacityTF) -> NDArray[np.float32]:
        """Opacities (256,) of a TF over the window; what lies outside it is lost."""
        return opacity_tf.sample(self.window)

    def stretched(self, opacities: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return TFs (n, 256) over the window as TFs (n, 256) over the scalar range."""
        lo, hi = self.window
        values = np.linspace(*self.scalar_range, TF_SAMPLES)
        place = np.clip((values - lo) / (hi - lo), 0, 1) * (TF_SAMPLES - 1)
        below = np.minimum(place.astype(np.int64), TF_SAMPLES - 2)
        share = (place - below).astype(np.float32)
        between = opacities[:, below] * (1 - share) + opacities[:, below + 1] * share
        return np.where(values >= lo, between, 0).astype(np.float32)
