from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.stats import spearmanr

from model.generator.generator import Generator
from model.networks.card import ModelCard
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.sensitivity.agreement import rank_correlation, sensitivity_agreement
from model.sensitivity.cosine import cosine
from model.sensitivity.exact import region_sensitivity, sensitivity_field

SIZE = NetworkSize(0.125, 16, 32)


def generator_of(scene):
    card = ModelCard(scene, "draft", SIZE, {}, {}, {})
    return Generator(card, TwoStageGenerator(SIZE), torch.device("cpu"))


def own(volume, change):
    """In the place of the generator's sensitivity, the renderer's, changed somehow."""

    class Own:
        def __init__(self, _generator, inputs, edit_width):
            assert edit_width == 0
            self.arguments = (RaycastRenderer(volume), inputs, 32)

        def region(self, region):
            return change(region_sensitivity(*self.arguments, region))

        def field(self, block):
            return change(sensitivity_field(*self.arguments, block))

    return Own


def test_correlations_are_those_of_scipy():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=50), rng.integers(0, 9, 50).astype(float)
    assert rank_correlation(a, b) == pytest.approx(spearmanr(a, b).statistic)
    assert cosine(a, -3 * a) == pytest.approx(-1)
    assert cosine(a, np.zeros(50)) == 0
    assert rank_correlation(a, np.ones(50)) == 0


@pytest.mark.parametrize(("factor", "expected"), [(2.0, 1.0), (-1.0, -1.0)])
def test_the_renderers_own_sensitivity_agrees_with_itself(
    volume, scene, monkeypatch, factor, expected
):
    scene = replace(scene, image_size=32)

    monkeypatch.setattr(
        "model.sensitivity.agreement.Sensitivity", own(volume, lambda s: factor * s)
    )
    samples = [draw_sample(scene, 0, "holdout", i) for i in range(3)]
    agreement = sensitivity_agreement(generator_of(scene), volume, samples)
    for values in vars(agreement).values():
        np.testing.assert_allclose(values, expected, rtol=1e-5)


def test_only_smooth_edits_inside_the_window_count(volume, scene, monkeypatch):
    lo, hi = scene.scalar_range
    scene = replace(scene, image_size=32, scalar_window=(lo + (hi - lo) / 4, hi - (hi - lo) / 4))
    bins = np.arange(256)
    outside = (bins < 256 / 4) | (bins > 255 - 256 / 4)

    def disturbed(slopes):
        """With what no smooth edit feels, and nonsense outside the window."""
        jitter = np.where(bins % 2, 0.3, -0.3) * np.abs(slopes[..., ~outside]).max()
        return np.where(outside, 1e6, slopes + jitter)

    monkeypatch.setattr("model.sensitivity.agreement.Sensitivity", own(volume, disturbed))
    samples = [draw_sample(scene, 0, "holdout", i) for i in range(3)]
    agreement = sensitivity_agreement(generator_of(scene), volume, samples)
    assert agreement.image_cosine.min() > 0.99
    assert agreement.block_cosine.min() > 0.98
    assert agreement.single_cosine.max() < 0.9
