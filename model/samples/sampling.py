"""Random samples of a scene, each a function of seed, split and index."""

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from model.scene.inputs import SceneInputs, draw_inputs
from model.scene.random_inputs import OpacityKind, draw_kind, draw_opacity_tf, draw_view
from model.scene.scene import Scene
from model.scene.tf_perturbation import EDIT_WIDTH
from model.scene.transfer_function import TF_SAMPLES

Split = Literal["train", "holdout"]  # samples to train on, or held out for evaluation
TF_STREAM = 3  # seed component of random opacity TFs without images, distinct from all splits'
EDIT_STREAM = 4  # seed component of random edits of opacity TFs
EDIT_HEIGHT = 0.1  # maximum opacity that random edits add or subtract


def sample_rng(seed: int, split: Split, index: int) -> np.random.Generator:
    """Return the random generator of one sample, which depends only on the arguments."""
    return np.random.default_rng([seed, get_args(Split).index(split), index])


def draw_sample(scene: Scene, seed: int, split: Split, index: int) -> SceneInputs:
    """Draw the inputs of sample `index` of a split of this scene."""
    return draw_inputs(sample_rng(seed, split, index), scene)


def sample_kind(scene: Scene, seed: int, split: Split, index: int) -> OpacityKind:
    """Return the kind of a sample's opacity TF, by drawing the preceding inputs again."""
    rng = sample_rng(seed, split, index)
    draw_view(rng, scene.view_range)
    return draw_kind(rng, scene)


def draw_opacity_tfs(scene: Scene, seed: int, index: int, count: int) -> NDArray[np.float32]:
    """Draw opacity TFs (count, 256) without images, which depend on the arguments only."""
    rng = np.random.default_rng([seed, TF_STREAM, index])
    tfs = [draw_opacity_tf(rng, scene) for _ in range(count)]
    return np.stack([tf.sample(scene.scalar_range) for tf in tfs])


def draw_edits(scene: Scene, seed: int, index: int, count: int) -> NDArray[np.float32]:
    """Draw smooth edits (count, 256) of opacity TFs, which depend on the arguments only.

    They are Gaussians, positive or negative, with means uniform in the scalar window, and standard
    deviations log-uniform from half to four times :data:`EDIT_WIDTH`.
    """
    rng = np.random.default_rng([seed, EDIT_STREAM, index])
    lo, hi = scene.scalar_range
    means = rng.uniform(*scene.scalar_window, (count, 1))
    widths = EDIT_WIDTH * 2.0 ** rng.uniform(-1, 2, (count, 1))
    heights = EDIT_HEIGHT * rng.choice([-1.0, 1.0], (count, 1))
    bins = np.arange(TF_SAMPLES) - (means - lo) / (hi - lo) * (TF_SAMPLES - 1)
    return (heights * np.exp(-0.5 * (bins / widths) ** 2)).astype(np.float32)
