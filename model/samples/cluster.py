"""Rendering of a store on the workers of a Dask scheduler.

Workers return the samples of a block, and this process writes them. The volume is a task's result:
Dask copies it between workers, and recomputes it if it is lost.
"""

import asyncio
import os
import threading
import warnings
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, fields
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from distributed import Client, Future, KilledWorker, Security, rpc

from model.errors import DatasetError, RenderError, TfscopeError
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sample_store import SPLITS, SampleBatch, SampleStore
from model.samples.sampling import Split
from model.scene.scene import Scene
from model.scene.volume import Volume

CONNECT_SECONDS = 10.0
# One running, one queued, one at the scheduler.
BLOCKS_PER_THREAD = 3

_kept = threading.local()  # a worker's renderers, one per thread, as OpenGL's contexts are


def render_store_on_cluster(
    store: SampleStore,
    volume: Volume,
    scheduler: str,
    on_progress: Callable[[int], None] = lambda count: None,
    patience: float = 300.0,
) -> None:
    """Render a store's missing samples, equal to those rendered by one process."""
    waiting = deque((split, block) for split in SPLITS for block in store.missing_blocks(split))
    if not waiting:
        return
    running: dict[str, tuple[Future, tuple[Split, range]]] = {}
    done: SimpleQueue[Future] = SimpleQueue()
    with _connected(scheduler) as client, warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sending large graph")
        # Plain data, readable without tfscope; images do not depend on the file's metadata.
        data = {f.name: getattr(volume, f.name) for f in fields(volume)}
        data = {name: value for name, value in data.items() if name not in ("file", "stored")}
        sent = client.submit(dict, data, pure=False)
        order = volume.fingerprint, asdict(store.scene), store.seed
        render, served = block_renderer(), monotonic()
        while waiting or running:
            threads = sum(client.nthreads().values())
            served = monotonic() if threads else served
            if monotonic() - served > patience:
                raise DatasetError(
                    f"No Dask worker was there for {patience:g} seconds; "
                    "start some for this scheduler and start again to go on."
                )
            while waiting and len(running) < BLOCKS_PER_THREAD * threads:
                block = waiting.popleft()
                future = client.submit(render, sent, *order, *block, pure=False, retries=2)
                running[future.key] = future, block
                future.add_done_callback(done.put)
            try:
                future = done.get(timeout=1.0)
            except Empty:
                continue
            split, samples = running.pop(future.key)[1]
            batch = _result(future, f"samples {samples.start} to {samples.stop - 1}", patience)
            store.write_block(split, samples, batch)
            on_progress(len(batch))


def block_renderer() -> Callable[..., SampleBatch]:
    """Return :func:`_render_block` by value: without tfscope a task fails, not its worker."""

    def render(*arguments: Any) -> SampleBatch:
        from model.samples.cluster import _render_block

        return _render_block(*arguments)

    return render


def _render_block(
    data: dict[str, Any], fingerprint: str, scene: dict[str, Any], seed: int, *block: Any
) -> SampleBatch:
    made_for = Scene.from_json(scene)
    if getattr(_kept, "made_for", None) != (made_for, fingerprint):
        if renderer := vars(_kept).pop("renderer", None):
            renderer.close()
        # Each thread renders its own blocks; Mesa's threads would compete with them.
        os.environ.setdefault("LP_NUM_THREADS", "1")
        _kept.made_for, _kept.renderer = None, make_renderer(Volume(**data), made_for)
        _kept.made_for = made_for, fingerprint
    return render_samples(_kept.renderer, made_for, seed, *block)


async def _identify(scheduler: str) -> None:
    # A client would wait forever for a silent server.
    security = Security().get_connection_args("client")
    async with rpc(scheduler, timeout=CONNECT_SECONDS, connection_args=security) as server:
        await server.identity()


def _connected(scheduler: str) -> Client:
    try:
        asyncio.run(asyncio.wait_for(_identify(scheduler), CONNECT_SECONDS))
        return Client(scheduler, timeout=CONNECT_SECONDS, set_as_default=False)
    except Exception as error:
        raise DatasetError(
            f"No Dask scheduler answers at '{scheduler}'; start one with 'dask scheduler' "
            "and give the address that it prints, such as tcp://host:8786."
        ) from error


def _result(future: Future, what: str, patience: float) -> SampleBatch:
    try:
        return future.result(timeout=patience)
    except TfscopeError:
        raise
    except KilledWorker as error:
        raise RenderError(
            f"Dask workers ended time and again while they had {what} (out of memory?); "
            "give each more memory and start again to go on."
        ) from error
    except ModuleNotFoundError as error:
        raise DatasetError(
            f"A Dask worker has no module '{error.name}'; start workers from this tfscope's "
            "folder and with its Python: 'python -m dask worker ADDRESS'."
        ) from error
    except Exception as error:
        raise RenderError(
            f"A Dask worker cannot render {what} ({type(error).__name__}: {error}); "
            "see its log, and start again to go on."
        ) from error
