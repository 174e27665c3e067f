import hashlib
import json
import pickle
from typing import get_args

import pytest
import safetensors.torch
import torch

from model.errors import CheckpointError
from model.evaluation.study import STUDIES
from model.networks import path_light_network
from model.networks.card import KIND_NAMES, ModelCard, error_text, errors_by_kind, load_card
from model.networks.checkpoint import load_model, save_model
from model.networks.names import PresetName, StudyName
from model.networks.paper import TwoStageGenerator
from model.networks.size import NetworkSize
from model.scene.random_inputs import SHARES
from model.training.options import PRESETS

SIZE = NetworkSize(0.125, 16, 64, 8)


@pytest.fixture
def card(scene):
    return ModelCard(scene, "draft", SIZE, {"seconds": 1.0}, {"holdout": {"rmse": 0.1}}, {})


@pytest.fixture
def network():
    torch.manual_seed(0)
    return TwoStageGenerator(SIZE)


@pytest.fixture
def folder(tmp_path, card, network):
    save_model(tmp_path / "model", card, network)
    return tmp_path / "model"


def weights_file(folder):
    (path,) = folder.glob("*.safetensors")
    return path


def edit(folder, **changes):
    path = folder / "model.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def replace_weights(folder, content):
    weights_file(folder).write_bytes(content)
    edit(folder, sha256=hashlib.sha256(content).hexdigest())


def test_a_model_comes_back_in_half_precision(folder, card, network):
    loaded_card, loaded = load_model(folder)
    assert loaded_card == card == load_card(folder)
    assert not loaded.training
    for name, value in network.state_dict().items():
        back = loaded.state_dict()[name]
        assert back.dtype == value.dtype
        torch.testing.assert_close(back, value, rtol=2**-11, atol=1e-7)
    halves = safetensors.torch.load_file(weights_file(folder))
    assert {v.dtype for v in halves.values()} == {torch.float16, torch.int64}


def test_numbers_too_large_for_half_precision_are_kept(folder, card, network):
    with torch.no_grad():
        network.opacity.encoder[1].bias[0] = 1e6
    save_model(folder, card, network)
    assert load_model(folder)[1].opacity.encoder[1].bias[0] == 1e6


def test_a_folder_without_a_model(tmp_path):
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(CheckpointError, match=r"no model here \(model.json is missing\)"):
            load_model(folder)


SMALLER = {"width": 0.125, "opacity_size": 16, "image_size": 32, "latent_dim": 8}


@pytest.mark.parametrize(("changes", "words"), [
    ({"weights": "../../etc/passwd"}, "are missing"),
    ({"tfscope_model": 99}, "format 99.* train the model anew"), ({"scene": {}}, "malformed"),
    ({"size": {"width": -1}}, "malformed"), ({"training": 5}, "malformed"),
    ({"size": SMALLER}, "draws 32 pixels but the scene has 64"),
])  # fmt: skip
def test_a_description_that_cannot_be_is_refused(folder, changes, words):
    edit(folder, **changes)
    with pytest.raises(CheckpointError, match=words):
        load_model(folder)


class Bomb:
    def __reduce__(self):
        return (pytest.fail, ("a pickle was executed",))


def test_a_pickle_is_refused_and_not_executed(folder):
    replace_weights(folder, pickle.dumps(Bomb()))
    with pytest.raises(CheckpointError, match="not safetensors"):
        load_model(folder)


def test_weights_of_another_network(folder):
    state = safetensors.torch.load_file(weights_file(folder))
    some = dict(list(state.items())[1:])
    replace_weights(folder, safetensors.torch.save(some))
    with pytest.raises(CheckpointError, match="is missing"):
        load_model(folder)
    replace_weights(folder, safetensors.torch.save({**state, "extra": torch.zeros(1)}))
    with pytest.raises(CheckpointError, match="'extra' is unknown"):
        load_model(folder)
    edit(folder, size={"width": 0.125, "opacity_size": 16, "image_size": 64, "latent_dim": 9})
    replace_weights(folder, safetensors.torch.save(state))
    with pytest.raises(CheckpointError, match="another size"):
        load_model(folder)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_weights_that_are_not_finite(folder, value):
    state = safetensors.torch.load_file(weights_file(folder))
    state["opacity.encoder.1.bias"][2] = value
    replace_weights(folder, safetensors.torch.save(state))
    with pytest.raises(CheckpointError, match="NaN or infinite"):
        load_model(folder)


def test_an_unwritable_place_is_said(tmp_path, card, network):
    (tmp_path / "file").write_text("")
    with pytest.raises(CheckpointError, match="cannot be written"):
        save_model(tmp_path / "file" / "model", card, network)


METRICS = {
    "holdout": {"rmse": 0.0823, "emd": 0.0131},
    "holdout_count": 2000,
    "kinds": {
        "modes": {"count": 800, "rmse": 0.06},
        "step": {"count": 160, "rmse": 0.11},
        "empty": {"count": 40, "rmse": 0.0004},
    },
}


def test_every_kind_of_random_tf_has_a_name():
    assert KIND_NAMES.keys() == SHARES.keys()


def test_the_worst_kind_is_named_first():
    assert list(errors_by_kind(METRICS).items()) == [
        ("steps", 0.11), ("mixtures of modes", 0.06), ("empty", 0.0004),
    ]  # fmt: skip
    assert error_text(METRICS) == (
        "RMSE of 2,000 hold-out images 0.082, colour EMD 0.013; "
        "by kind of TF: steps 0.110, mixtures of modes 0.060, empty 0.000."
    )


@pytest.mark.parametrize("metrics", [
    {}, {"holdout": 3, "kinds": []},
    {"holdout": {"rmse": "small"}, "kinds": {"modes": 0.1, "step": {"rmse": None}}},
    {"holdout": {"rmse": float("nan")}, "kinds": {"modes": {"rmse": float("inf")}}},
    {"holdout": {"rmse": True}},
])  # fmt: skip
def test_a_card_without_figures_says_nothing(metrics):
    assert errors_by_kind(metrics) == {}
    assert error_text(metrics) == ""


@pytest.mark.parametrize(("names", "table"), [(PresetName, PRESETS), (StudyName, STUDIES)])
def test_names_are_those_of_the_table(names, table):
    assert get_args(names) == tuple(table)


SMALL = path_light_network.PathLightSize(8)


def seen_inputs(samples=2):
    generator = torch.Generator().manual_seed(1)
    names = path_light_network.COLORS
    colors = {name: torch.rand(2, 3, 32, 48, generator=generator) for name in names}
    opacity = torch.rand(2, 1, 32, 48, generator=generator)
    return path_light_network.network_inputs(colors, opacity, samples)


def lively_light():
    torch.manual_seed(3)
    network = path_light_network.PathLightNetwork(SMALL)
    torch.nn.init.normal_(network.out.weight, std=0.1)
    return network.eval().requires_grad_(False)


def test_untrained_it_returns_the_denoised_picture_and_trained_it_adds_nothing_where_nothing_is():
    seen = seen_inputs()
    denoised = seen[:, 3 * path_light_network.COLORS.index("denoised") :][:, :3]
    torch.testing.assert_close(path_light_network.PathLightNetwork(SMALL)(seen), denoised)
    network = lively_light()
    # It knows how many samples there are.
    assert not torch.allclose(network(seen_inputs(1)), network(seen_inputs(4)))
    seen[:, :13, :, :20] = 0
    assert network(seen)[..., :20].abs().max() == 0


def test_permuted_colours_are_those_of_each_picture():
    seen = seen_inputs()
    other = path_light_network.permuted(seen, torch.tensor([2, 0, 1]))
    for number in range(len(path_light_network.COLORS)):
        colors = seen[:, 3 * number : 3 * number + 3]
        torch.testing.assert_close(other[:, 3 * number], colors[:, 2])
        torch.testing.assert_close(other[:, 3 * number + 1], colors[:, 0])
    torch.testing.assert_close(other[:, 12:], seen[:, 12:])


def test_a_file_holds_network_and_card(tmp_path):
    network, path = lively_light(), tmp_path / "a" / "network.safetensors"
    facts = {"minutes": 3.0}, {"1": {"denoised": {"a": 0.02}}}
    card = path_light_network.PathLightCard(SMALL, *facts)
    path_light_network.save_path_light(path, card, network)
    found, loaded = path_light_network.load_path_light(path)
    assert found == card
    torch.testing.assert_close(loaded(seen_inputs()), network(seen_inputs()), atol=5e-3, rtol=5e-3)


@pytest.mark.parametrize("damage", [
    lambda content: b"", lambda content: content[:-100],
    lambda content: safetensors.torch.save({"a": torch.zeros(3)}),
    lambda content: content.replace(b'\\"width\\": 8', b'\\"width\\": 9'),
])  # fmt: skip
def test_a_file_that_is_no_network_is_reported(tmp_path, damage):
    path, network, card = tmp_path / "a", lively_light(), path_light_network.PathLightCard(SMALL)
    with pytest.raises(CheckpointError, match="network"):
        path_light_network.load_path_light(path)
    path_light_network.save_path_light(path, card, network)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(CheckpointError, match="network"):
        path_light_network.load_path_light(path)
    network.out.weight.fill_(torch.nan)
    path_light_network.save_path_light(path, card, network)
    with pytest.raises(CheckpointError, match="network"):
        path_light_network.load_path_light(path)
