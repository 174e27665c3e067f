"""Tables of a sample's colour and opacity over mean and spread, from transfer functions.

Where a node's voxels differ, the TF of their mean is not the mean of their TFs: a thin
shell that no mean equals would vanish. A table therefore holds a TF's mean over normal
distributions. It is linear in the opacity and in opacity times colour of the 256 bins.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.special import ndtr
from torch import Tensor
from torch.nn.functional import interpolate, pad

from model.networks.refined.coarse_kernels import LEVELS
from model.networks.refined.coarse_volume import MEAN_STEPS, SPREAD_STEPS, SPREADS
from model.rendering.opacity_correction import NEARLY_OPAQUE
from model.scene.transfer_function import TF_SAMPLES


def entry_table(opacity: Tensor, color: Tensor, distance: float) -> Tensor:
    """Premultiplied RGBA of a sample for each mean and spread; differentiable by both TFs.

    Parameters
    ----------
    opacity : Tensor, shape (N, 256)
        Per voxel length, in [0, 1].
    color : Tensor, shape (N, 3, 256)
        RGB in [0, 1].
    distance : float
        Distance between samples, in voxels.

    Returns
    -------
    Tensor, shape (N, ENTRIES + 1, 4)
        See :mod:`model.networks.refined.coarse_kernels`.
    """
    alpha = sample_opacity(opacity, distance)[:, None]
    bins = torch.cat([alpha * color, alpha], dim=1)
    rows = torch.einsum("smb,ncb->nscm", torch.from_numpy(_averaging()).to(bins), bins)
    rows = interpolate(rows.flatten(1, 2), LEVELS, mode="linear", align_corners=True)
    rows = rows.reshape(len(bins), SPREADS, 4, LEVELS).transpose(2, 3)
    return pad(rows.flatten(1, 2), (0, 0, 0, 1))


def sample_opacity(opacity: Tensor, distance: float) -> Tensor:
    """Opacity of one sample, 1 - (1 - a)^s, with a derivative that is finite at 1.

    See :func:`model.rendering.opacity_correction.per_sample_derivative`.
    """
    known = opacity.detach()
    clear = 1 - known
    if distance < 1:
        clear = clear.clamp_min(1 - NEARLY_OPAQUE)
    slope = distance * clear ** (distance - 1)
    return -torch.expm1(distance * torch.log1p(-known)) + slope * (opacity - known)


def deviations() -> NDArray[np.float64]:
    """Standard deviation of each level of the spread, in bins of the TF."""
    return np.arange(SPREADS, dtype=np.float64) ** 2 * (MEAN_STEPS / SPREAD_STEPS)


@lru_cache(maxsize=1)
def _averaging() -> NDArray[np.float32]:
    """Weights of the bins in a TF's mean over a normal distribution, by spread and mean.

    Between bins the TF is linear, and beyond the ends constant. A bin's hat function is a
    second difference of ramps, and max(v - b, 0) has the mean s phi(t) + (m - b) Phi(t),
    t = (m - b) / s, for a value v of mean m and standard deviation s.

    Returns
    -------
    ndarray of float32, shape (SPREADS, 256, 256)
    """
    away = np.arange(TF_SAMPLES)[:, None] - np.arange(-1, TF_SAMPLES + 1)
    # At a deviation of 0 the limit: t is infinite, or nothing at a distance of 0.
    deviation = np.maximum(deviations(), 1e-9)[:, None, None]
    t = away / deviation
    ramps = deviation * np.exp(-t * t / 2) / np.sqrt(2 * np.pi) + away * ndtr(t)
    slopes = ramps[..., :-1] - ramps[..., 1:]
    weights = slopes[..., :-1] - slopes[..., 1:]
    # What lies beyond an end counts for the last bin there.
    weights[..., 0] += 1 - slopes[..., 0]
    weights[..., -1] += slopes[..., -1]
    return np.asarray(weights, dtype=np.float32)
