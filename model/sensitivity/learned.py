"""A generator's sensitivity to the opacity TF (paper, section 5.1 and Eq. 11).

A region's sensitivity to the TF takes one reverse pass, an edit's effect on the image one forward
pass. A field of all blocks and values takes a reverse pass per block, or a forward pass per number
of the TF's latent code, which are fewer.
"""

import math
from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.autograd import forward_ad
from torch.autograd.functional import jacobian

from model.generator.generator import Generator, panned, unpanned
from model.networks.generator_network import EncodedInputs, decode_unit
from model.scene.inputs import SceneInputs
from model.scene.region import ImageRegion, Mask, Region, block_edges, block_sums
from model.scene.tf_perturbation import (
    EDIT_WIDTH,
    norms_at_all_bins,
    response_to_edits,
    spaced_edits,
)
from model.scene.transfer_function import TF_SAMPLES

TOGETHER = 8  # forward passes in a batch


class Sensitivity:
    """Derivatives of one generated image by the opacity TF, per unit of opacity.

    Edits have a standard deviation in bins; 0 for single bins. Regions outside the image raise
    :class:`RenderError`.
    """

    def __init__(
        self, generator: Generator, inputs: SceneInputs, edit_width: float = EDIT_WIDTH
    ) -> None:
        self._network = generator.network
        self._size = generator.scene.image_size
        self._inputs = generator.encoded([inputs])
        self._view = inputs.view
        self._width = edit_width
        self._is_asked_again = False
        self._opacity = self._inputs.opacity_tf.clone().requires_grad_()

    @cached_property
    def image(self) -> NDArray[np.float32]:
        """Colours (S, S, 3) in [0, 1], row 0 at the top."""
        image: NDArray[np.float32] = self._image.detach().permute(1, 2, 0).cpu().numpy()
        return image

    @cached_property
    def _image(self) -> Tensor:
        """The image (3, S, S) with its graph, for reverse passes."""
        return self._images(self._inputs._replace(opacity_tf=self._opacity))[0]

    def region(self, region: ImageRegion) -> NDArray[np.float32]:
        """Derivative (256,) of the l2 norm of a region's colours by edits (Eq. 11); 0 if black."""
        slopes = self._reverse(unpanned(region.mask(self._size), self._view))
        return response_to_edits(slopes, self._width)

    def change_norms(self, region: ImageRegion) -> NDArray[np.float32]:
        """Norm (256,) of a region's change, by a forward pass per number of the code."""
        mask = unpanned(region.mask(self._size), self._view)
        bins, edits = spaced_edits(self._width)
        squares = [
            np.square(change[mask], dtype=np.float64).sum() for change in self._changes_of(edits)
        ]
        return norms_at_all_bins(bins, np.array(squares))

    def field(self, block: int) -> NDArray[np.float32]:
        """Sensitivity (n, n, 256) of blocks of so many pixels a side to edits at each value."""
        edges = block_edges(self._size, block)
        if (len(edges) - 1) ** 2 <= len(self._directions):
            return self.blockwise(block)
        return response_to_edits(self._forward_field(edges), self._width)

    def blockwise(self, block: int) -> NDArray[np.float32]:
        """Compute :meth:`field` like the paper: by one reverse pass per block."""
        return response_to_edits(self._blockwise_slopes(block), self._width)

    def _blockwise_slopes(self, block: int) -> NDArray[np.float32]:
        edges = block_edges(self._size, block)
        blocks = len(edges) - 1
        slopes = [
            self._reverse(Region(left, top, right, bottom).mask(self._size))
            for top, bottom in pairwise(edges)
            for left, right in pairwise(edges)
        ]
        return np.stack(slopes).reshape(blocks, blocks, TF_SAMPLES)

    def blockwise_change(self, block: int, edit: NDArray[np.float32]) -> NDArray[np.float32]:
        """Estimate :meth:`change` like the paper: each block's change of norm, spread evenly."""
        edges = block_edges(self._size, block)
        per_block = self._blockwise_slopes(block) @ edit
        sides = np.diff(edges)
        numbers = 3.0 * np.outer(sides, sides)
        spread = (per_block / np.sqrt(numbers)).repeat(sides, axis=0).repeat(sides, axis=1)
        return np.repeat(spread[..., None], 3, axis=2).astype(np.float32)

    def change(self, edit: NDArray[np.float32]) -> NDArray[np.float32]:
        """Change (S, S, 3) of the image per unit of an edit (256,) of the opacity TF.

        The first one takes a forward pass. The second one differentiates all directions of the
        code; further edits then take no pass.
        """
        again, self._is_asked_again = self._is_asked_again, True
        ways = self._changes_of if again else self._changes
        return panned(next(iter(ways(edit[None]))), self._view)

    def _changes_of(self, edits: NDArray[np.float32]) -> Iterator[NDArray[np.float32]]:
        """Yield the change (S, S, 3) of the image by each of some edits (N, 256)."""
        # Any edit's change is a sum of the directions' changes.
        for shares in edits @ self._directions.T:
            yield np.tensordot(shares, self._direction_changes, axes=1)

    @cached_property
    def _direction_changes(self) -> NDArray[np.float32]:
        """Changes (D, S, S, 3) of the image in the directions of the code."""
        directions = self._directions
        batches = (directions[i : i + TOGETHER] for i in range(0, len(directions), TOGETHER))
        return np.concatenate([self._changes(batch) for batch in batches])

    def _images(self, inputs: EncodedInputs) -> Tensor:
        return decode_unit(self._network(inputs)[0])

    def _reverse(self, mask: Mask) -> NDArray[np.float32]:
        """Derivative (256,) of the norm of some pixels by single bins."""
        pixels = self._image[:, torch.from_numpy(mask).to(self._image.device)]
        half_square = pixels.double().square().sum() / 2
        norm = math.sqrt(2 * half_square.item())
        if norm == 0:
            return np.zeros(TF_SAMPLES, dtype=np.float32)
        (slope,) = torch.autograd.grad(half_square, self._opacity, retain_graph=True)
        # Networks take opacities in [-1, 1], twice as wide as [0, 1].
        slopes: NDArray[np.float32] = (2 * slope[0] / norm).float().cpu().numpy()
        return slopes

    def _changes(self, edits: NDArray[np.float32]) -> NDArray[np.float32]:
        """Changes (N, S, S, 3) of the image by edits (N, 256)."""
        tangents = torch.from_numpy(2 * edits).to(self._inputs.opacity_tf)
        rows = self._inputs.map(
            lambda tensor: tensor.expand(len(edits), *tensor.shape[1:]).contiguous()
        )
        with torch.no_grad(), forward_ad.dual_level():
            opacity = forward_ad.make_dual(rows.opacity_tf, tangents)  # type: ignore[no-untyped-call]
            image = self._images(rows._replace(opacity_tf=opacity))
            change = forward_ad.unpack_dual(image).tangent  # type: ignore[no-untyped-call]
        if change is None:
            return np.zeros((len(edits), *image.shape[2:], 3), dtype=np.float32)
        changes: NDArray[np.float32] = change.permute(0, 2, 3, 1).cpu().numpy()
        return changes

    @cached_property
    def _directions(self) -> NDArray[np.float32]:
        """Orthonormal rows (D, 256) that span all TF edits that can change the image."""
        encode = self._network.codec.encode
        by_tf = jacobian(encode, self._inputs.opacity_tf)[0, :, 0]  # type: ignore[no-untyped-call]
        basis, _ = np.linalg.qr(by_tf.double().cpu().numpy().T)
        return np.asarray(basis.T, dtype=np.float32)

    def _forward_field(self, edges: list[int]) -> NDArray[np.float32]:
        """Sensitivities (n, n, 256) of all blocks to single bins, by forward passes."""
        image = self.image.astype(np.float64)
        norms = np.sqrt(block_sums((image * image).sum(axis=2), edges))
        field = np.zeros((*norms.shape, TF_SAMPLES))
        changes = self._changes_of(self._directions)
        for direction, change in zip(self._directions, changes, strict=True):
            sums = block_sums((image * change).sum(axis=2), edges)
            shares = np.divide(sums, norms, out=np.zeros_like(sums), where=norms > 0)
            field += shares[..., None] * direction
        return field.astype(np.float32)
