"""Rendering of a store on a cluster, with Dask distributed.

Workers need no shared file system: they return the samples of one block, and this
process writes them. The volume is sent once and copied by Dask from worker to
worker, also to workers that join later. Dask repeats the tasks of a lost worker on
others; if all workers with the volume are lost, it is sent again.
"""

from __future__ import annotations

import os
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass, fields
from math import inf
from queue import Empty, SimpleQueue
from time import monotonic

from distributed import Client, Future, KilledWorker

from model.errors import DatasetError, RenderError, TfscopeError
from model.samples.cluster import connected
from model.samples.cluster_worker import render_block_by_value
from model.samples.sample_store import SPLITS, SampleBatch, SampleStore
from model.samples.sampling import Split
from model.scene.volume import Volume

POLL_SECONDS = 1.0
"""Interval of counting the workers."""

TASKS_PER_THREAD = 3
"""Submitted blocks per worker thread: one running, one queued, one at the scheduler."""

RETRIES = 2
"""Number of retries of a failed block, possibly on other machines."""

MAX_LOSSES = 3
"""Number of times a block may be lost with the volume, before it is blamed for it."""

Block = tuple[Split, range]


def render_store_on_cluster(
    store: SampleStore,
    volume: Volume,
    scheduler: str,
    workers: int | None = None,
    on_progress: Callable[[int], None] = lambda count: None,
    patience: float = 300.0,
) -> None:
    """Render a store's missing samples on the workers of a Dask scheduler.

    The samples are the same as those rendered by one process.

    Parameters
    ----------
    scheduler : str
        A scheduler's address such as ``tcp://host:8786``, or ``local`` for a
        cluster of processes on this machine.
    workers : int, optional
        Number of processes of a local cluster, one per processor by default.
    on_progress : callable
        Called with the number of new samples after each block.
    patience : float
        Seconds without a worker after which rendering fails.

    Raises
    ------
    DatasetError
        When no scheduler answers, no worker joins, or a worker lacks tfscope.
    RenderError
        When workers end repeatedly while rendering a block.
    TfscopeError
        The error of a block that fails repeatedly.
    """
    waiting = deque((split, b) for split in SPLITS for b in store.missing_blocks(split))
    if not waiting:
        return
    workers = min(workers or os.cpu_count() or 1, len(waiting))
    with connected(scheduler, workers) as client:
        for (split, block), batch in _Run(client, store, volume, waiting, patience).batches():
            store.write_block(split, block, batch)
            on_progress(len(batch))


@dataclass(frozen=True)
class _Task:
    """A submitted block, and the volume that it was submitted with."""

    block: Block
    future: Future
    volume: Future

    def __str__(self) -> str:
        split, block = self.block
        return f"samples {block.start} to {block.stop - 1} of the split '{split}'"


class _Run:
    """Rendering of one store on a cluster: its waiting and its submitted blocks."""

    def __init__(
        self,
        client: Client,
        store: SampleStore,
        volume: Volume,
        waiting: deque[Block],
        patience: float,
    ) -> None:
        self._client = client
        self._order = (volume.fingerprint, store.scene.to_json(), store.seed)
        # Plain data only, which needs no tfscope to be unpickled; no image shows the file's facts.
        self._data = {
            f.name: getattr(volume, f.name)
            for f in fields(volume)
            if f.name not in ("file", "stored")
        }
        self._volume: Future | None = None
        self._waiting = waiting
        self._running: dict[str, _Task] = {}
        self._done: SimpleQueue[str] = SimpleQueue()
        self._losses: Counter[Block] = Counter()
        self._threads = 0
        self._patience = patience
        self._last_served = monotonic()

    def batches(self) -> Iterator[tuple[Block, SampleBatch]]:
        """Yield each block with its samples once it is rendered, in any order."""
        last_count = -inf
        while self._waiting or self._running:
            if monotonic() - last_count >= POLL_SECONDS:
                self._count_workers()
                last_count = monotonic()
            self._submit()
            try:
                task = self._running.pop(self._done.get(timeout=POLL_SECONDS))
            except Empty:
                continue
            try:
                batch = self._result(task)
            except CancelledError:
                self._put_back(task)
            else:
                yield task.block, batch

    def _count_workers(self) -> None:
        try:
            self._threads = sum(self._client.nthreads().values())
        except (OSError, RuntimeError, AttributeError) as error:  # the last by a closed client
            raise DatasetError(
                "The Dask scheduler answers no longer; "
                "start it again and start rendering again to go on."
            ) from error
        if self._threads and self._volume:
            self._last_served = monotonic()
        elif monotonic() - self._last_served > self._patience:
            raise self._no_workers()

    def _submit(self) -> None:
        """Submit enough blocks to keep all workers busy, sending the volume if necessary."""
        if self._threads and not self._volume:
            # If all workers have been lost meanwhile, the next round tries again.
            with suppress(OSError):
                [self._volume] = self._client.scatter(
                    [self._data], broadcast=True, hash=False, timeout=POLL_SECONDS
                )
        render = render_block_by_value()
        room = TASKS_PER_THREAD * self._threads - len(self._running)
        while self._volume and self._waiting and room > 0:
            block = self._waiting.popleft()
            arguments = (self._volume, *self._order, *block)
            future = self._client.submit(render, *arguments, pure=False, retries=RETRIES)
            self._running[future.key] = _Task(block, future, self._volume)
            future.add_done_callback(lambda done: self._done.put(done.key))
            room -= 1

    def _put_back(self, task: _Task) -> None:
        """Return a block to the queue that was lost with the last copy of the volume."""
        self._losses[task.block] += 1
        if self._losses[task.block] > MAX_LOSSES:
            raise _deadly(task)
        self._waiting.appendleft(task.block)
        if task.volume is self._volume:
            self._volume = None

    def _result(self, task: _Task) -> SampleBatch:
        try:
            return task.future.result(timeout=self._patience)
        except (TfscopeError, CancelledError):
            raise
        except KilledWorker as error:
            raise _deadly(task) from error
        except ModuleNotFoundError as error:
            raise DatasetError(
                f"A Dask worker has no module '{error.name}'; start workers from this tfscope's "
                "folder and with its Python: 'python -m dask worker ADDRESS'."
            ) from error
        except Exception as error:
            if task.future.status != "error":
                # The samples were lost with their worker after rendering, and no other joined.
                raise self._no_workers() from error
            raise RenderError(
                f"A Dask worker cannot render {task} ({type(error).__name__}: {error}); "
                "see its log, and start again to go on."
            ) from error

    def _no_workers(self) -> DatasetError:
        return DatasetError(
            f"No Dask worker was there for {self._patience:g} seconds; "
            "start some for this scheduler and start again to go on."
        )


def _deadly(task: _Task) -> RenderError:
    return RenderError(
        f"Dask workers ended time and again while they had {task} (out of memory?); "
        "give each more memory and start again to go on."
    )
