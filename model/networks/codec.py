"""Latent codecs of opacity TFs (paper, section 4.2.1)."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn.functional import conv1d, pad

from model.networks.blocks import LEAK, TFEncoder, mlp
from model.networks.encoding import decode_unit
from model.networks.size import NetworkSize
from model.scene.transfer_function import TF_SAMPLES

SQRT_2 = math.sqrt(2)

SMOOTHING = (1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0)
"""Binomial weights that smooth decoded TFs, so that they do not waver from bin to bin.

Before the sigmoid, where a steep edge only takes larger numbers.
"""

LARGEST_CODE = 0.9999
"""Largest number of a browser's code, 3.9 standard deviations of the normal distribution."""


class LatentCodec(nn.Module):
    """Encoder of opacity TFs into latent codes, and decoder of codes into opacity TFs."""

    def __init__(self, size: NetworkSize) -> None:
        super().__init__()
        c = size.channels
        hidden = [c(512), c(512)] if size.deep_codec else [c(128)]
        self.encoder = nn.Sequential(
            TFEncoder([1, c(16), c(32), c(64), c(128), c(128)], c(256)),
            nn.Linear(c(256), size.latent_dim),
            nn.LeakyReLU(LEAK),
        )
        self.tf_decoder = nn.Sequential(
            mlp(size.latent_dim, *hidden), nn.Linear(hidden[-1], TF_SAMPLES), nn.Tanh()
        )

    def encode(self, opacity_tf: Tensor) -> Tensor:
        """Encode opacity TFs (N, 256) in [-1, 1] as latent codes (N, latent_dim)."""
        z: Tensor = self.encoder(opacity_tf[:, None])
        return z

    def decode(self, latent: Tensor) -> Tensor:
        """Decode latent codes (N, latent_dim) into opacity TFs (N, 256) in [-1, 1]."""
        tf: Tensor = self.tf_decoder(latent)
        return tf


class BrowserCodec(nn.Module):
    """Codec of opacity TFs for browsing: true to faint opacities, with codes in a known box.

    It works on the square roots of opacities, so that a small error leaves nothing in the way
    where a TF is 0. Its encoder gives a normal distribution (Kingma and Welling 2014), which
    the distribution function of N(0, 1) maps to the box -1..1: trained as a variational codec,
    random codes in the box are those of plausible TFs.

    Parameters
    ----------
    width : float
        Number of channels as a fraction of the paper's.
    """

    def __init__(self, latent_dim: int, width: float = 1.0) -> None:
        super().__init__()
        size = NetworkSize(width, 16, 16, latent_dim)
        c = size.channels
        self.encoder = nn.Sequential(
            TFEncoder([1, c(16), c(32), c(64), c(128), c(128)], c(256)),
            nn.Linear(c(256), 2 * latent_dim),
        )
        self.tf_decoder = nn.Sequential(
            mlp(latent_dim, c(512), c(512), c(512)), nn.Linear(c(512), TF_SAMPLES)
        )

    def encode(self, opacity_tf: Tensor) -> Tensor:
        """Encode opacity TFs (N, 256) in [-1, 1] as codes (N, latent_dim) in [-1, 1]."""
        means, _ = self.distribution(roots(opacity_tf))
        return torch.erf(means / SQRT_2)

    def decode(self, latent: Tensor) -> Tensor:
        """Decode codes (N, latent_dim) in [-1, 1] into opacity TFs (N, 256) in [-1, 1]."""
        normal = SQRT_2 * torch.erfinv(latent.clamp(-LARGEST_CODE, LARGEST_CODE))
        return 2 * self.decode_roots(normal).square() - 1

    def distribution(self, roots: Tensor) -> tuple[Tensor, Tensor]:
        """Means and logarithms of variances, each (N, latent_dim), of the normal codes.

        `roots` are the TFs' square roots (N, 256) in [0, 1].
        """
        means, log_variances = self.encoder(2 * roots[:, None] - 1).chunk(2, dim=1)
        return means, log_variances.clamp(-12, 4)

    def decode_roots(self, normal: Tensor) -> Tensor:
        """Decode normal codes (N, latent_dim) into square roots of opacities (N, 256)."""
        rough = self.tf_decoder(normal)[:, None]
        kernel = torch.tensor(SMOOTHING, dtype=rough.dtype, device=rough.device)
        padded = pad(rough, (len(SMOOTHING) // 2,) * 2, mode="replicate")
        return torch.sigmoid(conv1d(padded, (kernel / kernel.sum())[None, None])[:, 0])


def roots(opacity_tf: Tensor) -> Tensor:
    """Square roots in [0, 1] of TFs in [-1, 1]."""
    return decode_unit(opacity_tf).clamp(min=0).sqrt()
