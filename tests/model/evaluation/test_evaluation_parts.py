"""How an evaluation's parts follow from the number of its samples."""

from __future__ import annotations

from pathlib import Path

import pytest

from model.evaluation.forecast import EvaluationParts
from model.evaluation.job import EvaluationJob
from model.generator.catalog import shipped_models
from model.networks.card import ModelCard, load_card


@pytest.fixture(scope="module")
def card() -> ModelCard:
    return load_card(shipped_models()[0])


@pytest.mark.parametrize(
    ("count", "neighbors", "compared", "differentiated"),
    [(2000, 2000, 50, 200), (9000, 2000, 50, 200), (20, 20, 5, 5), (200, 200, 5, 20), (3, 3, 3, 3)],
)
def test_all_parts_go_with_the_count(
    card: ModelCard, count: int, neighbors: int, compared: int, differentiated: int
) -> None:
    job = EvaluationJob(Path("model"), count=count)
    assert job.parts(card, None, at_hand=True) == EvaluationParts(
        count, neighbors, count + neighbors, compared, differentiated
    )


def test_what_is_given_or_stored_does_not_follow_the_count(card: ModelCard) -> None:
    job = EvaluationJob(Path("model"), count=20, neighbors=70, sensitivities=30)
    assert job.parts(card, None, at_hand=True) == EvaluationParts(20, 70, 90, 5, 30)
    assert job.parts(card, 400, at_hand=True) == EvaluationParts(20, 400, 0, 5, 30)
    assert job.parts(card, 400, at_hand=False) == EvaluationParts(20, 400, 0, 0, 0)
    none = EvaluationJob(Path("model"), count=20, sensitivities=0)
    assert none.parts(card, None, at_hand=True).differentiated == 0
