"""Batches prepared for a GPU while it learns from those before."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator

import torch

from model.training.batch import EncodedBatch

WAITING = 2
"""Number of batches that may wait."""


def ahead(batches: Iterator[EncodedBatch], device: torch.device) -> Iterator[EncodedBatch]:
    """Yield batches that a thread takes from an iterator and copies to a GPU beforehand.

    Parameters
    ----------
    batches : iterator of EncodedBatch
        Is ended with the result; an error that it raises is raised here.
    """
    ready: queue.Queue[EncodedBatch | BaseException] = queue.Queue(WAITING)
    ended = threading.Event()

    def prepare() -> None:
        stream: torch.cuda.Stream | None = None
        if device.type == "cuda":
            stream = torch.cuda.Stream(device)  # type: ignore[no-untyped-call]
        try:
            # A stream of its own, as copies would wait for the GPU's present step otherwise.
            with torch.cuda.stream(stream):
                for batch in batches:
                    if stream is not None:
                        stream.synchronize()
                    if not _put(ready, batch, ended):
                        return
        except BaseException as error:
            _put(ready, error, ended)

    thread = threading.Thread(target=prepare, name="batches", daemon=True)
    thread.start()
    try:
        while True:
            found = ready.get()
            if isinstance(found, BaseException):
                raise found
            yield found
    finally:
        ended.set()


def _put(
    ready: queue.Queue[EncodedBatch | BaseException],
    item: EncodedBatch | BaseException,
    ended: threading.Event,
) -> bool:
    """Hand over an item; return False once nobody waits for it any more."""
    while not ended.is_set():
        try:
            ready.put(item, timeout=0.1)
        except queue.Full:
            continue
        return True
    return False
