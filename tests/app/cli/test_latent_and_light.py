import json
from pathlib import Path

import numpy as np
import pytest
from lively import SIZE, lively_network
from skimage.io import imread

from app.cli import run
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.networks.path_light_network import load_path_light
from model.samples.path_light_pairs import FEW, Pairs, write_block
from model.scene.scene import Scene
from model.scene.transfer_function import TransferFunction
from model.volume_files import read_volume


def test_the_map_its_grid_and_a_place(raw_file, tmp_path):
    base = f"latent --volume {raw_file} --size 16 --out {tmp_path}"
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
def test_a_place_becomes_a_tf_that_is_found_there(raw_file, tmp_path, capsys):
    base = f"latent --volume {raw_file} --size 16 --out {tmp_path}"
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


def test_a_network_is_trained_and_written_with_its_errors(tmp_path):
    # Denoised pictures have nine tenths of the light.
    rng = np.random.default_rng(0)
    exact = (rng.uniform(0.2, 0.8, (4, 3, 1, 1)) * np.ones((4, 3, 32, 32))).astype(np.float16)
    few = np.repeat(np.float16(0.9) * exact[:, None], len(FEW), 1)
    one = np.ones((4, 1, 32, 32), np.float16)
    pairs = Pairs(exact, exact, one, few, few, exact, np.zeros(4))
    write_block(tmp_path / "a-0-0000.npz", pairs)
    out = tmp_path / "network.safetensors"
    train = f"light train {tmp_path} --held-out {tmp_path} --out {out} --minutes 0.01 --width 4"
    assert run(train.split()) == 0
    card, _ = load_path_light(out)
    assert (card.size.width, card.training["pairs"]) == (4, 4)
    assert set(card.errors) == {str(samples) for samples in FEW}


FIGURES = [
    "teaser", "overview", "sensitivity", "value-fields", "exploration", "interpolation",
    "qualitative",
]  # fmt: skip


@pytest.fixture(scope="module")
def base(raw_file, tmp_path_factory):
    """Options that name a small volume and a model of it."""
    folder = tmp_path_factory.mktemp("paper")
    scene = Scene.of(read_volume(raw_file), 64, tf_family="paper")
    save_model(folder / "model", ModelCard(scene, "draft", SIZE), lively_network())
    return f"--volume {raw_file} --model {folder}/model --quick --out {folder}/out"


def out_of(base):
    return Path(base.split()[-1])


@pytest.mark.parametrize("item", FIGURES)
def test_figures(base, item):
    assert run(["paper", item, *base.split()]) == 0
    picture = imread(out_of(base) / f"{item}.png")
    assert picture.shape[0] > 400 and picture.shape[1] > 800
    # Coloured, and not cut: there is paper at all four edges.
    assert picture.std() > 10
    for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1]):
        assert (edge[..., :3] == 255).all()


@pytest.mark.parametrize("item", ["table1", "table2"])
def test_tables(base, item, capsys):
    assert run(["paper", item, *base.split()]) == 0
    found = json.loads((out_of(base) / f"{item}.json").read_text())
    lines = (out_of(base) / f"{item}.md").read_text().splitlines()
    assert sum(line.startswith("|") for line in lines) == len(found["rows"]) + 2
    # Nothing is cut where the output is no terminal.
    printed = capsys.readouterr().out
    assert all(cell in printed for row in found["rows"] for cell in row.values())
