import pytest
import torch
from lively import lively_network
from torch import nn

from model.errors import TfscopeError
from model.networks import paper
from model.networks.blocks import ResidualBlock, parameter_count
from model.networks.generator_network import EncodedInputs
from model.networks.size import NetworkSize


@pytest.mark.parametrize(("network", "count"), [
    (paper.OpacityGenerator, 11_597_640), (paper.OpacityDiscriminator, 9_534_209),
    (paper.TranslationGenerator, 14_759_827), (paper.TranslationDiscriminator, 12_963_969),
])  # fmt: skip
def test_full_width_has_the_published_number_of_parameters(network, count):
    with torch.device("meta"):
        assert parameter_count(network(NetworkSize())) == count


SIZES = [
    NetworkSize(0.125, 64, 64),
    NetworkSize(0.125, 32, 32, latent_dim=3),
    NetworkSize(0.125, 32, 128, modulation=True),
]


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_shapes_follow_from_the_size(size):
    inputs = EncodedInputs(torch.randn(2, 5), torch.randn(2, 256), torch.randn(2, 3, 256))
    network = paper.TwoStageGenerator(size)
    image, opacity = network(inputs)
    assert image.shape == (2, 3, size.image_size, size.image_size)
    assert opacity.shape == (2, 1, size.opacity_size, size.opacity_size)
    assert image.abs().max() <= 1 and opacity.abs().max() <= 1
    latent = network.opacity.encode(inputs.opacity_tf)
    assert latent.shape == (2, size.latent_dim)
    assert network.opacity.decode(latent).shape == (2, 256)
    assert paper.OpacityDiscriminator(size)(inputs, opacity).shape == (2, 1)
    assert paper.TranslationDiscriminator(size)(inputs, image).shape == (2, 1)


@pytest.mark.parametrize(
    "bad",
    [
        {"opacity_size": 48}, {"image_size": 8}, {"opacity_size": 128, "image_size": 64},
        {"width": 0.0}, {"latent_dim": 0},
    ],
)  # fmt: skip
def test_impossible_sizes_are_refused(bad):
    with pytest.raises(TfscopeError):
        NetworkSize(**bad)


@pytest.mark.parametrize("kernel", [1, 3])
@pytest.mark.parametrize("channels", [(6, 6), (6, 4)])
def test_a_doubling_block_is_the_block_of_the_doubled_image(kernel, channels):
    """Values, statistics and gradients, against torch's own doubling and convolution."""
    torch.manual_seed(0)
    fused = ResidualBlock(*channels, kernel, doubles=True).double()
    plain = ResidualBlock(*channels, kernel).double()
    plain.load_state_dict(fused.state_dict())
    x = torch.randn(3, 6, 5, 4, dtype=torch.float64)
    given = [x.clone().requires_grad_(), x.clone().requires_grad_()]
    images = [fused(given[0]), plain(nn.Upsample(scale_factor=2)(given[1]))]
    torch.testing.assert_close(*images)
    weights = torch.randn_like(images[0])
    for image in images:
        (image * weights).sum().backward()
    torch.testing.assert_close(given[0].grad, given[1].grad)
    for one, other in zip(fused.parameters(), plain.parameters(), strict=True):
        torch.testing.assert_close(one.grad, other.grad)
    for name, value in fused.named_buffers():
        # The unbiased variance of four times as many pixels differs by their number alone.
        torch.testing.assert_close(value, plain.get_buffer(name), rtol=0.02, atol=1e-9)


def test_the_image_has_the_whole_gradient_to_the_opacity_tf():
    """Against central differences in float64."""
    network = lively_network().double().eval().requires_grad_(False)
    torch.manual_seed(2)
    view = torch.rand(1, 5).double()
    color = torch.rand(1, 3, 256).double()
    tf = torch.rand(1, 256).double().requires_grad_()
    weights = torch.rand(1, 3, 64, 64).double()

    def loss(tf):
        return (network(EncodedInputs(view, tf, color))[0] * weights).sum()

    (gradient,) = torch.autograd.grad(loss(tf), tf)
    h = 1e-6
    for index in (0, 17, 128, 200, 255):
        step = torch.zeros_like(tf)
        step[0, index] = h
        with torch.no_grad():
            expected = (loss(tf + step) - loss(tf - step)) / (2 * h)
        assert gradient[0, index].item() == pytest.approx(expected.item(), rel=1e-4, abs=1e-9)
