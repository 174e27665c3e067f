"""The latent codec of opacity TFs (paper, section 4.2.1)."""

from __future__ import annotations

from torch import Tensor, nn

from model.networks.blocks import LEAK, TFEncoder, mlp
from model.networks.size import NetworkSize
from model.scene.transfer_function import TF_SAMPLES


class LatentCodec(nn.Module):
    """The latent code of an opacity TF, and the TF that it stands for."""

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
        """Latent codes (N, latent_dim) of opacity TFs (N, 256)."""
        z: Tensor = self.encoder(opacity_tf[:, None])
        return z

    def decode(self, latent: Tensor) -> Tensor:
        """Opacity TFs (N, 256) of latent codes (N, latent_dim)."""
        tf: Tensor = self.tf_decoder(latent)
        return tf
