"""Accuracy of a latent codec's decoded opacity TFs and of their response to edits.

The codec limits the generator's accuracy and that of its derivatives. A codec
alone needs no images and is trained and measured in minutes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from model.errors import TrainingError
from model.networks.blocks import kaiming_init
from model.networks.build import build_generator
from model.networks.codec import LatentCodec
from model.networks.encoding import encode_unit
from model.networks.size import NetworkSize
from model.samples.sampling import draw_opacity_tfs
from model.scene.scene import Scene
from model.scene.tf_perturbation import EDIT_WIDTH, response_to_edits
from model.scene.transfer_function import TF_SAMPLES
from model.sensitivity.cosine import cosine
from model.training.codec_loss import CodecLoss, layer_opacity
from model.training.optimizers import adam, cosine_decay, set_rate
from model.training.options import TrainingOptions

LAYERS = (1, 4, 16, 64)
"""Thicknesses in voxels of the layers whose opacity is compared."""

CHECKED_SEED = 0x7F5C0DEC
"""Seed of the TFs that codecs are measured on, unlikely to be used for training."""

CHECKED_TFS = 400
CHECKED_DERIVATIVES = 80
REPORTS = 4


@dataclass(frozen=True)
class CodecRow:
    """A codec's errors on random TFs not used for training.

    Attributes
    ----------
    steps : int
        Number of training steps in this benchmark; 0 for a model's codec.
    layer_rmse : dict of int to float
        RMSE of the opacity (0..1) of homogeneous layers over TFs and scalar values,
        by thickness in voxels; at one voxel it is the RMSE of the TF.
    edit_cosine : tuple of float
        First decile, lower quartile and median over TFs of the cosine similarity
        between changes of the decoded TF and the smooth edits that cause them.
    """

    steps: int
    layer_rmse: dict[int, float]
    edit_cosine: tuple[float, float, float]


def train_codec(
    size: NetworkSize, options: TrainingOptions, scene: Scene, steps: int
) -> Iterator[CodecRow]:
    """Train a codec with the decoded-TF loss alone.

    Parameters
    ----------
    size : NetworkSize
        Size of the codec's generator.
    options : TrainingOptions
        Each step uses `unrendered_tfs` TFs and the learning rate of `joint`.
    scene : Scene
        Determines the distribution of random TFs.

    Yields
    ------
    CodecRow
        Measurements after each quarter of the steps.

    Raises
    ------
    TrainingError
        If `unrendered_tfs` is 0.
    """
    if not options.unrendered_tfs:
        raise TrainingError("A codec alone learns from 'unrendered_tfs' only: set it above 0.")
    torch.manual_seed(options.seed)
    codec = build_generator(size, scene).codec
    if options.kaiming_init:
        kaiming_init(codec)
    loss = CodecLoss(scene, options)
    optimizer = adam(codec, options.beta2)
    device = torch.device("cpu")
    reports = {steps * part // REPORTS for part in range(1, REPORTS + 1)}
    for step in range(steps):
        set_rate(optimizer, options.joint.learning_rate * cosine_decay(step / steps))
        optimizer.zero_grad()
        torch.autograd.backward(loss.without_images(codec, step, device))
        optimizer.step()
        if step + 1 in reports:
            yield replace(measure_codec(codec, scene), steps=step + 1)


def measure_codec(codec: LatentCodec, scene: Scene) -> CodecRow:
    """Measure a codec on random TFs of a scene."""
    tfs = encode_unit(draw_opacity_tfs(scene, CHECKED_SEED, 0, CHECKED_TFS))
    with torch.no_grad():
        decoded = codec.decode(codec.encode(tfs))
    cosines = _edit_cosines(codec, tfs[:CHECKED_DERIVATIVES], scene)
    tenth, quartile, median = np.quantile(cosines, [0.1, 0.25, 0.5])
    return CodecRow(
        steps=0,
        layer_rmse={n: _layer_rmse(decoded, tfs, n) for n in LAYERS},
        edit_cosine=(float(tenth), float(quartile), float(median)),
    )


def _layer_rmse(decoded: Tensor, true: Tensor, voxels: int) -> float:
    one, other = (layer_opacity(tf.double(), voxels) for tf in (decoded, true))
    return float((one - other).square().mean().sqrt())


def _edit_cosines(codec: LatentCodec, tfs: Tensor, scene: Scene) -> list[float]:
    """Cosine similarity, for each TF, of the decoded and true edits in the scalar window."""
    inside = scene.window_samples
    edits = response_to_edits(np.eye(TF_SAMPLES, dtype=np.float32), EDIT_WIDTH)[:, inside]
    cosines = []
    for tf in tfs:
        jacobian = torch.func.jacrev(lambda x: codec.decode(codec.encode(x[None]))[0])(tf)
        follows = response_to_edits(jacobian.detach().numpy(), EDIT_WIDTH)[:, inside]
        cosines.append(cosine(follows.ravel(), edits.ravel()))
    return cosines
