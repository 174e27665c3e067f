"""A generator's sensitivity to the opacity TF (paper, section 5.1 and Eq. 9).

The image depends on the opacity TF only through the latent code, so its
derivative by the TF is a product of two small factors: image by code, and
code by TF, whose rank is at most the code's length (8 by default). Both are
stored; the sensitivity of any region follows from sums over it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from torch.autograd import forward_ad
from torch.autograd.functional import jacobian

from model.generator.generator import Generator
from model.networks.encoding import decode_unit
from model.scene.inputs import SceneInputs
from model.scene.region import Region, block_edges
from model.scene.tf_perturbation import EDIT_WIDTH, response_to_edits


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivative of an image by the opacity TF, as two factors.

    Attributes
    ----------
    image : ndarray of float32, shape (S, S, 3)
        Colours in [0, 1], row 0 at the top.
    image_by_latent : ndarray of float32, shape (latent_dim, S, S, 3)
        Derivative of the image by the latent code.
    latent_by_tf : ndarray of float32, shape (latent_dim, 256)
        Response of the latent code to an edit around each value of the scene's
        scalar range, per unit of opacity: the edit's opacities add up to 1.
    """

    image: NDArray[np.float32]
    image_by_latent: NDArray[np.float32]
    latent_by_tf: NDArray[np.float32]

    def region(self, region: Region) -> NDArray[np.float32]:
        """Sensitivity of one region to edits at each scalar value of the TF.

        Returns
        -------
        ndarray of float32, shape (256,)
            Derivative of the l2 norm of the region's colours; 0 for a black
            region, whose norm has no derivative.

        Raises
        ------
        RenderError
            For a region outside the image.
        """
        region.check(len(self.image))
        rows, columns = np.array([region.top, region.bottom]), np.array([region.left, region.right])
        return self._of_blocks(rows, columns)[0, 0]

    def field(self, block: int) -> NDArray[np.float32]:
        """Sensitivity of each block of the image to edits at each scalar value of the TF.

        Parameters
        ----------
        block : int
            Width and height of a block in pixels, from 1 to the image's size.

        Returns
        -------
        ndarray of float32, shape (n, n, 256)

        Raises
        ------
        RenderError
            For a block size outside 1 to the image's size.
        """
        edges = np.array(block_edges(len(self.image), block))
        return self._of_blocks(edges, edges)

    @cached_property
    def _sums(self) -> NDArray[np.float64]:
        """Summed-area tables, (latent_dim + 1, S + 1, S + 1): I dI / dz, and I squared."""
        image = self.image.astype(np.float64)
        products = [(image * slope).sum(axis=-1) for slope in self.image_by_latent]
        products.append((image * image).sum(axis=-1))
        sums = np.pad(np.stack(products), ((0, 0), (1, 0), (1, 0)))
        return np.asarray(sums.cumsum(axis=1).cumsum(axis=2))

    def _of_blocks(
        self, rows: NDArray[np.int64], columns: NDArray[np.int64]
    ) -> NDArray[np.float32]:
        """Sensitivities (rows - 1, columns - 1, 256) of the blocks between edges."""
        corners = self._sums[:, rows][:, :, columns]
        blocks = np.diff(np.diff(corners, axis=1), axis=2)
        norms = np.sqrt(np.maximum(blocks[-1], 0))
        by_latent = np.divide(blocks[:-1], norms, out=np.zeros_like(blocks[:-1]), where=norms > 0)
        return np.asarray(np.einsum("lrc,lt->rct", by_latent, self.latent_by_tf), dtype=np.float32)


def generator_sensitivity(
    generator: Generator, inputs: SceneInputs, edit_width: float = EDIT_WIDTH
) -> Sensitivity:
    """Differentiate a generator's image by the opacity TF.

    Uses forward-mode differentiation along the axes of the latent code, in one
    pass with a batch of latent_dim images.

    Parameters
    ----------
    generator : Generator
    inputs : SceneInputs
    edit_width : float
        Standard deviation of the edits in bins; 0 for single bins.
    """
    network = generator.network
    conditions, opacity, color_tf = generator.encoded([inputs])
    latent_by_tf = jacobian(network.opacity.encode, opacity)[0, :, 0]  # type: ignore[no-untyped-call]
    with torch.no_grad(), forward_ad.dual_level():
        latent = network.opacity.encode(opacity)
        count = latent.shape[1]
        axes = torch.eye(count, device=latent.device)
        codes = latent.expand(count, -1).contiguous()
        rows = forward_ad.make_dual(codes, axes)  # type: ignore[no-untyped-call]
        conditions = conditions.expand(count, -1)
        image_dual = network.render_latent(conditions, rows, color_tf.expand(count, -1, -1))[0]
        dual = forward_ad.unpack_dual(image_dual)  # type: ignore[no-untyped-call]
        image, slopes = decode_unit(dual.primal[0]), dual.tangent
    return Sensitivity(
        image=image.permute(1, 2, 0).cpu().numpy(),
        # Networks use [-1, 1]: factors 1/2 for image values in [0, 1], and 2 for opacities.
        image_by_latent=(slopes / 2).permute(0, 2, 3, 1).contiguous().cpu().numpy(),
        latent_by_tf=response_to_edits(2 * latent_by_tf.cpu().numpy(), edit_width),
    )
