"""Random samples of a scene, each a function of seed, split and number.

:func:`sample_rng` gives each sample of each split random numbers of its own:
sample 17 is the same whichever process draws it, and in whatever order.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs, draw_inputs
from model.scene.random_inputs import draw_opacity_tf
from model.scene.scene import Scene
from model.scene.tf_perturbation import EDIT_WIDTH
from model.scene.transfer_function import TF_SAMPLES

Split = Literal["train", "holdout"]
"""Which samples: those to learn from, or those that no training ever sees."""

TF_STREAM = 3
"""Tells the random numbers of opacity TFs on their own from all others."""

EDIT_STREAM = 4
"""The same for edits of opacity TFs."""

EDIT_HEIGHT = 0.1
"""Opacity that random edits add or take away where they are highest."""


def sample_rng(seed: int, split: Split, index: int) -> np.random.Generator:
    """The random generator of one sample: a function of its arguments only."""
    return np.random.default_rng([seed, get_args(Split).index(split), index])


def draw_sample(scene: Scene, seed: int, split: Split, index: int) -> SceneInputs:
    """Draw the inputs of sample `index` of a split of this scene."""
    return draw_inputs(sample_rng(seed, split, index), scene)


def draw_opacity_tfs(scene: Scene, seed: int, index: int, count: int) -> NDArray[np.float32]:
    """Draw opacity TFs on their own, sampled over the scalar range: (count, 256), in 0..1.

    Batch `index` is a function of the arguments only, like a sample.
    """
    rng = np.random.default_rng([seed, TF_STREAM, index])
    tfs = [draw_opacity_tf(rng, scene.scalar_range, scene.scalar_window) for _ in range(count)]
    return np.stack([tf.sample(scene.scalar_range) for tf in tfs])


def draw_edits(scene: Scene, seed: int, index: int, count: int) -> NDArray[np.float32]:
    """Draw smooth edits of opacity TFs, sampled over the scalar range: (count, 256).

    Batch `index` is a function of the arguments only, like a sample.

    Returns
    -------
    ndarray of float32, shape (count, 256)
        Bumps of a height of :data:`EDIT_HEIGHT`, up or down, to be added to a
        TF's opacities: Gaussians with means uniform in the scalar window and
        standard deviations from half to four times those that sensitivities
        stand for (:data:`model.scene.tf_perturbation.EDIT_WIDTH`), on a logarithmic scale.
    """
    rng = np.random.default_rng([seed, EDIT_STREAM, index])
    lo, hi = scene.scalar_range
    means = rng.uniform(*scene.scalar_window, (count, 1))
    widths = EDIT_WIDTH * 2.0 ** rng.uniform(-1, 2, (count, 1))
    heights = EDIT_HEIGHT * rng.choice([-1.0, 1.0], (count, 1))
    bins = np.arange(TF_SAMPLES) - (means - lo) / (hi - lo) * (TF_SAMPLES - 1)
    return (heights * np.exp(-0.5 * (bins / widths) ** 2)).astype(np.float32)
