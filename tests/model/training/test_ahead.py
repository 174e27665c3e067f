"""Batches prepared beforehand: the same ones, in order, with the errors that came up."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
import torch

from model.networks.encoding import EncodedInputs
from model.training.ahead import WAITING, ahead
from model.training.batch import EncodedBatch

CPU = torch.device("cpu")


def batch(number: int) -> EncodedBatch:
    value = torch.full((1, 1), float(number))
    return EncodedBatch(EncodedInputs(value, value, value), value, value)


def test_batches_come_in_order_and_errors_after_them() -> None:
    def some() -> Iterator[EncodedBatch]:
        yield from map(batch, range(5))
        raise ValueError("out of samples")

    found: list[float] = []
    with pytest.raises(ValueError, match="out of samples"):
        found.extend(float(b.image) for b in ahead(some(), CPU))
    # `extend` keeps what came before the error.
    assert found == [0, 1, 2, 3, 4]


def test_no_more_are_taken_than_may_wait_and_the_thread_ends_with_the_iterator() -> None:
    taken: list[int] = []

    def endless() -> Iterator[EncodedBatch]:
        while True:
            taken.append(len(taken))
            yield batch(taken[-1])

    batches = ahead(endless(), CPU)
    assert float(next(batches).image) == 0
    time.sleep(0.05)
    # One is in the thread's hand.
    assert len(taken) <= 1 + WAITING + 1
    batches.close()  # type: ignore[attr-defined]
    (thread,) = (t for t in threading.enumerate() if t.name == "batches")
    thread.join(5)
    assert not thread.is_alive()
