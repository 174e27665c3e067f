"""The scale of the scalar axis on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from app.cli import run
from model.samples.sample_store import SampleStore
from model.scene.default_tf import default_transfer_function
from model.scene.robust_range import robust_range
from model.scene.volume import Volume


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A log-normal volume and its logarithm, and a TF over the latter as one of the former."""
    path: Path = tmp_path_factory.mktemp("scales")
    values = np.exp(3 * np.random.default_rng(6).normal(size=(14, 15, 16))).astype(np.float32)
    logarithms = np.log10(values.astype(np.float64)).astype(np.float32)
    np.save(path / "halo.npy", values)
    np.save(path / "logarithms.npy", logarithms)
    volume = Volume(values).on_scale("log")
    default_transfer_function(volume.over(robust_range(volume))).save(path / "log.json")
    return path


def rendered(folder: Path, name: str, options: str = "") -> np.ndarray:
    base = f"render --renderer raycast --size 24 --volume {folder / name}.npy"
    assert run(f"{base} {options} --out {folder / 'image.npy'}".split()) == 0
    return np.load(folder / "image.npy")


def test_the_image_is_that_of_the_logarithms(folder):
    expected = rendered(folder, "logarithms")
    assert expected[..., 3].max() > 0.1
    found = rendered(folder, "halo", "--scale log")
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert np.abs(rendered(folder, "halo") - expected).max() > 0.1
    # A TF that was saved on the scale brings it.
    by_tf = rendered(folder, "halo", f"--tf {folder / 'log.json'}")
    np.testing.assert_allclose(by_tf, found, atol=1e-6)


def test_info_offers_it_and_tells_values(folder, capsys):
    assert run(f"info --json {folder}/halo.npy".split()) == 0
    told = json.loads(capsys.readouterr().out)
    values = np.load(folder / "halo.npy")
    assert told["suits_logarithm"] is True
    assert told["range"] == [float(values.min()), float(values.max())]
    assert run(f"info {folder}/halo.npy".split()) == 0
    assert "--scale log" in " ".join(capsys.readouterr().out.split())
    assert run(f"info --json {folder}/logarithms.npy".split()) == 0
    assert json.loads(capsys.readouterr().out)["suits_logarithm"] is False


def test_sensitivities_are_told_over_values(folder):
    out = folder / "found.npz"
    base = f"sensitivity --volume {folder}/halo.npy --scale log --size 16 --out {out}"
    assert run(f"{base} --range 0.01,1000".split()) == 0
    with np.load(out) as found:
        np.testing.assert_allclose(found["scalar_values"], np.geomspace(0.01, 1000, 256))


def test_samples_lie_on_the_scale(folder):
    base = f"dataset --volume {folder}/halo.npy --size 16 --count 1 --holdout 1 --workers 1"
    options = "--scale log --range 0.01,1000 --window 0.1,100"
    assert run(f"{base} {options} --out {folder}/store".split()) == 0
    scene = SampleStore(folder / "store").scene
    assert scene.scale == "log"
    assert scene.scalar_range == pytest.approx((-2, 3))
    assert scene.scalar_window == pytest.approx((-1, 2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("render --out x.png --volume halo.npy --scale log --range 0,5", "above zero"),
        ("render --out x.png --volume halo.npy --scale linear --tf log.json", "the logarithm"),
        ("render --out x.png --volume negative.npy --scale log", "no value is above zero"),
        ("render --out x.png --renderer generator --scale log", "leave --range and --scale out"),
        ("train --out x --dataset . --scale log", "the scale would have no effect"),
        ("sensitivity --out x.npz --volume halo.npy --scale log --value -1", "outside the volume"),
    ],
)
def test_scales_that_make_no_sense(arguments, message, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    np.save("negative.npy", -np.arange(1, 65, dtype=np.float32).reshape(4, 4, 4))
    assert run(arguments.split()) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert message in line
