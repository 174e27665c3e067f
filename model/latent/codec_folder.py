"""The shipped codec of opacity TFs: a folder with its weights and a description."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import CheckpointError, reason
from model.json_files import read_json
from model.latent.codes import Codes, Opacities, TFCodec
from model.volume_files.shipped import RESOURCES

CODEC_FILE = "codec.json"
WEIGHTS_FILE = "codec.safetensors"
FORMAT = 1
SHIPPED_CODEC = RESOURCES / "codec"

LEAK = np.float32(0.2)
"""Slope of the layers' activation below 0."""

SMOOTHING = np.array([1, 8, 28, 56, 70, 56, 28, 8, 1], np.float32) / 256
"""Binomial weights that smooth decoded TFs, so that they do not waver from bin to bin.

Before the sigmoid, where a steep edge only takes larger numbers.
"""

LARGEST_CODE = 0.9999
"""Largest number of a code, 3.9 standard deviations of the normal distribution."""

Weights = dict[str, NDArray[np.float32]]


class BrowserCodec(TFCodec):
    """Codec of opacity TFs for browsing: true to faint opacities, with codes in a known box.

    It works on the square roots of opacities, so that a small error leaves nothing in the way
    where a TF is 0. Its encoder gives a normal distribution (Kingma and Welling 2014), which
    the distribution function of N(0, 1) maps to the box -1..1: as it was trained as a variational
    codec, random codes in the box are those of plausible TFs.

    NumPy computes it. To import PyTorch takes longer than the browser's first pictures.
    """

    def __init__(self, weights: Weights) -> None:
        self._weights = weights

    def encode(self, opacities: NDArray[np.floating]) -> Codes:
        """Encode opacity TFs (n, 256) in [0, 1] as codes (n, d) in [-1, 1]."""
        from scipy.special import erf

        x = 2 * np.sqrt(np.asarray(opacities, np.float32).clip(0))[:, None] - 1
        # Convolutions of stride 2, and one over all that is left.
        for number in range(0, 12, 2):
            kernel, bias = self._layer(f"encoder.0.{number}")
            if number < 10:
                x = np.pad(x, ((0, 0), (0, 0), (2, 2)))
            windows = np.lib.stride_tricks.sliding_window_view(x, kernel.shape[2], axis=2)[
                :, :, ::2
            ]
            x = _leaky(np.einsum("nclk,ock->nol", windows, kernel, optimize=True) + bias[:, None])
        weight, bias = self._layer("encoder.1")
        # Of the distribution only the means are needed, not the variances.
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

    try:
        described = read_json(folder / CODEC_FILE)
        content = (folder / WEIGHTS_FILE).read_bytes()
        version, digest = described["tfscope_codec"], described["digest"]
    except OSError as error:
        raise CheckpointError(
            f"{folder}: the folder holds no codec ({reason(error)}); install tfscope again."
        ) from error
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
