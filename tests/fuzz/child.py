"""The child process: reads one file after the other, and says what became of each."""

import hashlib
import os
import re
import sys
import time
import traceback
from pathlib import Path

MEMORY_FACTOR, MEMORY_MARGIN = 3, 200e6
"""A file may take so many times its size, and so many bytes more."""

MOST_MEMORY = 4 << 30  # bytes of address space beyond those of the libraries


def main(pipe, read):
    """Read the files whose paths come through a pipe; send outcome and digest of each."""
    for printed in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), printed)
    from model.errors import TfscopeError

    is_limited = False
    while True:
        path = pipe.recv()
        before = _memory("VmHWM")
        try:
            answer = "read", read(path)
        except TfscopeError as error:
            answer = "refused", str(error)
        except BaseException:
            answer = "error", traceback.format_exc()
        used = _memory("VmHWM") - before
        if is_limited and used > MEMORY_FACTOR * _size(path) + MEMORY_MARGIN:
            answer = "memory", f"{used / 1e6:.0f} MB; {answer}"
        if not is_limited and sys.platform == "linux":
            # The first file is whole, and has all libraries loaded.
            import resource

            limit = _memory("VmSize") + MOST_MEMORY
            resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
            is_limited = True
        pipe.send(answer)


def _size(path):
    files = [path] if path.is_file() else [f for f in path.rglob("*") if f.is_file()]
    return sum(file.stat().st_size for file in files)


def _memory(name):
    """Bytes that the system notes of this process; 0 where it does not."""
    status = Path("/proc/self/status")
    found = re.search(rf"{name}:\s+(\d+)", status.read_text()) if status.is_file() else None
    return int(found[1]) * 1024 if found else 0


def read_volume(path):
    from model.volume_files.source import VolumeSource

    VolumeSource(path=path).read()
    return ""


def read_tf(path):
    from model.scene.transfer_function import TransferFunction

    tf = TransferFunction.load(path)
    tf.opacity.sample()
    tf.color.sample()
    return ""


def read_model(path):
    from model.networks.card import recorded_agreement, recorded_errors
    from model.networks.checkpoint import load_model

    recorded_agreement(path)
    recorded_errors(path)
    weights = load_model(path)[1].state_dict().values()
    return hashlib.sha256(b"".join(value.numpy().tobytes() for value in weights)).hexdigest()


def read_store(path):
    from model.samples.sample_store import SPLITS, SampleStore

    store = SampleStore(path)
    store.require_complete()
    digest = hashlib.sha256()
    for split in SPLITS:
        batch = store.read(split, range(store.count(split)))
        for name in sorted(batch.arrays):
            digest.update(batch.arrays[name].tobytes())
    return digest.hexdigest()


def read_preferences(path):
    from app.state.preferences import KeptFile
    from app.state.settings import Settings, VolumeMemory

    KeptFile(path, Settings if path.name == "settings.json" else VolumeMemory)
    return ""


def read_planted(path):
    """Fail as the file's content says: the fuzz job's own test."""
    from model.errors import VolumeError

    match path.read_bytes():
        case b"refused":
            raise VolumeError("refused")
        case b"error":
            raise KeyError("error")
        case b"crash":
            os.abort()
        case b"hang":
            time.sleep(60)
        case b"memory":
            bytearray(1 << 29)[:: 1 << 12] = bytes(1 << 17)
        case b"altered":
            return "other"
    return "same"
