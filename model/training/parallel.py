"""Several processes that train one generator, as ``torchrun`` starts them.

Each rank renders its own samples and has its own networks; gradients are
averaged before every step, so that the weights stay equal. The first rank
decides, measures and writes. Without a process group there is one rank, and
nothing here does anything.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import torch
from torch import Tensor, distributed, nn

_alone = ContextVar("alone", default=False)

MAX_STAGES = 16
"""Stages that a run may have: ranks take their samples from numbers that no stage has."""


@contextmanager
def process_group(device: torch.device) -> Iterator[torch.device]:
    """Join the other processes that torchrun has started, if it has started any.

    Yields
    ------
    torch.device
        The one of this rank: each has a GPU of its own.
    """
    if int(os.environ.get("WORLD_SIZE", "1")) == 1:
        yield device
        return
    if device.type == "cuda":
        device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
        torch.cuda.set_device(device)
    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    try:
        yield device
    finally:
        distributed.destroy_process_group()


def rank() -> int:
    """Number of this process, from 0."""
    return distributed.get_rank() if _joined() else 0


def rank_to_be() -> int:
    """Number that torchrun has given this process, also before it has joined the others."""
    return int(os.environ.get("RANK", "0"))


def ranks() -> int:
    """Number of processes."""
    return distributed.get_world_size() if _joined() else 1


@contextmanager
def alone() -> Iterator[None]:
    """For what this process computes for itself: it waits for no other, and sends nothing."""
    token = _alone.set(True)
    try:
        yield
    finally:
        _alone.reset(token)


def _joined() -> bool:
    return distributed.is_initialized() and not _alone.get()


def own_stage(stage: int) -> int:
    """The number by which this rank draws a stage's samples: no two ranks draw the same."""
    return stage + MAX_STAGES * rank()


def wait_for_all() -> None:
    """Go on when all ranks have come here."""
    if ranks() > 1:
        distributed.barrier()


def average_gradients(parameters: Iterable[nn.Parameter]) -> None:
    """Replace each gradient by its mean over the ranks."""
    if ranks() == 1:
        return
    gradients = [p.grad for p in parameters if p.grad is not None]
    # One message instead of one for each tensor.
    flat = torch.cat([g.flatten() for g in gradients])
    distributed.all_reduce(flat)
    flat /= ranks()
    parts = torch.split(flat, [gradient.numel() for gradient in gradients])
    for gradient, part in zip(gradients, parts, strict=True):
        gradient.copy_(part.view_as(gradient))


def from_first(values: list[float], device: torch.device) -> list[float]:
    """The first rank's numbers, on all ranks."""
    if ranks() == 1:
        return values
    shared: Tensor = torch.tensor(values, dtype=torch.float64, device=device)
    distributed.broadcast(shared, src=0)
    return [float(value) for value in shared]
