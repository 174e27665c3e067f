"""The fuzz job: mutates examples of a format, has a child read them, and counts."""

import multiprocessing
import random
import shutil
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.fuzz.child import main

SPAWNED = multiprocessing.get_context("spawn")
START_S = 120.0

GOOD = ("read", "refused")
"""Outcomes that are no defects; the others are error, crash, hang, memory and altered."""


@dataclass
class Outcomes:
    """Numbers of mutations by how they ended, and words on those that failed."""

    counts: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


def fuzz(name, kind, count, seed=0, keep=None, limit_s=20.0):
    """Read mutated files of a format, the same ones by seed; keep those that fail or hang."""
    found, child = Outcomes(), None
    with TemporaryDirectory() as folder:
        whole, place = Path(folder, "whole"), Path(folder, "mutated")
        whole.mkdir()
        examples = sorted(kind.make(whole))
        digests = {}
        for index in range(count):
            if child is None:
                child = _Child(kind.read)
                # Whole files first: they have all libraries loaded, which takes seconds.
                for path in examples:
                    outcome, digests[path] = child.asked(path, START_S)
                    assert outcome == "read", (name, path, digests[path])
            rng = random.Random(f"{name} {seed} {index}")
            example = rng.choice(examples)
            path = _mutated(kind, example, place, rng)
            outcome, report = child.asked(path, limit_s)
            if outcome in ("hang", "crash"):
                child.end()
                child = None
            elif outcome == "read" and report != digests[example]:
                outcome, report = "altered", "it is read, but what it holds is another"
            found.counts[outcome] += 1
            if outcome not in GOOD:
                found.failures.append(f"{name} {index}: {outcome}: {report}")
                if keep is not None:
                    kept = shutil.copytree(place, keep / f"{name}-{index}", dirs_exist_ok=True)
                    (kept / "report.txt").write_text(f"{outcome}\n{report}")
    if child is not None:
        child.end()
    return found


def _mutated(kind, example, place, rng):
    """Put a mutation of a file or folder into an empty place."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    path = place / example.name
    if example.is_file():
        path.write_bytes(kind.mutate(example.read_bytes(), rng))
        return path
    shutil.copytree(example, path)
    files = sorted(f for f in path.rglob("*") if f.is_file())
    file = rng.choice([f for f in files if not kind.suffixes or f.suffix in kind.suffixes])
    if not kind.suffixes and rng.random() < 0.1:
        file.unlink()
    else:
        file.write_bytes(kind.mutate(file.read_bytes(), rng))
    return path


class _Child:
    """A process that reads files."""

    def __init__(self, read):
        self._pipe, theirs = SPAWNED.Pipe()
        self._process = SPAWNED.Process(target=main, args=(theirs, read))
        self._process.start()
        theirs.close()

    def asked(self, path, limit_s):
        try:
            self._pipe.send(path)
            if self._pipe.poll(limit_s):
                return self._pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            return "crash", f"the child ended with {self._process.exitcode}"
        return "hang", f"no answer within {limit_s:g} s"

    def end(self):
        self._process.kill()
        self._process.join()
        self._pipe.close()
