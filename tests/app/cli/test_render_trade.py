"""``render --budget-ms`` and ``--error``: the setting is chosen, and said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.cli import run
from model import metrics

BASE = "render --volume {volume} --tf {tf} --size 96"


def _render(base: str, options: str, out: Path) -> int:
    return run([*base.split(), *options.split(), "--out", str(out)])


def _said(path: Path) -> str:
    with Image.open(path) as picture:
        return str(picture.info["Renderer"])


def test_a_picture_keeps_to_the_error_that_was_asked_for(
    raw_file: Path, tf_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = BASE.format(volume=raw_file, tf=tf_file)
    images = {}
    for error in ("0.0001", "0.005", "0.05"):
        assert _render(base, f"--error {error}", tmp_path / f"{error}.npy") == 0
        images[error] = np.load(tmp_path / f"{error}.npy")[..., :3]
        assert "ray caster" in capsys.readouterr().out
    exact = images["0.0001"]
    assert 0 < metrics.rmse(images["0.005"], exact) < 0.0075
    assert metrics.rmse(images["0.005"], exact) < metrics.rmse(images["0.05"], exact) < 0.075


def test_the_file_says_what_drew_it_and_how_wrong_it_is(
    raw_file: Path, tf_file: Path, tmp_path: Path
) -> None:
    base = BASE.format(volume=raw_file, tf=tf_file)
    assert _render(base, "--budget-ms 60000 --lighting direct", tmp_path / "slow.png") == 0
    assert _said(tmp_path / "slow.png").endswith("exact")
    assert _render(base, "--error 0.2", tmp_path / "fast.png") == 0
    assert ", error ~." in _said(tmp_path / "fast.png")


def test_path_traced_light_takes_as_many_samples_as_there_is_time_for(
    raw_file: Path, tf_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = BASE.format(volume=raw_file, tf=tf_file) + " --lighting path"
    assert _render(base, "--budget-ms 0.1", tmp_path / "one.npy") == 0
    assert "1 sample a pixel" in capsys.readouterr().out
    assert _render(base, "--budget-ms 600000 --samples 4", tmp_path / "four.npy") == 0
    assert "4 samples a pixel" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--budget-ms 0.1", "is too little for this picture"),
        ("--error 0.0001 --budget-ms 0.1", "allow that, or a larger error"),
        ("--error 0.01 --sample-distance 1", "leave --sample-distance"),
        ("--error 0.01 --preintegrated", "leave --sample-distance"),
        ("--error 0.01 --renderer generator", "--renderer raycast"),
    ],
)
def test_what_cannot_be_is_said(
    raw_file: Path,
    tf_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    options: str,
    said: str,
) -> None:
    out = tmp_path / "x.png"
    assert _render(BASE.format(volume=raw_file, tf=tf_file), options, out) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not out.exists()
