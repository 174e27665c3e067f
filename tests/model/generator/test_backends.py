import pytest
import torch
from blobs import blobs

from model.errors import TfscopeError
from model.generator.backends import EAGER, TOGETHER, Backend, candidates, make_decode, obstacle
from model.generator.generator import Generator
from model.networks.blocks import place
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.networks.generator_network import EncodedInputs
from model.networks.paper import build_generator
from model.networks.size import NetworkSize
from model.scene.scene import Scene

CPU = torch.device("cpu")


SIZE = NetworkSize(0.125, 16, 64)


def network_of(scene):
    torch.manual_seed(0)
    network = build_generator(SIZE, scene)
    for parameter in network.parameters():
        # Images far from one grey: as first weights, the paper's are too small for that.
        if parameter.ndim > 1:
            torch.nn.init.kaiming_normal_(parameter, nonlinearity="linear")
    return place(network, CPU).eval()


@pytest.fixture(scope="module")
def scene():
    return Scene.of(blobs(), 64)


@torch.inference_mode()
def inputs_of(network, count):
    torch.manual_seed(count)
    view, color = torch.rand(count, 5) * 2 - 1, torch.rand(count, 3, 256) * 2 - 1
    # Faint enough to look inside.
    return network.features(EncodedInputs(view, torch.rand(count, 256) * 0.2 - 1, color))


def usable(backend):
    trouble = obstacle(backend, CPU)
    if trouble is not None:
        pytest.skip(trouble)
    return backend


def test_openvino_draws_what_torch_draws(scene):
    network = network_of(scene)
    decode = make_decode(network, usable(Backend("openvino")), CPU)
    built = []
    make = decode._make
    decode._make = lambda *rows: built.append(len(rows[0])) or make(*rows)
    with torch.inference_mode():
        # One, fewer than go together, and more of which the last call has one, or three.
        for count in (1, 3, 1, TOGETHER + 1, 2 * TOGETHER + 3):
            inputs = inputs_of(network, count)
            for ours, expected in zip(decode(*inputs), network.decode(*inputs), strict=True):
                assert expected.std() > 0.003
                torch.testing.assert_close(ours, expected, rtol=0, atol=1e-4)
    assert built == [1, TOGETHER]


def test_bfloat16_is_a_candidate_where_the_processor_knows_it(monkeypatch):
    monkeypatch.setattr("model.generator.backends._knows_bfloat16", lambda: True)
    monkeypatch.setattr("model.errors.find_spec", lambda name: name == "openvino" or None)
    exact, rounded = Backend("openvino"), Backend("openvino", "bfloat16")
    assert candidates(CPU) == [rounded, exact, EAGER]
    monkeypatch.setattr("model.generator.backends._knows_bfloat16", lambda: False)
    assert candidates(CPU) == [exact, EAGER]
    assert "no bfloat16" in str(obstacle(rounded, CPU))
    assert (exact.text, rounded.text) == ("openvino", "openvino bfloat16")


def test_a_library_that_is_not_installed_is_named(scene, monkeypatch):
    monkeypatch.setattr("model.errors.find_spec", lambda name: None)
    with pytest.raises(TfscopeError, match=r"pip install openvino"):
        make_decode(network_of(scene), Backend("openvino"), CPU)
    assert candidates(CPU) == [EAGER]


@pytest.fixture
def folder(scene, tmp_path):
    network = network_of(scene)
    card = ModelCard(scene=scene, preset="tiny", size=SIZE, training={}, metrics={}, versions={})
    save_model(tmp_path, card, network)
    return tmp_path


def test_where_the_fastest_fails_torch_draws(folder, monkeypatch, caplog):
    usable(Backend("openvino"))

    def broken(*arguments):
        raise RuntimeError("made up")

    monkeypatch.setattr("model.generator.backends._openvino", broken)
    monkeypatch.setattr("model.generator.generator.kept", lambda name, about: "openvino")
    generator = Generator.load(folder, "cpu", fastest=True)
    assert generator.backend == EAGER
    assert "openvino cannot" in caplog.text


def test_the_fastest_backend_is_measured_once(folder, monkeypatch, tmp_path_factory):
    usable(Backend("openvino"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path_factory.mktemp("cache")))
    timed = []

    def seconds(generator):
        timed.append(generator.backend)
        return {"eager": 1.0, "openvino": 2.0}[generator.backend.name]

    monkeypatch.setattr(Generator, "_time_drawing", seconds)
    assert Generator.load(folder, "cpu", fastest=True).backend == EAGER
    assert timed == candidates(CPU)
    assert Generator.load(folder, "cpu", fastest=True).backend == EAGER
    assert timed == candidates(CPU)
