"""Agreement of a generator's sensitivities with the renderer's exact ones.

Accurate images do not imply accurate derivatives. Those by edits of the opacity TF are compared for
the whole image and for 8 x 8 blocks. Edits outside the scalar window are excluded: training TFs
have no modes there, and the response of the background would dominate the comparison.
"""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.generator.generator import Generator
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.tf_perturbation import EDIT_WIDTH, response_to_edits
from model.scene.volume import Volume
from model.sensitivity.display import cosine
from model.sensitivity.exact import region_sensitivity, sensitivity_field
from model.sensitivity.learned import Sensitivity

BLOCKS = 8  # number of blocks along each side of the image


@dataclass(frozen=True)
class HoldoutAgreement:
    """Similarity of learned and exact sensitivities per sample, -1 to 1, arrays of shape (N,)."""

    image_cosine: NDArray[np.float64]  # of the whole image's sensitivities
    block_cosine: NDArray[np.float64]  # over blocks and values

    def to_json(self) -> dict[str, dict[str, float]]:
        """Return median and quartiles of each measure as plain data."""
        return {
            name: {
                "median": float(np.median(values)),
                "quartile1": float(np.quantile(values, 0.25)),
                "quartile3": float(np.quantile(values, 0.75)),
            }
            for name, values in vars(self).items()
        }


def sensitivity_agreement(
    generator: Generator,
    volume: Volume,
    samples: Sequence[SceneInputs],
    on_progress: Callable[[int], None] = lambda done: None,
) -> HoldoutAgreement:
    """Compare a generator's sensitivities with exact ones; :class:`RenderError` without these."""
    scene = generator.scene
    size = scene.image_size
    inside = scene.window_samples
    whole, block = Region.whole(size), -(-size // BLOCKS)
    place = volume, scene.lighting, scene.light, scene.sample_distance
    rows = []
    with closing(RaycastRenderer(*place)) as renderer:
        for done, sample in enumerate(samples, start=1):
            learned = Sensitivity(generator, sample, edit_width=0)
            pairs = (
                (learned.region(whole), region_sensitivity(renderer, sample, size, whole)),
                (learned.field(block), sensitivity_field(renderer, sample, size, block)),
            )
            responses = (
                [response_to_edits(slopes[..., inside], EDIT_WIDTH).ravel() for slopes in pair]
                for pair in pairs
            )
            rows.append([cosine(*pair) for pair in responses])
            on_progress(done)
    return HoldoutAgreement(*np.array(rows).T)
