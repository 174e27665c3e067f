"""``light``: networks behind the denoiser, trained and compared on pairs that were made here."""

import numpy as np
import pytest

from app.cli import run
from model.networks.path_light_network import load_path_light
from model.samples.path_light_pairs import FEW, Pairs, write_block


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    """Pairs whose denoised pictures have nine tenths of the light."""
    rng = np.random.default_rng(0)
    exact = (rng.uniform(0.2, 0.8, (4, 3, 1, 1)) * np.ones((4, 3, 32, 32))).astype(np.float16)
    few = np.repeat(np.float16(0.9) * exact[:, None], len(FEW), 1)
    one = np.ones((4, 1, 32, 32), np.float16)
    folder = tmp_path_factory.mktemp("pairs")
    write_block(
        folder / "a-0-0000.npz", Pairs(exact, exact, exact, one, few, few, exact, np.zeros(4))
    )
    return folder


def test_a_network_is_trained_and_written_with_its_errors(pairs, tmp_path):
    out = tmp_path / "network.safetensors"
    train = f"light train {pairs} --held-out {pairs} --out {out} --minutes 0.01 --width 4"
    assert run(train.split()) == 0
    card, _ = load_path_light(out)
    assert (card.size.width, card.training["pairs"]) == (4, 4)
    assert set(card.errors) == {str(samples) for samples in FEW}
