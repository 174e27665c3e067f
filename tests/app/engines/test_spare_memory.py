from __future__ import annotations

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from window_fakes import make_request

from app.engines import spare_memory, worker
from app.engines.requests import Request
from app.engines.worker import Mailbox

ROOT = Path(__file__).parents[3]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="of glibc only")
def test_memory_is_given_back() -> None:
    from tests.app.process_size import resident_mb

    # Small blocks, of which every hundredth stays: free() alone returns none of them.
    blocks = [bytearray(20_000) for _ in range(10_000)]
    kept = blocks[::100]
    full = resident_mb()
    del blocks
    spare_memory.give_back_memory()
    assert len(kept) == 100
    assert resident_mb() < full - 100


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="of glibc only")
def test_a_large_block_goes_back_when_it_is_freed() -> None:
    """In a process of its own: glibc learns from what was freed before."""
    program = """
import sys
from app.engines.spare_memory import return_large_blocks
from tests.app.process_size import resident_mb

if sys.argv[1] == "on":
    return_large_blocks()
# What is freed once is kept for later from then on.
for _ in range(2):
    first = bytearray(20_000_000)
    above = bytearray(100_000)  # what lies behind a block keeps it
    full = resident_mb()
    del first
print(full - resident_mb())
"""
    freed = {}
    for switch in ("on", "off"):
        command = [sys.executable, "-c", program, switch]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
        freed[switch] = float(done.stdout)
    assert freed["on"] > 15 > freed["off"]


def test_it_rests_once_after_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "REST_S", 0.05)
    rests: list[float] = []
    box = Mailbox(lambda: rests.append(time.monotonic()))
    taken: list[Request] = []

    def take() -> None:
        while (request := box.take()) is not None:
            taken.append(request)

    thread = threading.Thread(target=take)
    thread.start()
    time.sleep(0.2)
    assert not rests  # nothing was done yet
    for number in range(3):
        box.put(make_request(number))
    time.sleep(0.4)
    # The newest of its channel was taken, and a single rest followed.
    assert (taken[-1].sequence, len(rests)) == (2, 1)
    box.close()
    thread.join(5)
    assert not thread.is_alive()
