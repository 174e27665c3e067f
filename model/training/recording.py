"""Recording of passes of a GPU that are always the same, as CUDA graphs."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from model.training.batch import EncodedBatch

FIRST_PASSES = 3
"""Number of passes before the recorded one, in which libraries choose what they need."""


class RecordedPass:
    """A pass over batches of one size, recorded once and then repeated without Python.

    Parameters
    ----------
    run : callable
        Maps a batch to a tensor of results. It must not copy anything from or to the CPU, nor
        depend on numbers that change, but for those in tensors that stay where they are.
    """

    def __init__(self, run: Callable[[EncodedBatch], Tensor]) -> None:
        self._run = run
        self._passes = 0
        self._recorded: tuple[torch.cuda.CUDAGraph, EncodedBatch, Tensor] | None = None

    def run(self, batch: EncodedBatch) -> Tensor:
        """Make the pass over a batch; its results are valid until the next pass."""
        if self._recorded is not None and len(self._recorded[1]) != len(batch):
            # Another size of batches: a run that was resumed, or its last batch.
            self._recorded, self._passes = None, 0
        if self._recorded is None and self._passes < FIRST_PASSES:
            self._passes += 1
            return self._beside(batch)
        if self._recorded is None:
            graph, kept = torch.cuda.CUDAGraph(), batch.map(torch.clone)
            # Other threads prepare batches on the same GPU meanwhile.
            with torch.cuda.graph(graph, capture_error_mode="thread_local"):
                result = self._run(kept)
            self._recorded = graph, kept, result
        graph, kept, result = self._recorded
        for ours, theirs in zip(kept.tensors, batch.tensors, strict=True):
            ours.copy_(theirs)
        graph.replay()
        return result

    def _beside(self, batch: EncodedBatch) -> Tensor:
        # On a stream of its own, as recordings are.
        stream: torch.cuda.Stream = torch.cuda.Stream()  # type: ignore[no-untyped-call]
        current = torch.cuda.current_stream()
        stream.wait_stream(current)
        with torch.cuda.stream(stream):
            result = self._run(batch)
        current.wait_stream(stream)
        return result
