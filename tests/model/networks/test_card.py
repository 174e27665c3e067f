import pytest

from model.networks.card import KIND_NAMES, error_text, errors_by_kind
from model.scene.random_inputs import SHARES

METRICS = {
    "holdout": {"rmse": 0.0823, "emd": 0.0131},
    "holdout_count": 2000,
    "kinds": {
        "modes": {"count": 800, "rmse": 0.06},
        "step": {"count": 160, "rmse": 0.11},
        "empty": {"count": 40, "rmse": 0.0004},
    },
}


def test_every_kind_of_random_tf_has_a_name():
    assert KIND_NAMES.keys() == SHARES.keys()


def test_the_worst_kind_is_named_first():
    assert list(errors_by_kind(METRICS).items()) == [
        ("steps", 0.11), ("mixtures of modes", 0.06), ("empty", 0.0004),
    ]  # fmt: skip
    assert error_text(METRICS) == (
        "RMSE of 2,000 hold-out images 0.082, colour EMD 0.013; "
        "by kind of TF: steps 0.110, mixtures of modes 0.060, empty 0.000."
    )


@pytest.mark.parametrize(
    "metrics",
    [
        {},
        {"holdout": 3, "kinds": []},
        {"holdout": {"rmse": "small"}, "kinds": {"modes": 0.1, "step": {"rmse": None}}},
        {"holdout": {"rmse": float("nan")}, "kinds": {"modes": {"rmse": float("inf")}}},
        {"holdout": {"rmse": True}},
    ],
)
def test_a_card_without_figures_says_nothing(metrics):
    assert errors_by_kind(metrics) == {}
    assert error_text(metrics) == ""
