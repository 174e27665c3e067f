import json
from dataclasses import replace

import pytest

from model.errors import TrainingError
from model.training.options import Budget, TrainingOptions


def test_options_survive_json():
    options = TrainingOptions(opacity_time_share=0.25, seed=9)
    assert TrainingOptions.from_json(json.loads(json.dumps(options.to_json()))) == options


def test_a_budget_is_spent_in_its_own_unit():
    assert Budget(minutes=2.0).spent(seconds=30.0, samples=10**9) == 0.25
    assert Budget(samples=200).spent(seconds=1e9, samples=50) == 0.25


@pytest.mark.parametrize(
    ("minutes", "samples"), [(None, None), (1.0, 1), (0.0, None), (None, -5), (float("nan"), None)]
)
def test_impossible_budgets_are_refused(minutes, samples):
    with pytest.raises(TrainingError):
        Budget(minutes, samples)


def test_settings_change_single_options():
    changed = TrainingOptions().with_settings(
        ["l1_weight=50", "joint.learning_rate = 5e-4", "joint.batch_size=8", "kaiming_init=false"]
    )
    expected = replace(
        TrainingOptions(),
        l1_weight=50.0,
        joint=replace(TrainingOptions().joint, learning_rate=5e-4, batch_size=8),
        kaiming_init=False,
    )
    assert changed == expected


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("l2_weight=1", "no 'l2_weight'; it has.*joint.batch_size"),
        ("joint=3", "no 'joint'"),
        ("joint.rate=3", "no 'joint.rate'"),
        ("l1_weight.x=3", "no 'l1_weight.x'"),
        ("l1_weight=many", "give a number, as now 150"),
        ("l1_weight", "give a number"),
        ("l1_weight=nan", "give a number"),
        ("joint.batch_size=2.5", "give a number, as now 32"),
        ("kaiming_init=1", "true or false"),
        ("average_decay=2", "from 0 to below 1"),
        ("adversarial_start=2", "."),
        ("opacity_time_share=0", "."),
        ("beta2=1", "."),
        ("unrendered_tfs=-1", "."),
        ("l1_weight=-1", "."),
        ("joint.batch_size=1", "at least 2"),
        ("joint.learning_rate=0", "above 0"),
        ("joint.halvings=-1", "not be negative"),
    ],
)
def test_settings_that_make_no_sense_are_refused(setting, words):
    with pytest.raises(TrainingError, match=words):
        TrainingOptions().with_settings([setting])
