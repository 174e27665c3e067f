"""Size and variants of the networks."""

from dataclasses import dataclass

from model.errors import TfscopeError


@dataclass(frozen=True)
class NetworkSize:
    """Size of the paper's networks, and additions; invalid ones are a :class:`TfscopeError`."""

    width: float = 1.0  # number of channels as a fraction of the paper's, above 0 and up to 4
    opacity_size: int = 64  # width and height of the opacity image, a power of two from 16
    image_size: int = 256  # of the colour image, at least that of the opacity image
    latent_dim: int = 8  # length of the latent code of an opacity TF
    modulation: bool = False
    """Whether the codes of view and TFs also scale and shift the features of the translation
    decoder, and of the opacity generator, at every resolution. The paper's network has only the
    tiled codes; small networks then learn colours very slowly."""
    deep_codec: bool = False  # two hidden layers of the latent decoder instead of the paper's one

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
        if not (isinstance(self.latent_dim, int) and 1 <= self.latent_dim <= 4096):
            raise TfscopeError(
                f"The network's latent_dim is {self.latent_dim}; give a number from 1 to 4096."
            )
        if not 0 < self.width <= 4:
            raise TfscopeError(f"The network's width {self.width} is not in 0..4.")

    def channels(self, full: int) -> int:
        """Scale a number of channels of the paper's network by the width, in multiples of 8."""
        return max(8, 8 * round(full * self.width / 8))
