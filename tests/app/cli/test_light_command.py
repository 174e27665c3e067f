"""``light``: networks behind the denoiser, trained and compared on pairs that were made here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.cli import run
from model.networks.names import PathLightLoss
from model.networks.path_light_file import load_path_light
from model.samples.path_light_pairs import FEW, Pairs, write_block
from model.training.path_light_losses import PATH_LIGHT_LOSSES


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
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


@pytest.mark.parametrize("loss", PATH_LIGHT_LOSSES)
def test_a_network_is_trained_by_the_loss_that_is_named(
    loss: PathLightLoss, pairs: Path, tmp_path: Path
) -> None:
    out = tmp_path / "network.safetensors"
    train = f"light train {pairs} --out {out} --minutes 0.01 --width 4 --loss {loss}"
    assert run(train.split()) == 0
    assert load_path_light(out)[0].training["loss"] == loss
