"""``light``: networks behind the denoiser, trained and compared on pairs that were made here."""

from __future__ import annotations

import json
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


def test_a_study_has_a_row_for_each_loss_and_for_what_could_be_shown_instead(
    pairs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = f"light study {pairs} --held-out {pairs} --out {tmp_path} --steps 3 --width 4"
    assert run(study.split()) == 0
    rows = json.loads((tmp_path / "study.json").read_text())["rmse"]
    trained = [f"finished, trained by {loss}" for loss in PATH_LIGHT_LOSSES]
    others = ["nearest training picture", "unlit", "direct light", "soft light", "as traced"]
    assert list(rows) == [*others, "denoised", *trained]
    for loss in PATH_LIGHT_LOSSES:
        card, _ = load_path_light(tmp_path / f"{loss}.safetensors")
        assert (card.training["loss"], card.training["steps"]) == (loss, 3)
    # What was trained is not trained again, and nothing of another budget is compared.
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.safetensors")}
    assert run(study.split()) == 0
    assert kept == {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.safetensors")}
    capsys.readouterr()
    assert run(study.replace("--steps 3", "--steps 5").split()) != 0
    assert "another folder" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("loss", PATH_LIGHT_LOSSES)
def test_a_network_is_trained_by_the_loss_that_is_named(
    loss: PathLightLoss, pairs: Path, tmp_path: Path
) -> None:
    out = tmp_path / "network.safetensors"
    train = f"light train {pairs} --out {out} --minutes 0.01 --width 4 --loss {loss}"
    assert run(train.split()) == 0
    assert load_path_light(out)[0].training["loss"] == loss
    evaluate = f"light evaluate {pairs} --network {out} --json {tmp_path}/errors.json"
    assert run(evaluate.split()) == 0
    rows = json.loads((tmp_path / "errors.json").read_text())["rmse"]
    assert len(rows["finished"]) == len(FEW)
