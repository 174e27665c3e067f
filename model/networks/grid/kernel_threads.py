"""Threads that share the work of the feature grids' kernels."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor


def suits_kernels(features: Tensor) -> bool:
    """Whether the kernels can take features; others go through torch's own operators."""
    return features.device.type == "cpu" and features.dtype == torch.float32


def in_pieces(count: int, work: Callable[[slice], None]) -> None:
    """Have a number of points worked on, a piece by each thread."""
    list(_threads().map(work, _pieces(count)))


def summed_in_pieces(
    count: int, shape: torch.Size, add: Callable[[slice, NDArray[np.float32]], None]
) -> Tensor:
    """The sum of what pieces of a number of points add to zeros of a shape."""

    def total_of(piece: slice) -> NDArray[np.float32]:
        total = np.zeros(shape, dtype=np.float32)
        add(piece, total)
        return total

    # Summed in a fixed order, so that training can be repeated bit for bit.
    total, *others = _threads().map(total_of, _pieces(count))
    for other in others:
        total += other
    return torch.from_numpy(total)


@lru_cache(maxsize=1)
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(torch.get_num_threads(), thread_name_prefix="feature-grid")


def _pieces(count: int) -> list[slice]:
    """As many parts of a number of points as there are threads."""
    bounds = np.linspace(0, count, torch.get_num_threads() + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(bounds)]
