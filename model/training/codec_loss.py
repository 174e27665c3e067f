"""Loss of the opacity TF codec: differences of decoded TFs from encoded ones.

With a loss on reconstruction alone, small edits of a TF come to change the decoded TF arbitrarily:
images improve, but their derivatives get worse. So the loss includes edits of TFs.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model.networks.generator_network import LatentCodec, decode_unit
from model.samples.sampling import EDIT_HEIGHT, draw_edits, draw_opacity_tfs
from model.scene.scene import Scene
from model.training.batch import EncodedBatch
from model.training.options import TrainingOptions
from model.training.parallel import rank, ranks

LAYER = 32  # thickness in voxels of the layers whose opacity the loss includes


class CodecLoss:
    """Decoded-TF loss (paper, Eq. 8), optionally also over TFs without rendered images."""

    def __init__(self, scene: Scene, options: TrainingOptions) -> None:
        self._scene = scene
        self._options = options
        self._tfs: Tensor | None = None
        self._prepared: int | None = None

    def __call__(
        self, codec: LatentCodec, decoded: Tensor, batch: EncodedBatch, step: int
    ) -> Tensor:
        """Return the loss of decoded TFs (N, 256) in [-1, 1] and of this step's random TFs."""
        error = decoded_tf_error(decoded, batch.inputs.opacity_tf, self._options.thick_layer_weight)
        if not self._options.unrendered_tfs:
            return error
        # Equal weights for any batch size, so that a batch's parts add up to the whole.
        return (error + self.without_images(codec, step, decoded.device)) / 2

    def without_images(self, codec: LatentCodec, step: int, device: torch.device) -> Tensor:
        """Return the loss of this step's random TFs alone; `unrendered_tfs` must not be 0."""
        options = self._options
        tfs, edited = self._of_step(step, device)
        if options.tf_edit_weight:
            with torch.autocast(device.type, enabled=False):
                # The difference of two similar TFs needs float32 precision.
                twice = codec.decode(codec.encode(torch.cat([tfs, edited])))
            decoded, after = twice.chunk(2)
            # Relative to the squared height of edits.
            change = (after - decoded) - (edited - tfs)
            missed = (change / (2 * EDIT_HEIGHT)).square().mean()
        else:
            decoded, missed = codec.decode(codec.encode(tfs)), tfs.new_zeros(())
        error = decoded_tf_error(decoded, tfs, options.thick_layer_weight)
        return error + options.tf_edit_weight * missed

    def prepare(self, step: int, device: torch.device) -> None:
        """Replace the random TFs by those of a step, in place, for recorded passes."""
        if not self._options.unrendered_tfs:
            return
        drawn = torch.from_numpy(self._draw(step))
        if self._tfs is None or self._tfs.device.type != device.type:
            self._tfs = drawn.to(device)
        else:
            self._tfs.copy_(drawn)
        self._prepared = step

    def _of_step(self, step: int, device: torch.device) -> tuple[Tensor, Tensor]:
        """A step's random TFs (N, 256), and a random edit of each (N, 256), in [-1, 1]."""
        if self._tfs is None or self._prepared != step or self._tfs.device.type != device.type:
            self.prepare(step, device)
        assert self._tfs is not None
        tfs, edited = self._tfs.unbind()
        return tfs, edited

    def _draw(self, step: int) -> NDArray[np.float32]:
        index = step * ranks() + rank()
        seed, count = self._options.seed, self._options.unrendered_tfs
        tfs = draw_opacity_tfs(self._scene, seed, index, count)
        edited = tfs
        if self._options.tf_edit_weight:
            edited = (tfs + draw_edits(self._scene, seed, index, count)).clip(0, 1)
        return 2 * np.stack([tfs, edited]) - 1


def decoded_tf_error(decoded: Tensor, opacity_tf: Tensor, thick: float) -> Tensor:
    """Return the mean squared error of decoded opacity TFs (N, 256) in [-1, 1]."""
    decoded = decoded.float()
    error = (decoded - opacity_tf).square().mean()
    if thick:
        layers = 2 * (layer_opacity(decoded) - layer_opacity(opacity_tf))
        error = error + thick * layers.square().mean()
    return error


def layer_opacity(opacity_tf: Tensor) -> Tensor:
    """Opacity in [0, 1] of homogeneous layers of :data:`LAYER` voxels, for TFs in [-1, 1]."""
    return 1 - (1 - decode_unit(opacity_tf)) ** LAYER
