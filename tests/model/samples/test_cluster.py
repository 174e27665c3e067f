"""A store rendered by the workers of a Dask scheduler."""

import logging
import os
import signal
import socket
import time
from contextlib import contextmanager
from unittest import mock

import numpy as np
import pytest
from distributed import Client, LocalCluster

from model.errors import DatasetError, RenderError
from model.samples import cluster as cluster_module
from model.samples.cluster import block_renderer, render_store_on_cluster
from model.samples.sample_store import BLOCK, SPLITS, SampleStore
from model.scene.volume import Volume

TOTAL = 192

posix = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")


@contextmanager
def started(workers):
    with (
        # Dask limits numerical libraries' threads.
        mock.patch.dict(os.environ),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=None,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
            silence_logs=logging.CRITICAL,
        ) as cluster,
    ):
        yield cluster


@pytest.fixture(scope="module")
def cluster():
    """A scheduler and two worker processes, which are restarted when they die."""
    with started(2) as cluster:
        yield cluster


@pytest.fixture
def scheduler(cluster):
    return str(cluster.scheduler_address)


@pytest.fixture
def new(scene, tmp_path):
    """An empty store of what the fixture ``store`` holds, which one process has rendered."""
    return SampleStore.create(tmp_path / "new.zarr", scene, 7, {"train": 160, "holdout": 32})


def assert_equal(one, other):
    one.require_complete()
    for split in SPLITS:
        everything = range(other.count(split))
        batches = [store.read(split, everything).arrays for store in (one, other)]
        np.testing.assert_equal(*batches)


def test_a_wrong_address_is_said(new, volume, monkeypatch):
    monkeypatch.setattr(cluster_module, "CONNECT_SECONDS", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        # It takes connections and says nothing.
        silent = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        for address in ("", "host", "host:port", "tcp://127.0.0.1:1", "tls://127.0.0.1:1", silent):
            with pytest.raises(DatasetError, match=f"No Dask scheduler answers at '{address}'"):
                render_store_on_cluster(new, volume, address)


def test_an_interrupted_run_goes_on_and_makes_the_same_store(store, new, volume, scheduler):
    def interrupt(count):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_store_on_cluster(new, volume, scheduler, on_progress=interrupt)
    seen = []
    render_store_on_cluster(new, volume, scheduler, on_progress=seen.append)
    assert seen == [BLOCK] * (TOTAL // BLOCK - 1)
    assert_equal(new, store)
    render_store_on_cluster(new, volume, "nowhere:1")  # Nothing is missing: nobody is asked.


def blocks_do(patch, work):
    """Let workers do something else than to render; a lambda pickles whole."""
    patch.setattr(cluster_module, "block_renderer", lambda: work)


def all_but_one_wait_for(gate):
    render = block_renderer()
    # Whichever block comes first: a certain one could wait behind another in a worker's queue.
    started = gate.with_name("started")

    def work(*arguments):
        try:
            started.touch(exist_ok=False)
        except FileExistsError:
            while not gate.exists():
                time.sleep(0.01)
        return render(*arguments)

    return work


@posix
def test_a_killed_worker_costs_nothing_but_its_block(
    store, new, volume, cluster, tmp_path, monkeypatch
):
    gate = tmp_path / "gate"
    blocks_do(monkeypatch, all_but_one_wait_for(gate))
    with Client(cluster, set_as_default=False) as client:
        client.wait_for_workers(2)
        processes = client.run(os.getpid)
    seen = []

    def kill_at_first(count):
        seen.append(count)
        if len(seen) == 1:
            workers = cluster.scheduler.workers
            busiest = max(processes, key=lambda address: len(workers[address].processing))
            assert workers[busiest].processing
            os.kill(processes[busiest], signal.SIGKILL)
            gate.touch()

    render_store_on_cluster(new, volume, cluster.scheduler_address, on_progress=kill_at_first)
    assert sum(seen) == TOTAL
    assert_equal(new, store)


def test_an_error_of_a_block_arrives(new, volume, scheduler, monkeypatch):
    other = Volume(np.arange(60, dtype=np.uint8).reshape(3, 4, 5))
    with pytest.raises(DatasetError, match="is not the one"):
        render_store_on_cluster(new, other, scheduler)
    blocks_do(monkeypatch, lambda *arguments: 1 / 0)
    expected = r"cannot render samples \d+ to \d+ \(ZeroDivisionError: division by zero\)"
    with pytest.raises(RenderError, match=expected):
        render_store_on_cluster(new, volume, scheduler)


@posix
def test_blocks_that_kill_their_workers_end_the_run(new, volume, monkeypatch):
    blocks_do(monkeypatch, lambda *arguments: os.kill(os.getpid(), signal.SIGKILL))
    with started(1) as cluster:
        cluster.scheduler.allowed_failures = 0
        with pytest.raises(RenderError, match="ended time and again while they had samples"):
            render_store_on_cluster(new, volume, cluster.scheduler_address)


def test_the_lack_of_workers_is_said(new, volume):
    said = r"No Dask worker was there for 0\.1 seconds"
    with started(0) as cluster, pytest.raises(DatasetError, match=said):
        render_store_on_cluster(new, volume, cluster.scheduler_address, patience=0.1)
