"""Two real processes (gloo, on the CPU) that train one generator."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import safetensors.torch
import torch

from model.networks.card import load_card
from model.networks.checkpoint import load_model
from model.training import parallel

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="gloo under torchrun")


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
import sys
import torch
from model.training.batch import EncodedBatch
from model.networks.generator_network import EncodedInputs
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training import parallel
from model.training.codec_loss import CodecLoss
from model.training.options import TrainingOptions
from model.training.stage import Setup
from model.training.stages import OpacityStage
import safetensors.torch

with parallel.process_group(torch.device("cpu")) as device:
    rank = parallel.rank()
    torch.manual_seed(0)
    size = NetworkSize(0.125, 16, 16)
    options = TrainingOptions(adversarial_start=0.0)
    loss = CodecLoss(Scene('none', '', (0.0, 1.0), (0.0, 1.0), 16), options)
    stage = OpacityStage(Setup(size, 5, options, loss, device))
    assert parallel.from_first((3.0 + rank, rank == 0)) == (3.0, True)
    assert (parallel.own_stage(1) == 1) == (rank == 0)
    for name in ("same", "different"):
        torch.manual_seed(7 if name == "same" else 8 + rank)
        batch = EncodedBatch(
            EncodedInputs(torch.rand(8, 5), torch.rand(8, 256), torch.rand(8, 3, 256)),
            torch.rand(8, 1, 16, 16), torch.rand(8, 3, 16, 16),
        )
        stage.step(batch, 0.5)
    tensors = {f"g.{k}": v for k, v in stage.generator.named_parameters()}
    tensors |= {f"d.{k}": v for k, v in stage.discriminator.named_parameters()}
    tensors = {k: v.detach().contiguous().clone() for k, v in tensors.items()}
    safetensors.torch.save_file(tensors, f"{sys.argv[1]}/{parallel.ranks()}-{rank}.safetensors")
"""


@pytest.mark.slow
def test_weights_stay_equal_and_differ_from_those_of_one_process(tmp_path):
    script = tmp_path / "step.py"
    script.write_text(STEP)
    torchrun(str(script), str(tmp_path))
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path.cwd())}
    subprocess.run([sys.executable, str(script), str(tmp_path)], env=environment, check=True)
    first, second, alone = (
        safetensors.torch.load_file(tmp_path / f"{name}.safetensors")
        for name in ("2-0", "2-1", "1-0")
    )
    assert all(torch.equal(value, second[name]) for name, value in first.items())
    assert any(not torch.allclose(value, alone[name], atol=1e-6) for name, value in first.items())


@pytest.mark.slow
def test_train_runs_under_torchrun(tmp_path, volume):
    raw = tmp_path / f"blobs_{'x'.join(map(str, volume.dimensions))}_uint8.raw"
    np.asarray(volume.scalars).tofile(raw)
    run = tmp_path / "run"
    arguments = ("main.py", "train", "--volume", str(raw), "--preset", "draft", "--out", str(run))
    torchrun(*arguments, "--samples", "128")
    card = load_card(run)
    # Two processes with 8 samples each: 16 at a step.
    assert card.training["samples_seen"] == 128
    assert [int(row["samples"]) for row in card.training["curve"]] == [128]
    load_model(run)


def test_without_torchrun_there_is_one_process():
    assert (parallel.rank(), parallel.ranks(), parallel.own_stage(2)) == (0, 1, 2)
    assert parallel.from_first((1.5, True)) == (1.5, True)
