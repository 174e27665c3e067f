"""Training runs of a few seconds, for the tests of this folder."""

import torch
from safetensors.torch import load_file

from model.networks.size import NetworkSize
from model.training.options import Budget, StageOptions, TrainingOptions
from model.training.plan import TrainingPlan
from model.training.sources import StoredSource

SIZE = NetworkSize(0.125, 16, 64)
RECIPE = TrainingOptions(
    opacity=StageOptions(16, 2e-4, 6.0),
    translation=StageOptions(16, 8e-5, 3.75),
    joint=StageOptions(16, 1e-3, 2.0),
    one_stage=False,
    seed=3,
)


def plan(store, folder, samples=160, interval=0.0):
    return TrainingPlan(
        source=StoredSource(store),
        preset="draft",
        size=SIZE,
        options=RECIPE,
        budget=Budget(samples=samples),
        folder=folder,
        device=torch.device("cpu"),
        interval=interval,
    )


class Stop:
    """Presses Ctrl-C after so many steps."""

    def __init__(self, steps):
        self.left = steps

    def __call__(self, report):
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


def assert_same_state(one, other):
    """All networks, averages and optimizers of two finished runs, to the last bit."""
    states = [load_file(next(folder.glob("training-*.safetensors"))) for folder in (one, other)]
    assert states[0].keys() == states[1].keys()
    for name, value in states[0].items():
        assert torch.equal(value, states[1][name]), name
