"""Attention over scalar values: it mixes the colour TF's own colours, and nothing else."""

from __future__ import annotations

import pytest
import torch

from model.networks.encoding import EncodedInputs
from model.networks.paper.color_attention import BINS, ColorAttention, color_table
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize

SIZE = NetworkSize(0.125, 32, 64, color_attention=True)


@pytest.fixture
def attention():
    torch.manual_seed(0)
    return ColorAttention(SIZE, 8).double()


def test_a_bin_has_the_mean_colour_of_its_scalar_values():
    colors = torch.rand(2, 3, 256, dtype=torch.float64)
    table = color_table(colors).reshape(2, 3, BINS)
    torch.testing.assert_close(table[1, 2, 5], colors[1, 2, 20:24].mean())


def test_pixels_show_mixtures_of_the_colours_that_are_there(attention):
    x, latent = torch.randn(2, 8, 5, 4).double(), torch.randn(2, 8).double()
    one_color = torch.tensor([0.3, -0.2, 0.9], dtype=torch.float64)
    same = color_table(one_color[None, :, None].expand(2, 3, 256))
    mixed = attention.colors(x, latent, same)
    torch.testing.assert_close(mixed, one_color[None, :, None, None].expand(2, 3, 5, 4))
    many = torch.rand(2, 3, 256, dtype=torch.float64)
    mixed = attention.colors(x, latent, color_table(many))
    assert (mixed >= many.amin(2)[:, :, None, None]).all()
    assert (mixed <= many.amax(2)[:, :, None, None]).all()


def test_a_pixel_that_looks_at_one_value_gets_that_values_colour(attention):
    last = attention.opaque[-1]
    with torch.no_grad():
        last.bias[7] += 1e3
    many = torch.rand(1, 3, 256, dtype=torch.float64)
    table = color_table(many)
    mixed = attention.colors(torch.randn(1, 8, 2, 2).double(), torch.zeros(1, 8).double(), table)
    torch.testing.assert_close(mixed[0, :, 1, 0], many[0, :, 28:32].mean(1))


@pytest.mark.slow
def test_images_follow_each_colour_of_the_tf_as_finite_differences_say():
    torch.manual_seed(1)
    network = TwoStageGenerator(SIZE).double().eval()
    conditions, opacity = torch.randn(1, 5).double(), torch.randn(1, 256).double()
    color = torch.rand(1, 3, 256, dtype=torch.float64, requires_grad=True)
    edit = torch.randn(1, 3, 256, dtype=torch.float64)

    def brightness(tf: torch.Tensor) -> torch.Tensor:
        return network(EncodedInputs(conditions, opacity, tf))[0].mean()

    (slope,) = torch.autograd.grad(brightness(color), color)
    step = 1e-5
    difference = brightness(color + step * edit) - brightness(color - step * edit)
    expected = (difference / (2 * step)).item()
    assert (slope * edit).sum().item() == pytest.approx(expected, rel=1e-4, abs=1e-12)
