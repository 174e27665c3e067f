"""Training of a latent codec for browsing: one that serves every volume, without images.

Its TFs lie over [0, 1], which is stretched to the scalar window of whatever volume is open.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import get_args

import numpy as np
import torch
from torch import Tensor

from model.errors import TrainingError
from model.networks.blocks import kaiming_init
from model.networks.codec import BrowserCodec, LatentCodec, roots
from model.networks.encoding import encode_unit
from model.networks.names import CodecKind
from model.networks.size import NetworkSize
from model.samples.sampling import draw_edits, draw_opacity_tfs
from model.scene.scene import Scene
from model.training.codec_loss import decoded_tf_error, layer_opacity
from model.training.optimizers import adam, cosine_decay, set_rate

POOL = 65_536
"""TFs that are drawn before training; each step takes some of them, half of them mirrored."""

UNIT_SCENE = Scene("any volume", "", (0.0, 1.0), (0.0, 1.0), image_size=16)
"""Scene whose random TFs the codec learns: the family "drawn" over [0, 1]."""


@dataclass(frozen=True)
class CodecDesign:
    """Kind and size of a codec, and the weights of its losses.

    Attributes
    ----------
    kind : {"plain", "contractive", "variational"}
    width : float
        Number of channels as a fraction of the paper's.
    layer_weight : float
        Weight of the opacity of thick layers, see
        :func:`model.training.codec_loss.decoded_tf_error`.
    slope_weight : float
        Weight of the differences between neighbouring bins, which keeps decoded TFs from
        wavering; not of a plain codec.
    prior_weight : float
        Weight of a variational codec's divergence from N(0, 1), in nats.
    contraction_weight : float
        Weight of a contractive codec's change by smooth edits, in squared standard deviations
        of the codes (after Rifai et al. 2011).

    Raises
    ------
    TrainingError
        For an unknown kind, or sizes below 1.
    """

    kind: CodecKind = "variational"
    latent_dim: int = 8
    width: float = 1.0
    layer_weight: float = 0.3
    slope_weight: float = 10.0
    prior_weight: float = 3e-3
    contraction_weight: float = 0.01
    batch_size: int = 128
    learning_rate: float = 1e-3

    def __post_init__(self) -> None:
        if self.kind not in get_args(CodecKind):
            raise TrainingError(
                f"The codec '{self.kind}' is unknown; choose {', '.join(get_args(CodecKind))}."
            )
        if self.latent_dim < 1 or self.batch_size < 1:
            raise TrainingError("A codec needs a latent dimension and a batch size of at least 1.")

    def build(self) -> LatentCodec | BrowserCodec:
        """Return a codec with initial weights."""
        codec: LatentCodec | BrowserCodec
        if self.kind == "plain":
            codec = LatentCodec(
                NetworkSize(self.width, 16, 16, latent_dim=self.latent_dim, deep_codec=True)
            )
        else:
            codec = BrowserCodec(self.latent_dim, self.width)
        kaiming_init(codec)
        return codec


def train_codec(
    design: CodecDesign, steps: int, seed: int = 0, reports: int = 20
) -> Iterator[tuple[int, LatentCodec | BrowserCodec]]:
    """Train a codec on random TFs over [0, 1].

    Parameters
    ----------
    seed : int
        Determines weights, TFs and edits.
    reports : int
        Number of times that the codec is yielded.

    Yields
    ------
    step : int
        Number of steps done.
    codec : LatentCodec or BrowserCodec
        The one that is trained, in its present state.
    """
    torch.manual_seed(seed)
    codec = design.build()
    drawn = draw_opacity_tfs(UNIT_SCENE, seed, 0, POOL)
    rng = np.random.default_rng(seed)
    optimizer = adam(codec, 0.999)
    due = {steps * part // reports for part in range(1, reports + 1)}
    for step in range(steps):
        set_rate(optimizer, design.learning_rate * cosine_decay(step / steps))
        batch = drawn[rng.integers(len(drawn), size=design.batch_size)]
        batch = np.where(rng.uniform(size=(len(batch), 1)) < 0.5, batch, batch[:, ::-1])
        edits = draw_edits(UNIT_SCENE, seed, step, len(batch))
        tfs = encode_unit(np.concatenate([batch, (batch + edits).clip(0, 1)]))
        optimizer.zero_grad()
        torch.autograd.backward(_loss(design, codec, tfs))
        optimizer.step()
        if step + 1 in due:
            yield step + 1, codec


def _loss(design: CodecDesign, codec: LatentCodec | BrowserCodec, tfs: Tensor) -> Tensor:
    """Loss of TFs (2 N, 256), the second half of which are edits of the first."""
    if isinstance(codec, LatentCodec):
        return decoded_tf_error(codec.decode(codec.encode(tfs)), tfs, design.layer_weight)
    true = roots(tfs)
    means, log_variances = codec.distribution(true)
    if design.kind == "variational":
        codes = means + torch.randn_like(means) * (log_variances / 2).exp()
        parts = means.square() + log_variances.exp() - log_variances - 1
        regular = design.prior_weight * parts.sum(dim=1).mean() / 2
    else:
        codes = means
        before, after = (means / (means.detach().std(dim=0) + 1e-3)).chunk(2)
        regular = design.contraction_weight * (after - before).square().mean()
    decoded = codec.decode_roots(codes)
    layers = layer_opacity(2 * decoded.square() - 1) - layer_opacity(tfs)
    error = (decoded - true).square().mean() + design.layer_weight * layers.square().mean()
    slopes = (decoded - true).diff(dim=1).square().mean()
    return 4 * (error + design.slope_weight * slopes) + regular
