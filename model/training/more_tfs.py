"""Opacity TFs without images, for the codec to learn from."""

from __future__ import annotations

from torch import Tensor

from model.encoding import EncodedBatch, encode_unit
from model.networks.opacity import LatentCodec
from model.sampling import draw_opacity_tfs
from model.scene import Scene
from model.training.losses import decoded_tf_error
from model.training.parallel import rank, ranks


class MoreTFs:
    """The decoded-TF loss over more TFs than have been rendered (paper, Eq. 7).

    Parameters
    ----------
    scene : Scene
        Says where random modes lie.
    seed, count : int
        Number of TFs beside those of each step's samples; 0 for none.
    """

    def __init__(self, scene: Scene, seed: int, count: int) -> None:
        self._scene = scene
        self._seed = seed
        self._count = count

    def error(self, codec: LatentCodec, decoded: Tensor, batch: EncodedBatch, step: int) -> Tensor:
        """Mean squared difference of decoded opacity TFs, of a batch and of this step's others.

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
        error = decoded_tf_error(decoded, batch.opacity_tf)
        if not self._count:
            return error
        index = step * ranks() + rank()
        tfs = encode_unit(draw_opacity_tfs(self._scene, self._seed, index, self._count))
        tfs = tfs.to(decoded.device)
        others = decoded_tf_error(codec.decode(codec.encode(tfs)), tfs)
        # Half and half, whatever the batch: parts of one then add up to the whole.
        return (error + others) / 2
