"""Latent codes of opacity TFs as arrays, samples of them, and codecs."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from model.errors import CheckpointError, LatentError, os_errors_as
from model.json_files import read_json
from model.volume_files.shipped import RESOURCES

if TYPE_CHECKING:
    from model.networks.generator_network import LatentCodec

SAMPLES = 10_000  # number of codes on a map, as in the paper (section 5.2)
SAMPLING_SEED = 0
ROBUST_SHARE = 0.005  # share of encoded TFs outside either side of the sampled box
COLLAPSED_DEVIATION = 1e-4  # standard deviation below which a code's number is unused

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
        """See :class:`TFCodec`."""
        # Imported here, as the window uses codes but starts without torch.
        import torch

        from model.networks.generator_network import encode_unit

        with torch.inference_mode():
            return self.network.encode(encode_unit(opacities)).float().numpy()

    def decode(self, codes: NDArray[np.floating]) -> Opacities:
        """See :class:`TFCodec`."""
        import torch

        from model.networks.generator_network import decode_unit

        with torch.inference_mode():
            tfs = self.network.decode(torch.from_numpy(np.asarray(codes, dtype=np.float32)))
            return decode_unit(tfs).clamp(0, 1).numpy()


@dataclass(frozen=True, eq=False)
class CodeSamples:
    """Codes (n, d) spread over the decoder's possible TFs, and these TFs (n, 256)."""

    codes: Codes
    tfs: Opacities
    singular_values: NDArray[np.float32]  # (d,): standard deviations along principal axes


def sample_codes(codec: TFCodec, tfs: NDArray[np.floating], count: int = SAMPLES) -> CodeSamples:
    """Draw codes uniformly, decode them, and encode them again (paper, section 5.2)."""
    known = checked_codes(codec.encode(tfs))
    if (known.std(axis=0) < COLLAPSED_DEVIATION).all():
        raise LatentError(
            "The codec gives the same code for all TFs: it has collapsed. "
            "Use a model of another training, or the shipped codec."
        )
    lowest, highest = np.quantile(known, [ROBUST_SHARE, 1 - ROBUST_SHARE], axis=0)
    rng = np.random.default_rng(SAMPLING_SEED)
    drawn = rng.uniform(lowest, highest, (count, known.shape[1]))
    return samples_of(codec, codec.encode(codec.decode(drawn)))


def samples_of(codec: TFCodec, codes: Codes) -> CodeSamples:
    """Return codes with derived quantities."""
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


CODEC_FILE = "codec.json"
WEIGHTS_FILE = "codec.safetensors"
FORMAT = 1
SHIPPED_CODEC = RESOURCES / "codec"

LEAK = np.float32(0.2)  # slope of the activation below 0

SMOOTHING = np.array([1, 8, 28, 56, 70, 56, 28, 8, 1], np.float32) / 256
"""Weights that smooth decoded TFs before the sigmoid, where steep edges are still possible."""

LARGEST_CODE = 0.9999  # limit of a code's numbers: 3.9 standard deviations

Weights = dict[str, NDArray[np.float32]]


class BrowserCodec(TFCodec):
    """Codec of opacity TFs for browsing: accurate for faint opacities, with codes in a box.

    It uses square roots of opacities, so that small errors at 0 stay invisible. Its encoder gives a
    normal distribution (Kingma and Welling 2014), mapped to the box -1..1: random codes in the box
    give plausible TFs. It uses NumPy, as importing PyTorch takes longer than the browser's first
    pictures.
    """

    def __init__(self, weights: Weights) -> None:
        self._weights = weights

    def encode(self, opacities: NDArray[np.floating]) -> Codes:
        """Encode opacity TFs (n, 256) in [0, 1] as codes (n, d) in [-1, 1]."""
        from scipy.special import erf

        x = 2 * np.sqrt(np.asarray(opacities, np.float32).clip(0))[:, None] - 1
        # Convolutions of stride 2, and one over the rest.
        for number in range(0, 12, 2):
            kernel, bias = self._layer(f"encoder.0.{number}")
            if number < 10:
                x = np.pad(x, ((0, 0), (0, 0), (2, 2)))
            windows = np.lib.stride_tricks.sliding_window_view(x, kernel.shape[2], axis=2)
            x = np.einsum("nclk,ock->nol", windows[:, :, ::2], kernel, optimize=True)
            x = _leaky(x + bias[:, None])
        weight, bias = self._layer("encoder.1")
        # Only the distribution's means are needed.
        means = (x[:, :, 0] @ weight.T + bias)[:, : len(bias) // 2]
        return np.asarray(erf(means / np.sqrt(np.float32(2))), np.float32)

    def decode(self, codes: NDArray[np.floating]) -> Opacities:
        """Decode codes (n, d) in [-1, 1] as opacity TFs (n, 256) in [0, 1]."""
        from scipy.special import erfinv

        inside = np.asarray(codes, np.float32).clip(-LARGEST_CODE, LARGEST_CODE)
        x = np.sqrt(np.float32(2)) * erfinv(inside)
        for number in range(0, 6, 2):
            weight, bias = self._layer(f"tf_decoder.0.{number}")
            x = _leaky(x @ weight.T + bias)
        weight, bias = self._layer("tf_decoder.1")
        x = x @ weight.T + bias
        padded = np.pad(x, ((0, 0), (len(SMOOTHING) // 2,) * 2), mode="edge")
        smooth = sum(w * padded[:, i : i + x.shape[1]] for i, w in enumerate(SMOOTHING))
        return np.square(1 / (1 + np.exp(-smooth)))

    def _layer(self, name: str) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        return self._weights[f"{name}.weight"], self._weights[f"{name}.bias"]


def load_codec(folder: Path = SHIPPED_CODEC) -> tuple[str, BrowserCodec]:
    """Read a codec folder."""
    from safetensors.numpy import load

    what = f"{folder}: the folder holds no codec"
    try:
        with os_errors_as(CheckpointError, what, "install tfscope again"):
            described = read_json(folder / CODEC_FILE)
            content = (folder / WEIGHTS_FILE).read_bytes()
        version, digest = described["tfscope_codec"], described["digest"]
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(
            f"{folder / CODEC_FILE}: the description is malformed near {error}."
        ) from error
    if version != FORMAT:
        raise CheckpointError(
            f"{folder}: the codec's format is {version!r}; this tfscope reads {FORMAT}."
        )
    if hashlib.sha256(content).hexdigest() != digest:
        raise CheckpointError(
            f"{folder / WEIGHTS_FILE}: the weights are truncated or altered; copy the folder again."
        )
    weights = {name: values.astype(np.float32) for name, values in load(content).items()}
    return digest, BrowserCodec(weights)


def _leaky(x: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.maximum(x, LEAK * x)
