from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from model.errors import CheckpointError
from model.evaluation.alternatives import (
    Alternative,
    compare_alternatives,
    is_drawn_by_vtk,
    record_verdict,
    verdict,
)
from model.generator.generator import Generator
from model.networks.build import build_generator
from model.networks.card import (
    ModelCard,
    add_metrics,
    load_card,
    recorded_agreement,
    verdict_of,
)
from model.networks.checkpoint import save_model
from model.networks.size import NetworkSize
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.volume import Volume

SIZE = NetworkSize(0.125, 16, 32)


@pytest.fixture
def scene(volume: Volume) -> Scene:
    return Scene.of(volume, 32, "direct", renderer="raycast")


@pytest.fixture
def folder(volume: Volume, scene: Scene, tmp_path: Path) -> Path:
    save_model(tmp_path, ModelCard(scene, "tiny", SIZE), build_generator(SIZE, scene))
    return tmp_path


def test_each_is_measured_on_the_same_truth(folder: Path, volume: Volume, scene: Scene) -> None:
    renderer = make_renderer(volume, scene)
    images = render_samples(renderer, scene, 3, "holdout", range(6)).rgba
    samples = [draw_sample(scene, 3, "holdout", index) for index in range(6)]
    generator = Generator.load(folder, "cpu")
    found = compare_alternatives(generator, folder, volume, samples, images)
    rows = {row["name"]: row for row in found["rows"]}
    assert list(rows) == ["model", "compact volume", "ray caster", "VTK"]
    # All but the rounding to bytes.
    assert rows["ray caster"]["rmse"] < 1 / 255
    assert rows["VTK"]["rmse"] < 0.005
    expected = np.mean(
        [
            np.sqrt(np.mean((generator.render(s)[..., :3] - image[..., :3] / 255) ** 2))
            for s, image in zip(samples, images, strict=True)
        ]
    )
    assert rows["model"]["rmse"] == pytest.approx(expected, rel=1e-5)
    # So small a volume fits into the model's bytes whole.
    compact = rows["compact volume"]
    assert compact["rmse"] == rows["ray caster"]["rmse"]
    assert compact["bytes"] < rows["ray caster"]["bytes"]
    assert all(row["ms"] > 0 for row in rows.values())
    renderer.close()


def test_where_vtk_scatters_it_is_timed_too(volume: Volume, tmp_path: Path) -> None:
    scene = Scene.of(volume, 32, "shadows", renderer="vtk")
    save_model(tmp_path, ModelCard(scene, "tiny", SIZE), build_generator(SIZE, scene))
    renderer = make_renderer(volume, scene)
    images = render_samples(renderer, scene, 3, "holdout", range(4)).rgba
    renderer.close()
    samples = [draw_sample(scene, 3, "holdout", index) for index in range(4)]
    generator = Generator.load(tmp_path, "cpu")
    found = compare_alternatives(generator, tmp_path, volume, samples, images)
    *_, ray_caster, vtk = found["rows"]
    assert (ray_caster["name"], vtk["name"]) == ("ray caster", "VTK")
    assert vtk["rmse"] < 1 / 255 and ray_caster["rmse"] < 1 / 255
    ratio = vtk["ms"] / found["rows"][0]["ms"]
    said = re.search(r"VTK takes ([\d.]+) times as long as the model\.$", found["verdict"])
    assert said is not None
    assert float(said[1]) == pytest.approx(ratio, rel=0.05, abs=0.051)


def test_vtk_does_not_draw_the_ray_casters_shadows(volume: Volume) -> None:
    assert is_drawn_by_vtk(Scene.of(volume, 32, "direct", renderer="raycast"))
    assert is_drawn_by_vtk(Scene.of(volume, 32, "shadows", renderer="vtk"))
    assert not is_drawn_by_vtk(Scene.of(volume, 32, "soft", renderer="raycast"))


@pytest.mark.slow
def test_the_verdict_is_kept_in_the_card(folder: Path, volume: Volume) -> None:
    assert verdict_of(folder) == ""
    assert recorded_agreement(folder) is None
    said = record_verdict(folder, volume)
    assert verdict_of(folder) == said
    agreement = recorded_agreement(folder)
    assert agreement is not None and -1 <= agreement <= 1
    assert load_card(folder).metrics["alternatives"]["count"] == 48
    # The model itself is as it was.
    assert Generator.load(folder, "cpu").scene == load_card(folder).scene
    with pytest.raises(CheckpointError):
        add_metrics(folder / "nowhere", a=1)
    assert verdict_of(folder / "nowhere") == ""
    content = json.loads((folder / "model.json").read_text())
    content["metrics"] = []
    (folder / "model.json").write_text(json.dumps(content))
    assert verdict_of(folder) == ""


def test_verdicts() -> None:
    model = Alternative("model", 0.02, 0.95, 0.003, 10.0, 100)
    compact = Alternative("compact volume", 0.03, 0.93, 0.004, 9.0, 100)
    exact = Alternative("ray caster", 0.0, 1.0, 0.0, 40.0, 900)
    said = verdict(model, compact, exact)
    assert said.startswith("This model pays: it is 4.0 times as fast as the ray caster, and is ")
    said = verdict(model, compact, replace(exact, ms=5.0))
    assert said.startswith("This model is for where the volume's file is not: it is nearer to the")
    assert said.endswith("the ray caster is exact, and the model takes 2.0 times as long.")
    assert "is only 1.2 times as fast" in verdict(model, compact, replace(exact, ms=12.0))
    worse = replace(model, rmse=0.04, ssim=0.9, emd=0.1)
    assert ", though it is not nearer" in verdict(worse, compact, replace(exact, ms=5.0))
    # Where the truth is VTK's, a slower model may still be nearer to it.
    assert verdict(model, compact, replace(exact, ms=5.0, rmse=0.04)).startswith("This model pays")
    assert "(in EMD)" in verdict(replace(model, rmse=0.04, ssim=0.9), compact, exact)
    assert "not nearer" in verdict(replace(model, rmse=0.04, ssim=0.9, emd=0.1), compact, exact)
