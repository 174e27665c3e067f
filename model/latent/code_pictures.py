"""Pictures of latent codes by a generator: of the codes themselves, or of the TFs they decode to.

The two differ. A picture of a code is what the paper shows: the generator's image of a point of
its latent space (section 5.2). The TF that a code decodes to is encoded again when it is drawn,
which gives another code, and so the picture of what somebody who takes the TF will see.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.generator.generator import Generator
from model.latent.codes import Codes, PictureOf, checked_codes
from model.latent.latent_map import Cells
from model.latent.latent_space import LatentSpace
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF

Images = NDArray[np.float32]


def draw_codes(
    generator: Generator,
    space: LatentSpace,
    codes: Codes,
    inputs: SceneInputs,
    of: PictureOf = "code",
) -> Images:
    """Draw pictures (n, S, S, 4) of latent codes (n, d), in one pass.

    View, light and colours are those of the inputs, whose opacity TF is not used. For pictures of
    codes the space is the generator's own. Raises :class:`LatentError` for codes that are not
    finite or not of the generator.
    """
    codes = checked_codes(codes)
    if of == "tf":
        return _of_tfs(generator, space.tfs_of(codes), inputs)
    return generator.render_latent(codes, inputs)


def draw_cells(
    generator: Generator,
    space: LatentSpace,
    cells: Cells,
    inputs: SceneInputs,
) -> Images:
    """Draw the pictures (4, 4, S, S, 4) of a brushed rectangle's cells.

    They are NaN in cells without samples. Raises :class:`LatentError` as :func:`draw_codes` does,
    and when no cell has samples.
    """
    filled = cells.count > 0
    drawn = draw_codes(generator, space, cells.codes[filled], inputs)
    images = np.full((*filled.shape, *drawn.shape[1:]), np.nan, dtype=np.float32)
    images[filled] = drawn
    return images


def _of_tfs(generator: Generator, tfs: Sequence[OpacityTF], inputs: SceneInputs) -> Images:
    return generator.render_batch([replace(inputs, opacity_tf=tf) for tf in tfs])
