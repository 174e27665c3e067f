"""What the codec of opacity TFs is trained by: how far decoded TFs are from what was encoded.

A TF has more degrees of freedom than its code has numbers. Left alone, a codec
learns to tell TFs apart by folding them into the code ever more finely, until
a small edit of a TF moves the decoded one anywhere; images improve by that,
but not their derivatives. So edits of TFs are learned from, too.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model.networks.codec import LatentCodec
from model.networks.encoding import decode_unit, encode_unit
from model.samples.sampling import EDIT_HEIGHT, draw_edits, draw_opacity_tfs
from model.scene.scene import Scene
from model.training.batch import EncodedBatch
from model.training.options import TrainingOptions
from model.training.parallel import rank, ranks

LAYER = 32
"""Thickness in voxels of the layers whose opacity counts, too."""


class CodecLoss:
    """The decoded-TF loss (paper, Eq. 7), also over TFs that have not been rendered.

    Parameters
    ----------
    scene : Scene
        Says where random modes lie.
    options : TrainingOptions
        Its `unrendered_tfs`, `thick_layer_weight`, `tf_edit_weight` and `seed`.
    """

    def __init__(self, scene: Scene, options: TrainingOptions) -> None:
        self._scene = scene
        self._options = options

    def __call__(
        self, codec: LatentCodec, decoded: Tensor, batch: EncodedBatch, step: int
    ) -> Tensor:
        """The loss of a batch's decoded TFs and of this step's others.

        Parameters
        ----------
        codec : LatentCodec
        decoded : Tensor, shape (N, 256)
            The batch's decoded TFs.
        batch : EncodedBatch
        step : int
            The same step has the same TFs, so that resumed runs repeat; ranks
            have different ones.
        """
        error = decoded_tf_error(decoded, batch.inputs.opacity_tf, self._options.thick_layer_weight)
        if not self._options.unrendered_tfs:
            return error
        # Half and half, whatever the batch: parts of one then add up to the whole.
        return (error + self.without_images(codec, step, decoded.device)) / 2

    def without_images(self, codec: LatentCodec, step: int, device: torch.device) -> Tensor:
        """The loss of this step's random TFs alone; there must be some (`unrendered_tfs`)."""
        options = self._options
        index = step * ranks() + rank()
        drawn = draw_opacity_tfs(self._scene, options.seed, index, options.unrendered_tfs)
        tfs = encode_unit(drawn).to(device)
        if options.tf_edit_weight:
            decoded, missed = self._edited(codec, drawn, tfs, index)
        else:
            decoded, missed = codec.decode(codec.encode(tfs)), tfs.new_zeros(())
        error = decoded_tf_error(decoded, tfs, options.thick_layer_weight)
        return error + options.tf_edit_weight * missed

    def _edited(
        self, codec: LatentCodec, drawn: NDArray[np.float32], tfs: Tensor, index: int
    ) -> tuple[Tensor, Tensor]:
        """Decoded TFs, and how far they are from following a random edit of each."""
        edits = draw_edits(self._scene, self._options.seed, index, len(drawn))
        edited = encode_unit((drawn + edits).clip(0, 1)).to(tfs.device)
        with torch.autocast(tfs.device.type, enabled=False):
            # The difference of two TFs that are alike needs float32's digits.
            twice = codec.decode(codec.encode(torch.cat([tfs, edited])))
        before, after = twice.chunk(2)
        return before, edit_error(after - before, edited - tfs)


def decoded_tf_error(decoded: Tensor, opacity_tf: Tensor, thick: float) -> Tensor:
    """How far decoded opacity TFs are from true ones, both (N, 256) in [-1, 1].

    Parameters
    ----------
    decoded, opacity_tf : Tensor
    thick : float
        Weight of the squared error of :func:`layer_opacity`, beside that of
        the TFs themselves. A faint mode is hardly seen in the curve, but well
        where the volume has a wide region of its values.
    """
    decoded = decoded.float()
    error = (decoded - opacity_tf).square().mean()
    if thick:
        layers = 2 * (layer_opacity(decoded) - layer_opacity(opacity_tf))
        error = error + thick * layers.square().mean()
    return error


def edit_error(decoded: Tensor, edits: Tensor) -> Tensor:
    """How far changes of decoded TFs are from the edits that caused them.

    Parameters
    ----------
    decoded, edits : Tensor, shape (N, 256)
        Differences of TFs in [-1, 1].

    Returns
    -------
    Tensor
        Mean squared difference, in units of an edit's height.
    """
    return ((decoded - edits) / (2 * EDIT_HEIGHT)).square().mean()


def layer_opacity(opacity_tf: Tensor, voxels: int = LAYER) -> Tensor:
    """Opacity in [0, 1] of a layer as thick as that, for TFs in [-1, 1]."""
    return 1 - (1 - decode_unit(opacity_tf)) ** voxels
