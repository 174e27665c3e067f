"""Latent codes of opacity TFs as arrays, and samples of all codes that stand for TFs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError

if TYPE_CHECKING:
    from model.networks.generator_network import LatentCodec

SAMPLES = 10_000
"""Number of codes on a map, as in the paper (section 5.2)."""

ROBUST_SHARE = 0.005
"""Share of encoded TFs beyond either side of the box that codes are drawn from."""

COLLAPSED_DEVIATION = 1e-4
"""Standard deviation below which a code's number stands for nothing."""

PictureOf = Literal["code", "tf"]
"""Subject of a latent code's picture: the code itself, or the opacity TF that it decodes to."""

Codes = NDArray[np.float32]
Opacities = NDArray[np.float32]


class TFCodec(Protocol):
    """Encodes and decodes arrays of opacity TFs."""

    def encode(self, opacities: NDArray[np.floating]) -> Codes:
        """Encode opacity TFs (n, 256) in [0, 1] as codes (n, d)."""

    def decode(self, codes: NDArray[np.floating]) -> Opacities:
        """Decode codes (n, d) as opacity TFs (n, 256) in [0, 1]."""


class NetworkCodec(TFCodec):
    """The codec of the paper's networks, on the CPU."""

    def __init__(self, network: LatentCodec) -> None:
        self.network = network

    def encode(self, opacities: NDArray[np.floating]) -> Codes:
        """Encode opacity TFs (n, 256) in [0, 1] as codes (n, d)."""
        # Imported here: the window knows codes, and starts without torch.
        import torch

        from model.networks.encoding import encode_unit

        with torch.inference_mode():
            return self.network.encode(encode_unit(opacities)).float().numpy()

    def decode(self, codes: NDArray[np.floating]) -> Opacities:
        """Decode codes (n, d) as opacity TFs (n, 256) in [0, 1]."""
        import torch

        from model.networks.encoding import decode_unit

        with torch.inference_mode():
            tfs = self.network.decode(torch.from_numpy(np.asarray(codes, dtype=np.float32)))
            return decode_unit(tfs).clamp(0, 1).numpy()


@dataclass(frozen=True, eq=False)
class CodeSamples:
    """Codes (n, d) spread over all that the decoder can make, and the TFs (n, 256) of them.

    The singular values (d,) of the centred codes, divided by the square root of n, are the standard
    deviations along their principal axes.
    """

    codes: Codes
    tfs: Opacities
    singular_values: NDArray[np.float32]

    @property
    def effective_dimension(self) -> float:
        """Number of dimensions that the codes use: exp of the entropy of their variances."""
        variances = np.square(self.singular_values, dtype=np.float64)
        if not variances.sum():
            return 0.0
        shares = variances / variances.sum()
        return float(np.exp(-np.sum(shares * np.log(np.maximum(shares, 1e-300)))))


def sample_codes(
    codec: TFCodec, tfs: NDArray[np.floating], count: int = SAMPLES, seed: int = 0
) -> CodeSamples:
    """Draw codes uniformly, decode them, and encode them again (paper, section 5.2)."""
    known = checked_codes(codec.encode(tfs))
    if (known.std(axis=0) < COLLAPSED_DEVIATION).all():
        raise LatentError(
            "The codec gives the same code for all TFs: it has collapsed. "
            "Use a model of another training, or the shipped codec."
        )
    lowest, highest = np.quantile(known, [ROBUST_SHARE, 1 - ROBUST_SHARE], axis=0)
    rng = np.random.default_rng(seed)
    drawn = rng.uniform(lowest, highest, (count, known.shape[1]))
    return samples_of(codec, codec.encode(codec.decode(drawn)))


def samples_of(codec: TFCodec, codes: Codes) -> CodeSamples:
    """Return codes with what follows from them."""
    checked_codes(codes)
    centred = codes.astype(np.float64) - codes.mean(axis=0, dtype=np.float64)
    variances = np.linalg.eigvalsh(centred.T @ centred / len(codes))[::-1]
    values = np.sqrt(np.maximum(variances, 0)).astype(np.float32)
    return CodeSamples(codes, codec.decode(codes), values)


def checked_codes(codes: NDArray[np.floating]) -> Codes:
    """Return codes (n, d) as float32."""
    codes = np.asarray(codes, dtype=np.float32)
    if codes.ndim != 2 or not codes.size:
        raise LatentError(f"Codes of shape {codes.shape} are not a list of codes.")
    if not np.isfinite(codes).all():
        raise LatentError(
            "The codec gives codes that are not finite; use another model or the shipped codec."
        )
    return codes
