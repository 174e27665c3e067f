import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from skimage.io import imread

from app.cli import run
from app.state.window_start import WindowStart
from model.generator.catalog import shipped_models
from model.generator.generator import Generator
from model.networks.card import load_card
from model.networks.size import NetworkSize
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.scene.view import View
from model.training.options import TrainingOptions
from model.volume_files import read_volume
from model.volume_files.shipped import SCAN, shipped_volumes

RANGE = (0.0, 255.0)


@pytest.fixture(scope="module")
def trained(raw_file, tmp_path_factory):
    """A model folder from the real pipeline, at the smallest preset."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    arguments = f"train --volume {raw_file} --preset draft --out {folder} --samples 32"
    arguments += " --workers 1 --precision float32"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("model.training.monitor.PROBE_SAMPLES", 4)
        assert run(arguments.split()) == 0
    return folder


@pytest.fixture(scope="module")
def samples(raw_file, tmp_path_factory):
    out = tmp_path_factory.mktemp("stores") / "samples.zarr"
    arguments = f"dataset --volume {raw_file} --out {out} --size 64 --workers 1 --count 4"
    assert run([*arguments.split(), "--holdout", "2"]) == 0
    return out


def one_line(capsys):
    """The single line on standard error that bad input gets."""
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("tfscope: ")
    return lines[0]


@pytest.mark.parametrize(
    ("options", "kind", "step"),
    [("vtk", VtkRenderer, None), ("raycast --sample-distance 0.1", RaycastRenderer, 0.1)],
)
def test_renderers_draw_what_they_draw_by_themselves(
    raw_file, tf_file, tmp_path, options, kind, step
):
    out = tmp_path / "image.npy"
    arguments = f"render --renderer {options} --volume {raw_file} --view 30,20,5,0.8 --tf {tf_file}"
    assert run([*arguments.split(), "--size", "48", "--out", str(out)]) == 0
    image = np.load(out)
    assert (image.shape, image.dtype) == ((48, 48, 4), np.float32)
    renderer = kind(read_volume(raw_file))
    inputs = SceneInputs.of(View(30, 20, 5, 0.8), TransferFunction.load(tf_file))
    np.testing.assert_array_equal(image, renderer.render(inputs, 48, step))


def test_the_sensitivity_of_a_region_predicts_an_edit(raw_file, tf_file, tmp_path):
    base = f"--volume {raw_file} --size 48 --view 30,20"
    region = "12,16,36,32"
    out = tmp_path / "s.npz"
    arguments = f"sensitivity {base} --tf {tf_file} --region {region} --out {out}"
    assert run([*arguments.split(), "--width", "0"]) == 0
    with np.load(out) as file:
        sensitivity, opacity, image = file["sensitivity"], file["opacity"], file["image"]
        values = file["scalar_values"]
    step = 1e-3
    points = list(zip(values.tolist(), (opacity + step * np.sin(values)).tolist(), strict=True))
    color = TransferFunction.load(tf_file).color
    opacity_tf = OpacityTF(RANGE, points=tuple((v, max(a, 0)) for v, a in points))
    edited = TransferFunction(opacity_tf, color)
    edited.save(tmp_path / "edited.json")
    arguments = f"render --renderer raycast {base} --tf {tmp_path / 'edited.json'}"
    assert run([*arguments.split(), "--out", str(tmp_path / "edited.npy")]) == 0
    after = np.load(tmp_path / "edited.npy")
    left, top, right, bottom = map(int, region.split(","))
    norms = [np.linalg.norm(i[top:bottom, left:right, :3]) for i in (image, after)]
    change = np.array([max(a, 0) for _, a in points]) - opacity
    assert norms[1] - norms[0] == pytest.approx(float(sensitivity @ change), rel=0.05)


def test_a_sensitivity_as_a_table(raw_file, tmp_path):
    base = f"sensitivity --volume {raw_file} --size 16 --out {tmp_path}"
    for question, names in (
        ("--region 4,4,12,12", ["sensitivity"]), ("--value 120", ["red", "green", "blue"]),
        ("--block 8", ["sensitivity"]),
    ):  # fmt: skip
        assert run(f"{base}/s.csv {question}".split()) == 0
        assert run(f"{base}/s.npz {question}".split()) == 0
        table = np.genfromtxt(tmp_path / "s.csv", delimiter=",", names=True)
        with np.load(tmp_path / "s.npz") as file:
            expected = file["sensitivity"]
        found = np.stack([table[name] for name in names], axis=-1).reshape(expected.shape)
        np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert run(f"{base}/field.png --value 120 --field-scale global".split()) == 0
    assert imread(tmp_path / "field.png").std() > 1


def test_learned_and_blockwise_fields_of_a_value_are_near(trained, raw_file, tmp_path, monkeypatch):
    monkeypatch.setattr("app.cli.sensitivity.PAPER_BLOCKS", 8)
    means = []
    for engine in ("learned", "blockwise"):
        out = tmp_path / f"{engine}.npz"
        base = f"sensitivity --model {trained} --volume {raw_file} --value 120 --out {out}"
        assert run([*base.split(), "--engine", engine]) == 0
        with np.load(out) as file:
            assert file["sensitivity"].shape == (64, 64, 3)
            means.append(file["sensitivity"].mean(axis=2).reshape(8, 8, 8, 8).mean(axis=(1, 3)))
    assert np.corrcoef(means[0].ravel(), means[1].ravel())[0, 1] > 0.5


def test_a_png_shows_the_image_on_black(raw_file, tf_file, tmp_path):
    chosen = {"image.npy": [], "image.png": ["--brightness", "1"], "usual.png": []}
    for name, brightness in chosen.items():
        arguments = f"render --volume {raw_file} --tf {tf_file} --size 32 --lighting direct"
        out = ["--out", str(tmp_path / name)]
        assert run([*arguments.split(), *brightness, *out]) == 0
    expected = np.load(tmp_path / "image.npy")[..., :3]
    np.testing.assert_allclose(imread(tmp_path / "image.png") / 255, expected, atol=1e-6)
    usual = 2 * expected / (1 + expected.max(axis=-1, keepdims=True))
    np.testing.assert_allclose(imread(tmp_path / "usual.png") / 255, usual, atol=0.003)


def test_the_generator_renders_its_model(trained, tf_file, tmp_path, capsys):
    assert run(["info", str(trained)]) == 0
    printed = capsys.readouterr().out
    assert all(part in printed for part in ("ball", "64 x 64", "image RMSE"))
    out = tmp_path / "image.npy"
    arguments = f"render --renderer generator --model {trained} --tf {tf_file} --view 10,5"
    assert run([*arguments.split(), "--out", str(out)]) == 0
    tf = TransferFunction.load(tf_file)
    expected = Generator.load(trained, "cpu").render(SceneInputs.of(View(10, 5), tf))
    np.testing.assert_allclose(np.load(out), expected, atol=1e-6)


@pytest.mark.slow
def test_evaluate_compares_with_the_nearest_neighbour(trained, raw_file, tmp_path, capsys):
    # The card of a copy gets what was measured.
    copied = Path(shutil.copytree(trained, tmp_path / "copied"))
    out = tmp_path / "result.json"
    arguments = f"evaluate --model {copied} --volume {raw_file} --count 6 --workers 1 --record"
    assert run([*arguments.split(), "--json", str(out)]) == 0
    result = json.loads(out.read_text())
    assert result["count"] == result["nearest_neighbor"]["count"] == 6
    assert f"{result['rmse']['mean']:.4f}" in capsys.readouterr().out
    assert result["sensitivity_agreement"]["count"] == 5
    recorded = load_card(copied).metrics
    assert recorded["holdout"]["rmse"] == pytest.approx(result["rmse"]["mean"])
    assert recorded["holdout_count"] == 6
    assert recorded["kinds"] == result["kinds"]


def test_a_model_is_not_asked_silently_for_what_it_was_not_trained_on(
    trained, tf_file, tmp_path, capsys
):
    base = f"render --renderer generator --model {trained} --tf {tf_file} --out {tmp_path}/x.png"
    assert run([*base.split(), "--view", "10,20"]) == 0
    assert capsys.readouterr().err == ""
    assert run([*base.split(), "--view", "10,85", "--crop", "0,1,0,0.5,0,1"]) == 0
    [line] = capsys.readouterr().err.splitlines()
    assert "Outside the training range: elevation 85° (±80°), a crop box" in line


def test_a_picture_says_what_it_shows(raw_file, tf_file, tmp_path):
    out = tmp_path / "new" / "folder" / "x.png"
    arguments = f"render --renderer raycast --volume {raw_file} --tf {tf_file} --size 16"
    arguments += f" --view 10,20,0,.5 --lighting direct --light 20,30 --out {out}"
    assert run(arguments.split()) == 0
    with Image.open(out) as picture:
        facts = picture.text
    found = [facts[key] for key in ("Volume", "View", "Lighting", "Light")]
    assert found == ["ball", "10,20,0,0.5", "direct", "20,30"]
    assert facts["Software"].startswith("tfscope ")
    tf = json.loads(facts["Transfer function"])
    assert TransferFunction.from_json(tf) == TransferFunction.load(tf_file)


def test_what_is_rendered_already_needs_no_more_room(samples, raw_file, monkeypatch, capsys):
    arguments = f"dataset --volume {raw_file} --out {samples} --size 64 --workers 1 --holdout 2"
    usage = shutil.disk_usage(samples)._replace(free=1000)
    monkeypatch.setattr("shutil.disk_usage", lambda path: usage)
    assert run([*arguments.split(), "--count", "4"]) == 0
    assert run([*arguments.split(), "--count", "400"]) == 2
    assert "1.0 kB are free" in one_line(capsys)


def test_the_window_opens_the_volume_of_a_model(opened):
    for folder in shipped_models():
        run(["--model", str(folder)])
        fingerprint = load_card(folder).scene.volume_fingerprint
        assert read_volume(opened[-1].volume).fingerprint == fingerprint


BAD_INPUT = [
    ("render --tf none.json --out x.png", "cannot be read"),
    ("render --out x.jpg", "must end in .png, .mp4, .gif or .npy"),
    ("render --out x.png --lighting none --light 0,0", "Try: --lighting direct"),
    ("render --component 1.5 --out x.png", "not a component"),
    ("render --volume . --raw huge --out x.png", "not the layout"),
    ("render --out x.png --renderer generator --range 0,1", "leave --range and --scale out"),
    ("render --size 5 --out x.png", "not a size of an image"),
    ("render --background puce --out x.png", "not a background"),
    ("render --background transparent --out x.mp4", "no transparent background"),
    ("render --legend --out x.npy", "no legend or scale bar"),
    ("render --lighting direct --samples 4 --out x.png", "path-traced light only"),
    ("render --lighting path --sample-distance 0.1 --out x.png", "give --samples"),
    ("latent --out x.txt", "must end in"),
    ("latent --out x.json", "by --at or --near"),
    ("latent --out x.npz --at 1", "takes 2 numbers"),
    ("latent --out x.npz --grid 5,5,6,6", "no sample"),
    ("latent --out x.npz --at 0,0 --near {tf}", "--near finds a place"),
    ("--size 10x10", "not a size of the window"),
    ("--lighting none --light 0,0", "no light to move"),
    ("dataset --count 5 --window 1 --out x", "not a scalar window"),
    ("dataset --count 99999999999 --out x", "--count"),
    ("dataset --count 5 --out x --scheduler tcp://a:1 --workers 2", "--workers or --scheduler"),
    ("dataset --count 9999999 --size 4096 --out x", "GB"),
    ("sensitivity --engine learned --lighting direct --out x.png", "--engine exact"),
    ("sensitivity --region 0,0,4,4 --value 7 --out x.png", "Give only one of"),
    ("sensitivity --block 8 --measure change --out x.png", "measure of the paper"),
    ("sensitivity --engine learned --size 64 --out x.png", "leave --size out"),
    ("sensitivity --size 1040 --block 1 --out x.npz", "larger blocks"),
    ("train --out x --reuse 0.5", "--reuse"),
    ("train --out x --dataset . --lighting direct --reuse 2", "lighting and reuse"),
    ("train --out x --preset huge", "'--preset': 'huge' is not one of"),
    ("train --out x --dataset . --range 0,1", "the range would have no effect"),
    ("train --out x --resume", "no training run to resume"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD_INPUT)
def test_bad_input_gets_one_line_and_code_2(
    arguments, message, tf_file, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert run(arguments.format(tf=tf_file).split()) == 2
    assert message in one_line(capsys)
    assert list(tmp_path.iterdir()) == []


def test_more_bad_input(trained, samples, raw_file, tmp_path, capsys):
    other = tmp_path / "other.npy"
    np.save(other, np.arange(64, dtype=np.uint8).reshape(4, 4, 4))
    train = f"train --dataset {samples} --out {tmp_path} --preset"
    for arguments, message in (
        (f"train --volume {raw_file} --preset draft --out {trained} --samples 9", "Try: --resume"),
        (f"render --renderer generator --model {trained} --lighting direct --out x.png", "'none'"),
        (f"{train} draft --workers 2", "the workers would have no effect"),
        (f"evaluate --model {trained} --volume {other}", "trained on another volume"),
        (f"{train} compact", "Try: --preset draft"),
    ):
        assert run(arguments.split()) == 2
        assert message in one_line(capsys)


def test_the_papers_run_is_one_command(raw_file, tmp_path, monkeypatch):
    jobs = []
    monkeypatch.setattr("app.cli.training_display.train_model", jobs.append)
    base = f"train --faithful --volume {raw_file} --out {tmp_path}/run"
    assert run(base.split()) == 0
    (job,) = jobs
    assert (job.preset, job.tf_family, job.samples, job.reuse) == ("paper", "paper", 12_000_000, 30)
    assert job.size == NetworkSize(1.0, 64, 256, 8)
    assert job.options == TrainingOptions.faithful()
    assert run(f"{base} --preset draft --epochs 5 --tf-family drawn".split()) == 0
    assert (jobs[-1].samples, jobs[-1].tf_family) == (2_000_000, "drawn")
    assert jobs[-1].options.opacity.halvings == 1


MODEL, VOLUME = shipped_models()[0], shipped_volumes()[0]


@pytest.fixture
def opened(monkeypatch, tmp_path):
    """Calls that start the window; the folder has a TF, a slice, and files like commands."""
    starts = []
    monkeypatch.setattr("app.launch.run_window", lambda start, *_: starts.append(start) or 0)
    monkeypatch.chdir(tmp_path)
    tf = TransferFunction(OpacityTF((0, 1)), ColorTF((0, 1), ((0, 0, 0, 0), (1, 1, 1, 1))))
    tf.save(tmp_path / "tf.json")
    (tmp_path / "scan").mkdir()
    (tmp_path / "IM0001").write_bytes(bytes(128) + b"DICM")
    for name in ("info", "cpu", "notes.txt"):
        (tmp_path / name).write_text("")
    return starts


@pytest.mark.parametrize(
    ("arguments", "start"),
    [
        ("", WindowStart(SCAN)),
        ("--renderer vtk", WindowStart(SCAN, renderer="vtk")),
        (str(VOLUME), WindowStart(VOLUME)),
        (f"--device cpu {VOLUME}", WindowStart(VOLUME)),
        (f"{VOLUME} --view=-30,20 --device cpu", WindowStart(VOLUME, view=View(-30, 20))),
        (f"--view -30,20 {VOLUME}", WindowStart(VOLUME, view=View(-30, 20))),
        (f"{VOLUME} tf.json", WindowStart(VOLUME, tf=Path("tf.json"))),
        ("tf.json", WindowStart(SCAN, tf=Path("tf.json"))),
        (f"{MODEL} --volume scan", WindowStart(Path("scan"), MODEL)),
        ("scan", WindowStart(Path("scan"))),
        ("IM0001", WindowStart(Path("IM0001"))),
        (
            "--lighting direct --light 10,-20 --renderer auto --crop 0,1,0,.5,0,1 --size 1400x900",
            WindowStart(SCAN, lighting="direct", light=LightDirection(10, -20), renderer="auto",
                        crop=CropBox((0, 0, 0), (1, 0.5, 1)), size=(1400, 900)),
        ),
    ],
)  # fmt: skip
def test_files_are_opened_by_what_they_are(opened, arguments, start):
    assert run(arguments.split()) == 0
    assert opened == [start]
    # A command wins over a file of its name.
    assert run(["info", str(VOLUME)]) == 0
    assert opened == [start]


@pytest.mark.parametrize(("arguments", "message"), [
    ("rendr", "'rendr' is neither a command (dataset, evaluate,"),
    ("none.nrrd", "nor an existing file or folder"),
    ("notes.txt", "notes.txt: this is a table or text, which is not read here"),
    (f"{VOLUME} {VOLUME}", "cannot both be opened by --volume"),
    (f"{VOLUME} render --out x.png", "Options before 'render' apply to the window"),
    ("--model scan", "there is no model here"),
])  # fmt: skip
def test_what_cannot_be_opened_is_refused_in_a_line(opened, capsys, arguments, message):
    assert run(arguments.split()) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert message in line
    assert opened == []
