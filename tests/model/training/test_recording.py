"""Recorded steps of a GPU: the same losses as those of steps that Python starts."""

import pytest
import torch

from model.networks.generator_network import EncodedInputs
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training.batch import EncodedBatch
from model.training.options import TrainingOptions
from model.training.stage import FIRST_PASSES
from model.training.stages import Schedule

SCENE = Scene("none", "", (0.0, 1.0), (0.0, 1.0), 32)
SIZE = NetworkSize(0.125, 16, 32, modulation=True, opacity_modulation=True, deep_codec=True)


def losses_of_steps(device, recorded, count):
    options = TrainingOptions().with_settings(["unrendered_tfs=4", "small_time_share=0"])
    stage = Schedule(SIZE, options, SCENE, device).stages["joint"]
    stage.recorded = recorded
    random = torch.Generator().manual_seed(1)

    def draw(*shape):
        return (2 * torch.rand(8, *shape, generator=random) - 1).to(device)

    found = []
    for number in range(count):
        inputs = EncodedInputs(draw(5), draw(256), draw(3, 256))
        batch = EncodedBatch(inputs, draw(1, 16, 16), draw(3, 32, 32))
        found.append(stage.step(batch, number / count).losses)
    assert stage.steps == count
    return found


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs an NVIDIA GPU")
def test_recorded_steps_learn_what_others_do():
    device = torch.device("cuda")
    count = FIRST_PASSES + 3
    for plain, recorded in zip(
        losses_of_steps(device, False, count), losses_of_steps(device, True, count), strict=True
    ):
        # The random TFs, the rate and the batch are each step's own; sums differ in their order.
        assert recorded == pytest.approx(plain, rel=0.02)


def test_the_losses_of_a_pass_are_those_of_a_step(monkeypatch):
    """Without a GPU: the pass as it would be recorded, made anew each time."""
    monkeypatch.setattr(
        "model.training.stage.RecordedPass.run", lambda self, batch: self._run(batch)
    )
    device = torch.device("cpu")
    plain = losses_of_steps(device, False, 5)
    for one, other in zip(plain, losses_of_steps(device, True, 5), strict=True):
        # Some processors add up in another order.
        assert other == pytest.approx(one, rel=1e-3)
