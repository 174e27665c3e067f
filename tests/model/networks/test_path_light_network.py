import pytest
import safetensors.torch
import torch

from model.errors import CheckpointError
from model.networks.path_light_network import (
    COLORS,
    PathLightCard,
    PathLightNetwork,
    PathLightSize,
    load_path_light,
    network_inputs,
    permuted,
    save_path_light,
)

SMALL = PathLightSize(8)


def inputs(samples=2):
    generator = torch.Generator().manual_seed(1)
    colors = {name: torch.rand(2, 3, 32, 48, generator=generator) for name in COLORS}
    return network_inputs(colors, torch.rand(2, 1, 32, 48, generator=generator), samples)


def lively():
    torch.manual_seed(3)
    network = PathLightNetwork(SMALL)
    torch.nn.init.normal_(network.out.weight, std=0.1)
    return network.eval().requires_grad_(False)


def test_untrained_it_returns_the_denoised_picture_and_trained_it_adds_nothing_where_nothing_is():
    seen = inputs()
    denoised = seen[:, 3 * COLORS.index("denoised") :][:, :3]
    torch.testing.assert_close(PathLightNetwork(SMALL)(seen), denoised)
    network = lively()
    # It knows how many samples there are.
    assert not torch.allclose(network(inputs(1)), network(inputs(4)))
    seen[:, :13, :, :20] = 0
    assert network(seen)[..., :20].abs().max() == 0


def test_permuted_colours_are_those_of_each_picture():
    seen = inputs()
    other = permuted(seen, torch.tensor([2, 0, 1]))
    for number in range(len(COLORS)):
        colors = seen[:, 3 * number : 3 * number + 3]
        torch.testing.assert_close(other[:, 3 * number], colors[:, 2])
        torch.testing.assert_close(other[:, 3 * number + 1], colors[:, 0])
    torch.testing.assert_close(other[:, 12:], seen[:, 12:])


def test_a_file_holds_network_and_card(tmp_path):
    network, path = lively(), tmp_path / "a" / "network.safetensors"
    card = PathLightCard(SMALL, {"minutes": 3.0}, {"1": {"denoised": {"a": 0.02}}})
    save_path_light(path, card, network)
    found, loaded = load_path_light(path)
    assert found == card
    torch.testing.assert_close(loaded(inputs()), network(inputs()), atol=5e-3, rtol=5e-3)


@pytest.mark.parametrize("damage", ["missing", "empty", "cut", "foreign", "wider", "nan"])
def test_a_file_that_is_no_network_is_told(tmp_path, damage):
    path = tmp_path / "network.safetensors"
    network = lively()
    if damage == "nan":
        network.out.weight.fill_(torch.nan)
    save_path_light(path, PathLightCard(SMALL), network)
    if damage == "missing":
        path.unlink()
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    elif damage == "foreign":
        path.write_bytes(safetensors.torch.save({"a": torch.zeros(3)}))
    elif damage == "wider":
        path.write_bytes(path.read_bytes().replace(b'\\"width\\": 8', b'\\"width\\": 9'))
    with pytest.raises(CheckpointError, match="network"):
        load_path_light(path)
