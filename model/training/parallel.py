"""Data-parallel training of one generator by several processes started by ``torchrun``.

Each rank renders its own samples and has its own networks. Gradients are averaged before every
step, so the weights stay equal. The first rank decides, measures and writes. Without a process
group there is one rank, and these functions do nothing.
"""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import torch
from torch import distributed, nn

Value = TypeVar("Value")

MAX_STAGES = 16  # upper limit of a run's stages, to number the sample streams of ranks


@contextmanager
def process_group(device: torch.device) -> Iterator[torch.device]:
    """Join the process group of ``torchrun``, if there is one."""
    if int(os.environ.get("WORLD_SIZE", "1")) == 1:
        yield device
        return
    if device.type == "cuda":
        device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
        torch.cuda.set_device(device)
    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    try:
        yield device
        # A rank that leaves while another still speaks to it may take that one down.
        distributed.barrier()
    finally:
        distributed.destroy_process_group()


def rank() -> int:
    """Rank of this process, from 0."""
    return distributed.get_rank() if distributed.is_initialized() else 0


def rank_to_be() -> int:
    """Rank assigned to this process by ``torchrun``, available before it joins the group."""
    return int(os.environ.get("RANK", "0"))


def ranks() -> int:
    """Number of processes."""
    return distributed.get_world_size() if distributed.is_initialized() else 1


def own_stage(stage: int) -> int:
    """Number of the sample stream of a stage on this rank; distinct for all stages and ranks."""
    return stage + MAX_STAGES * rank()


def wait_for_all() -> None:
    """Wait until all ranks have called this."""
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


def from_first(value: Value) -> Value:
    """Return the first rank's value, which can be pickled, on all ranks."""
    shared = [value]
    if ranks() > 1:
        distributed.broadcast_object_list(shared, src=0)
    return shared[0]
