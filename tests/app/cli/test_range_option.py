"""The scalar range on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.cli import run
from model.scene.range_fitting import opacity_over
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction

RANGE = (0.0, 250.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A ball of values to 250 as it is, and with one voxel of 60,000; and a TF over the ball's."""
    path: Path = tmp_path_factory.mktemp("ranges")
    z, y, x = np.mgrid[0:16, 0:18, 0:20]
    distance = np.sqrt((x - 9) ** 2 + (y - 8) ** 2 + (z - 9) ** 2)
    ball = np.clip(325 - 25 * distance, 0, 250).astype(np.float32)
    ball.tofile(path / "ball_20x18x16_float32.raw")
    # In the middle of the largest values, and no larger than these once it is clamped.
    assert ball[9, 8, 9] == 250
    ball[9, 8, 9] = 60_000
    ball.tofile(path / "outlier_20x18x16_float32.raw")
    color = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (250.0, 1.0, 0.3, 0.2)))
    TransferFunction(OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.2),)), color).save(
        path / "tf.json"
    )
    return path


def rendered(folder: Path, volume: str, options: str) -> np.ndarray:
    out = folder / "image.npy"
    base = f"render --renderer raycast --size 24 --volume {folder}/{volume}_20x18x16_float32.raw"
    assert run(f"{base} {options} --out {out}".split()) == 0
    return np.load(out)


@pytest.mark.slow
def test_an_outlier_does_not_matter_over_a_range(folder):
    expected = rendered(folder, "ball", "")
    assert expected[..., 3].max() > 0.1
    for options in ("", "--range 0,250", "--range 0%,99.9%"):
        np.testing.assert_array_equal(rendered(folder, "outlier", options), expected)
    whole = rendered(folder, "outlier", "--range 0,60000")
    assert np.abs(whole - expected).max() > 0.1


def test_a_tf_brings_its_range(folder):
    tf = f"--tf {folder / 'tf.json'}"
    expected = rendered(folder, "ball", tf)
    np.testing.assert_array_equal(rendered(folder, "outlier", tf), expected)
    narrow = rendered(folder, "ball", f"{tf} --range 100,250")
    # The mode at 120 stays where it is, and what is below 100 looks as 100 does.
    assert narrow[..., 3].mean() > expected[..., 3].mean()


def test_what_is_too_narrow_for_the_range_is_said_with_the_option(folder, capsys):
    whole = (0.0, 60_000.0)
    color = ColorTF(whole, ((0.0, 0.1, 0.2, 0.9), (60_000.0, 1.0, 0.3, 0.2)))
    for name, opacity in (
        ("mode", OpacityTF(whole, (GaussianMode(120.0, 20.0, 0.2),))),
        ("band", OpacityTF(whole, points=((0, 0), (90, 0), (120, 0.2), (150, 0), (60_000, 0)))),
    ):
        TransferFunction(opacity, color).save(folder / f"{name}.json")
        tf = f"--tf {folder / name}.json"
        wide = rendered(folder, "outlier", tf)
        said = capsys.readouterr().err
        assert "narrower than 256 steps over 0 to 60,000" in said
        option = said.splitlines()[0].partition("; give ")[2].strip().rstrip(".")
        assert option.startswith("--range ")
        shown = rendered(folder, "outlier", f"{tf} {option}")
        assert "narrower" not in capsys.readouterr().err
        assert np.abs(shown - wide).max() > 0.05
        # With the colours of the wide TF, and its opacities.
        low, high = (float(n) for n in option.removeprefix("--range ").split(","))
        exact = opacity_over(opacity, (low, high))
        values = np.linspace(low, high, 300)
        inside = OpacityTF((low, high), opacity.modes, opacity.points)
        np.testing.assert_allclose(exact(values), inside(values), atol=1e-9)
        # A range that was asked for is kept, and said to be too wide.
        rendered(folder, "outlier", f"{tf} --range 0,50000")
        assert "over 0 to 50,000" in capsys.readouterr().err
