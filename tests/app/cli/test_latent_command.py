import numpy as np
import pytest
from skimage.io import imread

from app.cli import run
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction


@pytest.fixture(scope="module")
def volume(tmp_path_factory):
    """A small volume as a raw file, with the option that describes it."""
    path = tmp_path_factory.mktemp("data") / "blob.raw"
    z, y, x = np.mgrid[0:12, 0:14, 0:16] / 16 - 0.4
    values = 255 * np.exp(-(x**2 + y**2 + z**2) / 0.05)
    values.astype(np.uint8).tofile(path)
    return f"--volume {path} --raw 16x14x12,uint8"


def test_the_map_its_grid_and_a_place(volume, tmp_path):
    base = f"latent {volume} --size 16 --out {tmp_path}"
    assert run(f"{base}/map.npz".split()) == 0
    assert run(f"{base}/grid.npz --grid=-0.5,-1,0.5,0.2 --at 0.3,-0.7".split()) == 0
    with np.load(tmp_path / "map.npz") as plain, np.load(tmp_path / "grid.npz") as grid:
        assert set(plain) == {"codes", "map", "tfs", "singular_values"}
        assert plain["codes"].shape == (10_000, 8)
        assert plain["map"].shape == (10_000, 2)
        assert plain["tfs"].shape == (10_000, 256)
        assert plain["singular_values"].shape == (8,)
        assert {"code", "image", "tf"} <= set(grid)
        assert grid["cells"].shape == (4, 4, 8)
        assert grid["images"].shape == (4, 4, 16, 16, 4)
        x, y = plain["map"].T
        lowest = (x >= -0.5) & (x < -0.25) & (y >= -1) & (y < -0.7)
        assert grid["count"][3, 0] == lowest.sum()
        expected = plain["codes"][lowest].mean(axis=0, dtype=np.float64)
        assert grid["cells"][3, 0] == pytest.approx(expected, abs=1e-4)
        assert (np.isnan(grid["images"][..., 0, 0, 0]) == (grid["count"] == 0)).all()


@pytest.mark.slow
def test_a_place_becomes_a_tf_that_is_found_there(volume, tmp_path, capsys):
    base = f"latent {volume} --size 16 --out {tmp_path}"
    assert run(f"{base}/tf.json --at 0.3,-0.7".split()) == 0
    tf = TransferFunction.load(tmp_path / "tf.json")
    assert tf.opacity.points
    assert run(f"{base}/at.npz --at 0.3,-0.7".split()) == 0
    assert run(f"{base}/near.npz --near {tmp_path}/tf.json".split()) == 0
    with np.load(tmp_path / "at.npz") as at, np.load(tmp_path / "near.npz") as near:
        assert tf.opacity.sample() == pytest.approx(at["tf"], abs=0.05)
        assert at["image"].shape == (16, 16, 4)
        assert np.abs(near["tf"] - at["tf"]).mean() < 0.03
        assert near["place"] == pytest.approx([0.3, -0.7], abs=0.35)
        assert near["neighbours"].shape == (8,)
    for name, question in (("map", ""), ("grid", "--grid=-1,-1,1,1"), ("at", "--at 0,0")):
        assert run(f"{base}/{name}.png {question}".split()) == 0
        assert imread(tmp_path / f"{name}.png").std() > 1


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ("--out x.txt", "must end in"),
        ("--out x.json", "by --at or --near"),
        ("--out x.npz --at 1", "takes 2 numbers"),
        ("--out x.npz --grid 0,0,nan,1", "takes 4 numbers"),
        ("--out x.npz --grid 5,5,6,6", "no sample"),
        ("--out x.npz --at 0,0 --near {tf}", "Give --near alone"),
    ],
)
def test_questions_that_make_no_sense(volume, options, problem, tmp_path, monkeypatch, capsys):
    tf = tmp_path / "tf.json"
    TransferFunction(OpacityTF((0, 1)), ColorTF((0, 1), ((0, 0, 0, 0), (1, 1, 1, 1)))).save(tf)
    monkeypatch.chdir(tmp_path)
    assert run(f"latent {volume} {options.format(tf=tf)}".split()) == 2
    assert problem in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [tf]
