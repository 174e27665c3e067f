"""The paper's measure of a run: epochs, passes over a set of training images.

Its runs make 30 passes over 200,000 images in each of two stages, and halve the learning rate
every 5 and every 8 passes (section 6, implementation details).
"""

from __future__ import annotations

from model.training.options import TrainingOptions

PAPER_EPOCHS = 30.0
"""Passes of each stage of the paper's runs."""

PAPER_IMAGES = 200_000
"""Training images of the paper's runs."""

OPACITY_HALVED_EVERY = 5.0
"""Passes after which the paper halves the opacity GAN's learning rate."""

TRANSLATION_HALVED_EVERY = 8.0
"""Passes after which the paper halves the translation GAN's learning rate."""


def samples_of_epochs(epochs: float, images: int, options: TrainingOptions) -> int:
    """Return the budget in samples seen by all stages.

    Parameters
    ----------
    epochs : float
        Passes over the images in each stage.
    options : TrainingOptions
        The recipe, which says whether there are two stages.
    """
    return max(1, round(epochs * images * (1 if options.one_stage else 2)))


def halvings_of_epochs(epochs: float) -> tuple[str, ...]:
    """Return the settings by which rates halve as often as in the paper, in so many passes."""
    return (
        f"opacity.halvings={epochs / OPACITY_HALVED_EVERY:g}",
        f"translation.halvings={epochs / TRANSLATION_HALVED_EVERY:g}",
    )
