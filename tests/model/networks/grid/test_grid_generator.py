"""The generator that samples a feature grid: shapes, derivatives, geometry."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from torch.autograd import forward_ad

from model.networks.build import build_generator
from model.networks.encoding import EncodedInputs
from model.networks.generator_network import GeneratorNetwork
from model.networks.grid.grid_generator import GridGenerator
from model.networks.grid.grid_layers import fold
from model.networks.grid.grid_opacity import GridOpacityGenerator
from model.networks.size import Architecture, NetworkSize
from model.scene.color_space import rgb_to_lab
from model.scene.light import LightDirection
from model.scene.scene import Scene
from model.scene.view import VIEW_ANGLE, View

SIZES = [
    NetworkSize(0.125, 16, 16, architecture="grid"),
    NetworkSize(0.125, 16, 64, latent_dim=3, architecture="grid"),
    NetworkSize(0.25, 32, 32, architecture="grid-translation"),
    NetworkSize(0.125, 16, 32, rays=True, architecture="grid"),
    NetworkSize(0.125, 16, 16, rays=True, architecture="grid-translation"),
]


def inputs(count: int = 2, dtype: torch.dtype = torch.float32) -> EncodedInputs:
    torch.manual_seed(5)
    view = 2 * torch.rand(count, 5) - 1
    view[:, 1:3] /= view[:, 1:3].norm(dim=1, keepdim=True)
    found = EncodedInputs(view, 2 * torch.rand(count, 256) - 1, torch.rand(count, 3, 256))
    return found.map(lambda x: x.to(dtype))


def encode_colors(rgb: NDArray[np.float32]) -> torch.Tensor:
    return torch.from_numpy(rgb_to_lab(rgb).transpose(0, 2, 1).copy())


def build(size: NetworkSize, scene: Scene) -> GeneratorNetwork:
    torch.manual_seed(0)
    return build_generator(size, scene)


@pytest.mark.parametrize("size", SIZES)
def test_images_have_their_sizes_and_lie_in_range(size: NetworkSize, scene: Scene) -> None:
    image, opacity_image = build(size, scene)(inputs())
    assert image.shape == (2, 3, size.image_size, size.image_size)
    assert opacity_image.shape == (2, 1, size.opacity_size, size.opacity_size)
    for values in (image, opacity_image):
        assert values.abs().max() <= 1
        assert values.std() > 1e-3


@pytest.mark.parametrize("rays", [False, True])
@pytest.mark.parametrize("architecture", get_args(Architecture))
def test_each_architecture_trains_all_its_weights(
    architecture: Architecture, rays: bool, scene: Scene
) -> None:
    size = NetworkSize(0.125, 16, 32, rays=rays, modulation=True, architecture=architecture)
    network = build(size, scene)
    view, opacity_tf, color_tf = inputs(4)
    latent = network.opacity.encode(opacity_tf)
    image, opacity_image = network.render_latent(view, latent, color_tf)
    decoded = network.opacity.decode(latent)
    sum(x.square().sum() for x in (image, opacity_image, decoded)).backward()  # type: ignore[union-attr]
    without = [
        name
        for name, p in network.named_parameters()
        if p.grad is None or not p.grad.abs().max() > 0
    ]
    assert not without


@pytest.mark.parametrize("size", [SIZES[0], SIZES[3]])
def test_derivatives_by_the_latent_code_go_forwards_and_are_true(
    size: NetworkSize, scene: Scene
) -> None:
    """Forward mode, as the sensitivity takes it, against central differences in float64."""
    network = build(size, scene).double().eval().requires_grad_(False)
    view, opacity_tf, color_tf = inputs(1, torch.float64)
    latent = network.opacity.encode(opacity_tf)
    direction = torch.randn_like(latent)

    def image(latent: torch.Tensor) -> torch.Tensor:
        return network.render_latent(view, latent, color_tf)[0]

    with forward_ad.dual_level():
        dual = image(forward_ad.make_dual(latent, direction))  # type: ignore[no-untyped-call]
        slope = forward_ad.unpack_dual(dual).tangent  # type: ignore[no-untyped-call]
    h = 1e-6
    expected = (image(latent + h * direction) - image(latent - h * direction)) / (2 * h)
    assert expected.abs().max() > 1e-4
    torch.testing.assert_close(slope, expected, rtol=1e-4, atol=1e-8)


def test_colours_are_not_rounded_where_the_rest_is(scene: Scene) -> None:
    network = build(SIZES[0], scene)
    colors = encode_colors(np.random.default_rng(0).random((4, 256, 3), dtype=np.float32))
    expected = network.encode_color(colors)
    with torch.autocast("cpu", torch.bfloat16):
        torch.testing.assert_close(network.encode_color(colors), expected, rtol=0, atol=0)


@pytest.mark.parametrize("size", [SIZES[0], SIZES[3]])
def test_float32_on_the_cpu_agrees_with_float64_through_torch(
    size: NetworkSize, scene: Scene
) -> None:
    network = build(size, scene).eval().requires_grad_(False)
    expected, _ = network(inputs())
    found, _ = network.double()(inputs(dtype=torch.float64))
    torch.testing.assert_close(found.float(), expected, atol=1e-3, rtol=0)


@pytest.mark.parametrize("view", [View(), View(40, 30, 5, 0.8), View(200, -60, -8, 0.6)])
def test_what_the_grid_holds_at_a_place_is_seen_at_its_pixel(scene: Scene, view: View) -> None:
    """Each node holds its own place: what a pixel sees must project onto that pixel."""
    scene = replace(scene, proportions=(0.5, 0.5, 0.7))
    network = GridOpacityGenerator(NetworkSize(0.125, 32, 32, architecture="grid"), scene)
    grid = network.grid
    axes = [torch.linspace(-e, e, n) for e, n in zip(grid.extent, grid.shape, strict=True)]
    z, y, x = torch.meshgrid(*axes[::-1], indexing="ij")
    with torch.no_grad():
        grid.features.zero_()
        grid.features[:, :4] = torch.stack([x, y, z, torch.ones_like(x)], dim=-1).reshape(-1, 4)
        encoded = torch.from_numpy(view.vector(scene.view_range))[None]
        (samples,) = network.encode_view(encoded)
    seen = samples.reshape(16, 16, 16, -1).double()
    inside = seen[..., 3] > 0.999
    assert inside.sum() > 100
    right, up, back = (torch.from_numpy(axis) for axis in view.basis())
    places = seen[inside][:, :3]
    half = (view.camera_distance(1.0) - places @ back) * math.tan(math.radians(VIEW_ANGLE / 2))
    _, row, column = inside.nonzero().T
    torch.testing.assert_close(
        (places @ right / half + 1) * 8 - 0.5, column.double(), atol=1e-3, rtol=0
    )
    torch.testing.assert_close((1 - places @ up / half) * 8 - 0.5, row.double(), atol=1e-3, rtol=0)


def test_folding_keeps_each_plane_at_its_pixels() -> None:
    scene = Scene("a", "b", (0.0, 1.0), (0.2, 0.8), 64)
    frustum = GridOpacityGenerator(NetworkSize(0.125, 16, 16), scene).frustum
    seen = torch.arange(2 * 16 * 8 * 8 * 3.0).reshape(2, 16 * 8 * 8, 3)
    folded = fold(seen, frustum)
    assert folded.shape == (2, 48, 8, 8)
    assert folded[1, 5 * 3 + 2, 6, 7] == seen[1, (5 * 8 + 6) * 8 + 7, 2]


def test_in_evaluation_a_sample_does_not_depend_on_its_batch(scene: Scene) -> None:
    network = build(SIZES[0], scene).eval()
    assert isinstance(network, GridGenerator)
    together = network(inputs(3))[0]
    alone = network(inputs(3).map(lambda x: x[1:2]))[0]
    torch.testing.assert_close(together[1:2], alone, atol=1e-5, rtol=0)


def test_one_colour_for_all_scalar_values_is_the_images_only_colour(scene: Scene) -> None:
    """Whatever the weights: hue and saturation of an unlit image are the colour TF's."""
    network = build(NetworkSize(0.125, 16, 32, architecture="grid"), scene).eval()
    view, opacity_tf, _ = inputs(3)
    rgb = np.array([0.9, 0.5, 0.2], np.float32)
    color_tf = encode_colors(np.broadcast_to(rgb, (3, 256, 3)))
    with torch.no_grad():
        image = (network(EncodedInputs(view, opacity_tf, color_tf))[0] + 1) / 2
    visible = image / torch.from_numpy(rgb)[:, None, None]
    assert visible.min() > 0
    torch.testing.assert_close(visible.amax(dim=1), visible.amin(dim=1), atol=1e-3, rtol=0)


def test_only_lit_images_have_highlights(scene: Scene) -> None:
    view, opacity_tf, _ = inputs(1)
    black = encode_colors(np.zeros((1, 256, 3), np.float32))
    size = NetworkSize(0.125, 16, 32, architecture="grid")
    lit = replace(scene, lighting="direct", light=LightDirection())
    for of, highlights in ((scene, False), (lit, True)):
        with torch.no_grad():
            image = (build(size, of).eval()(EncodedInputs(view, opacity_tf, black))[0] + 1) / 2
        assert (image.max() > 1e-4) == highlights


def test_unlit_images_are_linear_in_the_colours(scene: Scene) -> None:
    network = build(NetworkSize(0.125, 16, 32, architecture="grid"), scene).eval()
    view, opacity_tf, _ = inputs(1)
    random = np.random.default_rng(0)
    one, other = random.random((2, 1, 256, 3), dtype=np.float32)

    def image(rgb: NDArray[np.float32]) -> torch.Tensor:
        with torch.no_grad():
            return network(EncodedInputs(view, opacity_tf, encode_colors(rgb)))[0] + 1

    torch.testing.assert_close(
        image((one + other) / 2), (image(one) + image(other)) / 2, atol=1e-3, rtol=0
    )
