"""Between what people mean and what the networks see: all values in [-1, 1].

Views become a 5-vector (:meth:`model.scene.view.View.vector`), opacities and image
values are scaled linearly, and colour TFs are given in CIELAB (paper, section
6, implementation details).
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model.scene.view import View, ViewRange

LAB_LOW = np.array([0.0, -86.185, -107.863])
LAB_HIGH = np.array([100.0, 98.254, 94.482])
"""Extent of the RGB cube in CIELAB (L, a, b)."""

WHITE = (0.95047, 1.0, 1.08883)
"""CIE XYZ of the white point, D65."""

XYZ_TO_RGB = (
    (3.2404813432, -1.5371515163, -0.4985363262),
    (-0.9692549500, 1.8759900015, 0.0415559266),
    (0.0556466391, -0.2040413384, 1.0573110696),
)
"""Linear sRGB of CIE XYZ."""


def encode_views(views: list[View], view_range: ViewRange) -> Tensor:
    """Tensor (N, 5) of views."""
    return torch.from_numpy(np.stack([view.vector(view_range) for view in views]))


def encode_unit(values: NDArray[np.float32]) -> Tensor:
    """Scale values of any shape from [0, 1] to [-1, 1]."""
    return torch.from_numpy(np.ascontiguousarray(values)) * 2 - 1


def decode_unit(values: Tensor) -> Tensor:
    """Scale values of any shape from [-1, 1] to [0, 1]."""
    # No fewer digits than float32's, and float64's where derivatives are checked.
    return values.to(torch.promote_types(values.dtype, torch.float32)) / 2 + 0.5


def rgb_to_lab(rgb: NDArray[np.float32]) -> NDArray[np.float32]:
    """CIELAB of RGB (..., 3), each channel scaled so that the RGB cube fills [-1, 1].

    Values outside [0, 1] are clipped first: CIELAB has no meaning there, and
    its roots would give NaN.
    """
    # Imported here: networks that draw want it only for colour TFs.
    from skimage.color import rgb2lab

    lab = rgb2lab(np.clip(rgb, 0.0, 1.0))
    return (2 * (lab - LAB_LOW) / (LAB_HIGH - LAB_LOW) - 1).astype(np.float32)


def encode_colors(color_tf: NDArray[np.float32]) -> Tensor:
    """Tensor (N, 3, 256) in scaled CIELAB of colour TFs (N, 256, 3) in RGB."""
    return torch.from_numpy(np.ascontiguousarray(rgb_to_lab(color_tf).transpose(0, 2, 1)))


def decode_colors(color_tf: Tensor) -> Tensor:
    """RGB (N, 3, 256) in [0, 1] of colour TFs in scaled CIELAB (N, 3, 256).

    The inverse of :func:`encode_colors`, as a differentiable function.
    """
    low, high = (color_tf.new_tensor(bound)[:, None] for bound in (LAB_LOW, LAB_HIGH))
    lightness, a, b = (low + (color_tf + 1) / 2 * (high - low)).unbind(1)
    y = (lightness + 16) / 116
    roots = torch.stack([y + a / 500, y, y - b / 200], dim=1)
    # CIE's definition of CIELAB, with its straight part near black.
    straight = (roots - 4 / 29) * 3 * (6 / 29) ** 2
    xyz = torch.where(roots > 6 / 29, roots**3, straight) * roots.new_tensor(WHITE)[:, None]
    linear = torch.einsum("rx,nxb->nrb", xyz.new_tensor(XYZ_TO_RGB), xyz).clamp(0, 1)
    # sRGB's transfer curve; its root has no derivative at 0.
    curved = 1.055 * linear.clamp_min(1e-6) ** (1 / 2.4) - 0.055
    return torch.where(linear > 0.0031308, curved, 12.92 * linear)
