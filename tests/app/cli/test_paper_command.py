import json
from pathlib import Path

import pytest
from skimage.io import imread

from app.cli import run
from model.evaluation.study import STUDIES
from model.networks.blocks import kaiming_init
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.networks.paper import TwoStageGenerator
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.volume_files import read_volume

FIGURES = [
    "teaser", "overview", "sensitivity", "value-fields", "exploration", "interpolation",
    "qualitative",
]  # fmt: skip


@pytest.fixture(scope="module")
def base(raw_file, tmp_path_factory):
    """Options that name a small volume and a model of it."""
    folder = tmp_path_factory.mktemp("paper")
    size = NetworkSize(0.125, 32, 64)
    network = TwoStageGenerator(size)
    kaiming_init(network)
    scene = Scene.of(read_volume(raw_file), 64, tf_family="paper")
    save_model(folder / "model", ModelCard(scene, "draft", size), network)
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
    assert "…" not in printed
    for row in found["rows"]:
        assert all(cell in printed for cell in row.values())


@pytest.mark.slow
@pytest.mark.parametrize("item", list(STUDIES))
def test_studies(base, item, capsys):
    assert run(["paper", item, *base.split()]) == 0
    folder = out_of(base) / "studies-quick"
    assert imread(folder / f"{item}.png").std() > 10
    assert (folder / f"{item}-errors.png").is_file() == (STUDIES[item].varied != "")
    assert "Recipe of all" in (folder / f"{item}.md").read_text()
    found = json.loads((folder / f"{item}.json").read_text())
    assert set(found["variants"]) == {v.name for v in STUDIES[item].variants}
