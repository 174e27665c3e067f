"""Training that stops and goes on, or runs in two processes."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from training_runs import Stop, assert_same_state, plan

from model.errors import TrainingError
from model.networks.card import load_card
from model.networks.checkpoint import load_model
from model.training.stages import OpacityStage
from model.training.state import load_progress
from model.training.trainer import train


def test_a_run_that_ctrl_c_stopped_in_a_step_ends_as_one_that_was_not(
    finished, store, tmp_path, monkeypatch
):
    losses, pressed = OpacityStage._generator_losses, []

    def interrupted(*arguments):
        pressed.append(1)
        if len(pressed) == 2:
            signal.raise_signal(signal.SIGINT)
        return losses(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(OpacityStage, "_generator_losses", interrupted)
        with pytest.raises(KeyboardInterrupt):
            train(plan(store, tmp_path))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert load_progress(tmp_path)[0].samples == 2 * 16
    train(plan(store, tmp_path), resume=True)
    assert_same_state(tmp_path, finished)
    curves = [load_card(run).training["curve"] for run in (tmp_path, finished)]
    assert [row.keys() for row in curves[0]] == [row.keys() for row in curves[1]]
    assert [row["samples"] for row in curves[0]] == [row["samples"] for row in curves[1]]


def test_ctrl_c_pressed_again_is_heard_at_once(store, tmp_path, monkeypatch):
    def impatient(*_):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("this is never come to")

    monkeypatch.setattr("model.training.stages.OpacityStage._weights", impatient)
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, tmp_path))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    # What is torn apart is not saved.
    assert not (tmp_path / "training.json").exists()


KILLED = """
import sys
from pathlib import Path
sys.path.insert(0, "tests/model/training")
from model.samples.sample_store import SampleStore
from model.training.trainer import train
import model.training.monitor
model.training.monitor.PROBE_SAMPLES = 8
from training_runs import plan
store, folder = SampleStore(Path(sys.argv[1])), Path(sys.argv[2])
train(plan(store, folder), on_report=lambda r: print(r.samples, flush=True))
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_run_loses_at_most_one_interval(finished, store, tmp_path):
    folder = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(store.path), str(folder)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        text=True,
    )
    while int(process.stdout.readline()) < 112:
        pass
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    load_model(folder)  # whatever the moment of the kill, the model in the folder is whole
    reports = []
    train(plan(store, folder), resume=True, on_report=reports.append)
    # With an interval of 0 every step is saved: the kill may cost the step in work.
    assert reports[0].samples >= 112
    assert_same_state(folder, finished)


def test_a_longer_budget_can_be_given_on_resuming(store, stopped):
    reports = []
    with pytest.raises(KeyboardInterrupt):
        train(plan(store, stopped, samples=640), True, lambda r: (reports.append(r), Stop(1)(r)))
    assert (reports[0].samples, reports[0].spent) == (48, 48 / 640)
    # The metrics of the first session are still known before the second has measured.
    assert set(reports[0].metrics) == {"tf_rmse", "opacity_rmse", "rmse"}


def test_a_finished_run_is_not_resumed(finished, store):
    with pytest.raises(TrainingError, match="is finished"):
        train(plan(store, finished), resume=True)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (
            lambda h: h["recipe"]["options"].update(old_loss=5.0),
            r"options\.old_loss 5\.0, not None",
        ),
        (lambda h: h["recipe"].update(samples_stored=64), "samples_stored 64, not 160"),
        (lambda h: h.clear(), "cannot be resumed"),
        # A volume's name is for people.
        (lambda h: h["recipe"]["scene"].update(volume_name="renamed"), None),
    ],
)
def test_a_run_goes_on_by_the_recipe_that_it_has_begun_with(store, stopped, change, error):
    path = stopped / "training.json"
    header = json.loads(path.read_text())
    change(header)
    path.write_text(json.dumps(header))
    if error is not None:
        with pytest.raises(TrainingError, match=error):
            train(plan(store, stopped), resume=True)
    else:
        with pytest.raises(KeyboardInterrupt):
            train(plan(store, stopped), resume=True, on_report=Stop(1))
        assert load_progress(stopped)[0].samples == 3 * 16


def test_damaged_tensors_are_said(store, stopped):
    (tensors,) = stopped.glob("training-*.safetensors")
    tensors.write_bytes(tensors.read_bytes()[:1000])
    with pytest.raises(TrainingError, match="cannot be resumed"):
        train(plan(store, stopped), resume=True)


torchrun_only = pytest.mark.skipif(sys.platform == "win32", reason="gloo under torchrun")


def torchrun(*arguments):
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path.cwd())}
    done = subprocess.run(
        [*command, *arguments],
        env=environment,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        timeout=300,
    )
    assert done.returncode == 0, done.stderr


STEP = """
import torch
from model.networks.generator_network import EncodedInputs
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training import parallel
from model.training.batch import EncodedBatch
from model.training.codec_loss import CodecLoss
from model.training.options import TrainingOptions
from model.training.stage import Setup
from model.training.stages import OpacityStage

with parallel.process_group(torch.device("cpu")) as device:
    rank, options = parallel.rank(), TrainingOptions(adversarial_start=0.0)
    assert parallel.from_first((3.0 + rank, rank == 0)) == (3.0, True)
    assert (parallel.own_stage(1) == 1) == (rank == 0)
    torch.manual_seed(0)
    loss = CodecLoss(Scene("none", "", (0.0, 1.0), (0.0, 1.0), 16), options)
    stage = OpacityStage(Setup(NetworkSize(0.125, 16, 16), 5, options, loss, device))
    torch.manual_seed(8 + rank)
    inputs = EncodedInputs(torch.rand(8, 5), torch.rand(8, 256), torch.rand(8, 3, 256))
    stage.step(EncodedBatch(inputs, torch.rand(8, 1, 16, 16), torch.rand(8, 3, 16, 16)), 0.5)
    for network in (stage.generator, stage.discriminator):
        own = torch.cat([each.detach().ravel() for each in network.parameters()])
        assert torch.equal(parallel.from_first(own), own)
"""


@torchrun_only
@pytest.mark.slow
def test_weights_stay_equal_where_each_process_sees_other_samples(tmp_path):
    (tmp_path / "step.py").write_text(STEP)
    torchrun(str(tmp_path / "step.py"))


@torchrun_only
@pytest.mark.slow
def test_train_runs_under_torchrun(tmp_path, volume):
    raw = tmp_path / f"blobs_{'x'.join(map(str, volume.dimensions))}_uint8.raw"
    np.asarray(volume.voxels).tofile(raw)
    run = tmp_path / "run"
    arguments = ("main.py", "train", "--volume", str(raw), "--preset", "draft", "--out", str(run))
    torchrun(*arguments, "--samples", "128")
    card = load_card(run)
    # Two processes with 8 samples each: 16 at a step.
    assert card.training["samples_seen"] == 128
    assert [int(row["samples"]) for row in card.training["curve"]] == [128]
    load_model(run)
