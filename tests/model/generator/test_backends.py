from unittest.mock import Mock

import pytest
import torch
from lively import lively_network

from model.errors import TfscopeError
from model.generator.backends import EAGER, TOGETHER, Backend, candidates, make_decode, obstacle
from model.generator.generator import Generator
from model.networks.blocks import place
from model.networks.generator_network import EncodedInputs

CPU = torch.device("cpu")


@pytest.fixture
def network():
    return place(lively_network(), CPU).eval()


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


def test_openvino_draws_what_torch_draws(network):
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


def test_a_library_that_is_not_installed_is_named(network, monkeypatch):
    monkeypatch.setattr("model.errors.find_spec", lambda name: None)
    with pytest.raises(TfscopeError, match=r"pip install openvino"):
        make_decode(network, Backend("openvino"), CPU)
    assert candidates(CPU) == [EAGER]


def test_where_the_fastest_fails_torch_draws(lively_folder, monkeypatch, caplog):
    usable(Backend("openvino"))
    broken = Mock(side_effect=RuntimeError("made up"))
    monkeypatch.setattr("model.generator.backends._openvino", broken)
    monkeypatch.setattr("model.generator.generator.kept", lambda name, about: "openvino")
    generator = Generator.load(lively_folder, "cpu", fastest=True)
    assert generator.backend == EAGER
    assert "openvino cannot" in caplog.text


def test_the_fastest_backend_is_measured_once(lively_folder, monkeypatch, tmp_path_factory):
    usable(Backend("openvino"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path_factory.mktemp("cache")))
    timed = []

    def seconds(generator):
        timed.append(generator.backend)
        return {"eager": 1.0, "openvino": 2.0}[generator.backend.name]

    monkeypatch.setattr(Generator, "_time_drawing", seconds)
    for _ in range(2):
        assert Generator.load(lively_folder, "cpu", fastest=True).backend == EAGER
        assert timed == candidates(CPU)
