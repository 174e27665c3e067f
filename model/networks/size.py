"""What the size of every network follows from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from model.errors import TfscopeError

Architecture = Literal["paper", "grid", "grid-translation"]


@dataclass(frozen=True)
class NetworkSize:
    """What the size of every network follows from.

    Attributes
    ----------
    width : float
        Share of the paper's number of channels; 1 is the paper's network.
    opacity_size : int
        Width and height of the opacity image, a power of two from 16.
    image_size : int
        Width and height of the colour image: the opacity image's size times
        1, 2, 4 or more powers of two.
    latent_dim : int
        Length of the latent code of an opacity TF.
    architecture : {"paper", "grid", "grid-translation"}
        The paper's two networks; both images from a feature grid; or the feature
        grid's opacity image in front of the paper's translation.
    features : int
        Numbers at each node of the feature grid, where there is one.
    rays : bool
        Whether a feature grid is accompanied by a finer one that is summed up
        along each pixel's line of sight.
    modulation : bool
        Whether the codes of view and TFs also scale and shift the translation
        decoder's features at every resolution. The paper's network has only
        the tiled codes; small networks then take very long to heed colours.
    deep_codec : bool
        Whether two layers decode the latent code to an opacity TF, instead of
        the paper's one.

    Raises
    ------
    TfscopeError
        For sizes that the networks cannot be built for.
    """

    width: float = 1.0
    opacity_size: int = 64
    image_size: int = 256
    latent_dim: int = 8
    features: int = 16
    rays: bool = False
    modulation: bool = False
    deep_codec: bool = False
    architecture: Architecture = "paper"

    def __post_init__(self) -> None:
        for name in ("opacity_size", "image_size"):
            size = getattr(self, name)
            if not isinstance(size, int) or size < 16 or size & (size - 1):
                raise TfscopeError(f"The {name} {size} is not a power of two of at least 16.")
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
        for name in ("latent_dim", "features"):
            number = getattr(self, name)
            if not isinstance(number, int) or number < 1:
                raise TfscopeError(f"The network's {name} is {number}; give a number from 1.")
        if not 0 < self.width <= 4:
            raise TfscopeError(f"The network's width {self.width} is not in 0..4.")

    def channels(self, full: int) -> int:
        """Scale a number of channels of the paper's network to this width, in steps of 8."""
        return max(8, 8 * round(full * self.width / 8))
