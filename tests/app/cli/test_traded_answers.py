"""``sensitivity`` and ``latent`` with ``--budget-ms`` and ``--error``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.cli import run
from model.sensitivity.cosine import cosine

MODEL = Path(__file__).parents[3] / "resources/models/reacting_jet_paper"


def _said(capsys: pytest.CaptureFixture[str]) -> str:
    captured = capsys.readouterr()
    return " ".join((captured.out + captured.err).split())


@pytest.mark.parametrize("question", ["", "--region 40,40,90,80", "--value 120"])
def test_a_sensitivity_is_of_as_many_pixels_as_its_error_takes(
    raw_file: Path,
    tf_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    question: str,
) -> None:
    base = f"sensitivity --volume {raw_file} --tf {tf_file} --size 128 {question}"
    for options, name in (("", "all"), ("--error 0.05", "few"), ("--error 0.000001", "most")):
        assert run(f"{base} {options} --out {tmp_path / name}.npz".split()) == 0
    said = _said(capsys)
    assert "cosine to half as many columns" in said
    assert "of an image of 128 x 128 pixels" in said
    whole, few, most = (np.load(tmp_path / f"{name}.npz") for name in ("all", "few", "most"))
    np.testing.assert_array_equal(most["sensitivity"], whole["sensitivity"])
    assert few["image"].shape[0] < 128
    if whole["sensitivity"].ndim == 1:
        assert cosine(few["sensitivity"], whole["sensitivity"]) > 0.95


def test_a_time_that_allows_all_pixels_has_all(
    raw_file: Path, tf_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = f"sensitivity --volume {raw_file} --tf {tf_file} --size 64 --lighting direct"
    assert run(f"{base} --budget-ms 600000 --out {tmp_path}/all.png".split()) == 0
    assert "of an image of 64 x 64 pixels" in _said(capsys)
    assert run(f"{base} --budget-ms 0.1 --out {tmp_path}/few.png".split()) == 0
    assert "of an image of 32 x 32 pixels" in _said(capsys)


@pytest.mark.slow
def test_pictures_of_the_map_are_drawn_at_a_setting_that_is_said(
    raw_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = f"latent --volume {raw_file} --grid=-.5,-.5,.5,.5 --size 64 --out {tmp_path}"
    assert run(f"{base}/exact.npz --error 0.0001".split()) == 0
    assert run(f"{base}/fast.npz --error 0.1".split()) == 0
    said = _said(capsys)
    assert "pictures by the ray caster, " in said
    assert ", error ~" in said
    exact, fast = (np.load(tmp_path / f"{name}.npz")["images"] for name in ("exact", "fast"))
    assert 0 < np.sqrt(np.nanmean((fast - exact)[..., :3] ** 2)) < 0.15


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("sensitivity --block 8 --error 0.1 --out x.png", "ask for a region or a value"),
        ("sensitivity --engine learned --budget-ms 5 --out x.png", "--engine exact"),
        ("latent --model {model} --error 0.1 --out x.npz", "leave --budget-ms and --error"),
    ],
)
def test_what_has_no_choice_says_so(
    capsys: pytest.CaptureFixture[str], command: str, said: str
) -> None:
    assert run(command.format(model=MODEL).split()) == 2
    assert said in _said(capsys)
