"""Architecture and size of the networks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from model.errors import TfscopeError

Architecture = Literal["refined", "paper"]


@dataclass(frozen=True)
class NetworkSize:
    """Architecture and size of the networks.

    Attributes
    ----------
    width : float
        Number of channels as a fraction of the paper's, above 0 and up to 4.
    opacity_size : int
        Width and height of the opacity image, a power of two from 16.
    image_size : int
        Width and height of the colour image, a power of two from `opacity_size`.
    latent_dim : int
        Length of the latent code of an opacity TF.
    architecture : {"refined", "paper"}
        A coarse volume drawn under the true TFs, refined by a small network; or the
        paper's two networks.
    nodes : int
        Largest number of nodes of the coarse volume, if there is one: a byte and a half
        each; half as many more, of a byte, where that keeps a volume whole.
    modulation : bool
        Whether the codes of view and TFs also scale and shift the translation
        decoder's features at every resolution. The paper's network has only
        the tiled codes; small networks then learn colours very slowly.
    opacity_modulation : bool
        Whether they do so in the opacity generator, too.
    deep_codec : bool
        Whether the latent decoder has two hidden layers instead of the paper's one.
    color_attention : bool
        Whether pixels look their colours up in the colour TF
        (:mod:`model.networks.paper.color_attention`), which the paper's network has as a
        code only.

    Raises
    ------
    TfscopeError
        For values that no network can be built from.
    """

    width: float = 1.0
    opacity_size: int = 64
    image_size: int = 256
    latent_dim: int = 8
    nodes: int = 1_610_000
    modulation: bool = False
    opacity_modulation: bool = False
    deep_codec: bool = False
    color_attention: bool = False
    architecture: Architecture = "paper"

    def __post_init__(self) -> None:
        for name in ("opacity_size", "image_size"):
            size = getattr(self, name)
            if not (isinstance(size, int) and 16 <= size <= 4096) or size & (size - 1):
                raise TfscopeError(f"The {name} {size} is not a power of two from 16 to 4096.")
        if self.image_size < self.opacity_size:
            raise TfscopeError(
                f"The colour image ({self.image_size} pixels) must not be smaller than "
                f"the opacity image ({self.opacity_size} pixels)."
            )
        if self.architecture not in get_args(Architecture):
            raise TfscopeError(
                f"The architecture '{self.architecture}' is unknown; "
                f"choose {', '.join(get_args(Architecture))}."
            )
        for name, most in (("latent_dim", 4096), ("nodes", 1 << 30)):
            number = getattr(self, name)
            if not (isinstance(number, int) and 1 <= number <= most):
                raise TfscopeError(
                    f"The network's {name} is {number}; give a number from 1 to {most}."
                )
        if not 0 < self.width <= 4:
            raise TfscopeError(f"The network's width {self.width} is not in 0..4.")

    def channels(self, full: int) -> int:
        """Scale a number of channels of the paper's network by the width, in multiples of 8."""
        return max(8, 8 * round(full * self.width / 8))
