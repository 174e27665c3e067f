"""Connections to a Dask scheduler, or to a local cluster of processes."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from distributed import Client, LocalCluster, Security, rpc

from model.errors import DatasetError

LOCAL = "local"
"""Stands for a cluster of processes on this machine, instead of a scheduler's address."""

CONNECT_SECONDS = 10.0
"""Timeout for a scheduler's answer."""


@contextmanager
def connected(scheduler: str, workers: int) -> Iterator[Client]:
    """Connect to a scheduler, or start a local cluster of processes.

    Parameters
    ----------
    scheduler : str
        A scheduler's address such as ``tcp://host:8786``, or ``local``.
    workers : int
        Number of processes of a local cluster.

    Yields
    ------
    distributed.Client

    Raises
    ------
    DatasetError
        When no scheduler answers at the address.
    """
    if scheduler == LOCAL:
        with (
            environment_kept(),
            _local_cluster(workers) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            yield client
        return
    try:
        asyncio.run(asyncio.wait_for(_identify(scheduler), CONNECT_SECONDS))
        client = Client(scheduler, timeout=CONNECT_SECONDS, set_as_default=False)
    except Exception as error:  # a foreign server's answers may cause any error
        raise DatasetError(
            f"No Dask scheduler answers at '{scheduler}'; start one with 'dask scheduler' "
            "and give the address that it prints, such as tcp://host:8786."
        ) from error
    with client:
        yield client


def _local_cluster(workers: int) -> LocalCluster:
    with _interrupts_held_back():
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=None,
            dashboard_address=None,
            # By default it uses port 8787, which may be occupied by another cluster.
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
            silence_logs=logging.CRITICAL,
        )


@contextmanager
def environment_kept() -> Iterator[None]:
    """Restore the environment variables afterwards; Dask limits numerical libraries' threads."""
    before = dict(os.environ)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Block SIGINT in processes started in this context, so that only this process handles it."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker  # not on Windows

    # Otherwise multiprocessing starts it with the first process, and unblocks the signal.
    resource_tracker.ensure_running()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


async def _identify(address: str) -> None:
    """Raise an error unless there is a scheduler; a client would wait for it endlessly."""
    arguments = Security().get_connection_args("client")
    async with rpc(address, timeout=CONNECT_SECONDS, connection_args=arguments) as server:
        identity = await server.identity()
    if identity["type"] != "Scheduler":
        raise ValueError(f"{address} is the address of a {identity['type']}")
