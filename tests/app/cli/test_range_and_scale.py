import json

import numpy as np
import pytest

from app.cli import run
from model.samples.sample_store import SampleStore
from model.scene.default_tf import default_transfer_function
from model.scene.ranges import robust_range
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.volume import Volume

RANGE = (0.0, 250.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A ball of values to 250 as it is, and with one voxel of 60,000; and a TF over the ball's."""
    path = tmp_path_factory.mktemp("ranges")
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


def rendered(volume, options=""):
    out = volume.with_name("image.npy")
    base = f"render --renderer raycast --size 24 --volume {volume}"
    assert run(f"{base} {options} --out {out}".split()) == 0
    return np.load(out)


def test_a_tf_brings_its_range(folder):
    tf = f"--tf {folder / 'tf.json'}"
    expected = rendered(folder / "ball_20x18x16_float32.raw", tf)
    np.testing.assert_array_equal(rendered(folder / "outlier_20x18x16_float32.raw", tf), expected)
    narrow = rendered(folder / "ball_20x18x16_float32.raw", f"{tf} --range 100,250")
    # The mode at 120 stays where it is, and what is below 100 looks as 100 does.
    assert narrow[..., 3].mean() > expected[..., 3].mean()


def test_what_is_too_narrow_for_the_range_is_said_with_the_option(folder, capsys):
    whole = (0.0, 60_000.0)
    color = ColorTF(whole, ((0.0, 0.1, 0.2, 0.9), (60_000.0, 1.0, 0.3, 0.2)))
    mode = OpacityTF(whole, (GaussianMode(120.0, 20.0, 0.2),))
    TransferFunction(mode, color).save(folder / "mode.json")
    tf = f"--tf {folder / 'mode.json'}"
    wide = rendered(folder / "outlier_20x18x16_float32.raw", tf)
    said = capsys.readouterr().err
    assert "finer than 1/256 of the range 0 to 60,000" in said
    option = said.splitlines()[0].partition("; give ")[2].strip().rstrip(".")
    assert option.startswith("--range ")
    shown = rendered(folder / "outlier_20x18x16_float32.raw", f"{tf} {option}")
    assert "finer" not in capsys.readouterr().err
    assert np.abs(shown - wide).max() > 0.05
    # A range that was asked for is kept, and said to be too wide.
    rendered(folder / "outlier_20x18x16_float32.raw", f"{tf} --range 0,50000")
    assert "range 0 to 50,000" in capsys.readouterr().err


@pytest.fixture(scope="module")
def scales(tmp_path_factory):
    """A log-normal volume and its logarithm, and a TF over the latter as one of the former."""
    path = tmp_path_factory.mktemp("scales")
    values = np.exp(3 * np.random.default_rng(6).normal(size=(14, 15, 16))).astype(np.float32)
    logarithms = np.log10(values.astype(np.float64)).astype(np.float32)
    np.save(path / "halo.npy", values)
    np.save(path / "logarithms.npy", logarithms)
    volume = Volume(values).on_scale("log")
    default_transfer_function(volume.over(robust_range(volume))).save(path / "log.json")
    return path


def test_the_image_is_that_of_the_logarithms(scales):
    expected = rendered(scales / "logarithms.npy")
    assert expected[..., 3].max() > 0.1
    found = rendered(scales / "halo.npy", "--scale log")
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert np.abs(rendered(scales / "halo.npy") - expected).max() > 0.1
    # A TF that was saved on the scale brings it.
    by_tf = rendered(scales / "halo.npy", f"--tf {scales / 'log.json'}")
    np.testing.assert_allclose(by_tf, found, atol=1e-6)


def test_info_offers_it_and_tells_values(scales, capsys):
    assert run(f"info --json {scales}/halo.npy".split()) == 0
    told = json.loads(capsys.readouterr().out)
    values = np.load(scales / "halo.npy")
    assert told["suits_logarithm"] is True
    assert told["range"] == [float(values.min()), float(values.max())]
    assert run(f"info {scales}/halo.npy".split()) == 0
    assert "--scale log" in " ".join(capsys.readouterr().out.split())
    assert run(f"info --json {scales}/logarithms.npy".split()) == 0
    assert json.loads(capsys.readouterr().out)["suits_logarithm"] is False


def test_sensitivities_are_told_over_values(scales):
    out = scales / "found.npz"
    base = f"sensitivity --volume {scales}/halo.npy --scale log --size 16 --out {out}"
    assert run(f"{base} --range 0.01,1000".split()) == 0
    with np.load(out) as found:
        np.testing.assert_allclose(found["scalar_values"], np.geomspace(0.01, 1000, 256))


def test_samples_lie_on_the_scale(scales):
    base = f"dataset --volume {scales}/halo.npy --size 16 --count 1 --holdout 1 --workers 1"
    options = "--scale log --range 0.01,1000 --window 0.1,100"
    assert run(f"{base} {options} --out {scales}/store".split()) == 0
    scene = SampleStore(scales / "store").scene
    assert scene.scale == "log"
    assert scene.scalar_range == pytest.approx((-2, 3))
    assert scene.scalar_window == pytest.approx((-1, 2))


@pytest.mark.parametrize(("arguments", "message"), [
    ("render --out x.png --volume halo.npy --scale log --range 0,5", "above zero"),
    ("render --out x.png --volume halo.npy --scale linear --tf log.json", "the logarithm"),
    ("render --out x.png --volume negative.npy --scale log", "no value is above zero"),
    ("sensitivity --out x.npz --volume halo.npy --scale log --value -1", "outside the volume"),
])  # fmt: skip
def test_scales_that_make_no_sense(arguments, message, scales, monkeypatch, capsys):
    monkeypatch.chdir(scales)
    np.save("negative.npy", -np.arange(1, 65, dtype=np.float32).reshape(4, 4, 4))
    assert run(arguments.split()) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert message in line
