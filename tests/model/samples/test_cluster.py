from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest
from distributed import LocalCluster

from model.errors import DatasetError
from model.samples.cluster import connected


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("model.samples.cluster.CONNECT_SECONDS", 0.3)


@pytest.fixture
def silent() -> Iterator[str]:
    """The address of a server that takes connections and says nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"


def refuse(address: str) -> None:
    with (
        pytest.raises(DatasetError, match=f"No Dask scheduler answers at '{address}'"),
        connected(address, 1),
    ):
        pass


@pytest.mark.parametrize(
    "address", ["", "host", "host:port", "tcp://127.0.0.1:1", "tls://127.0.0.1:1", "smoke://host:1"]
)
def test_a_wrong_address_is_said(address: str) -> None:
    refuse(address)


def test_a_silent_server_is_not_waited_for(silent: str) -> None:
    refuse(silent)


def test_a_worker_is_no_scheduler() -> None:
    with LocalCluster(
        n_workers=1,
        processes=False,
        protocol="tcp",
        dashboard_address=None,
        scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
    ) as cluster:
        refuse(cluster.workers[0].worker_address)


def test_a_local_cluster_has_the_workers_asked_for_and_one_thread_each() -> None:
    with connected("local", 2) as client:
        client.wait_for_workers(2)
        assert list(client.nthreads().values()) == [1, 1]
