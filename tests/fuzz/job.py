"""The fuzz job: mutates examples of a format, has children read them, and counts."""

import multiprocessing
import random
import shutil
import threading
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.fuzz.child import main
from tests.fuzz.formats import FORMATS

SPAWNED = multiprocessing.get_context("spawn")
START_S = 120.0

GOOD = ("read", "refused")
"""Outcomes that are no defects; the others are error, crash, hang, memory and altered."""


@dataclass
class Outcomes:
    """Numbers of mutations by how they ended, and words on those that failed."""

    counts: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


def fuzz(name, count, seed, keep=None, jobs=2, limit_s=20.0):
    """Read a number of mutated files of a format, the same ones for the same seed.

    Files that fail are kept in a folder, with a report; one that takes longer than
    the limit hangs.
    """
    outcomes, lock = Outcomes(), threading.Lock()
    left = iter(range(count))

    def work():
        with TemporaryDirectory() as folder:
            reader = _Reader(name, Path(folder), seed, limit_s)
            try:
                while True:
                    with lock:
                        index = next(left, None)
                    if index is None:
                        return
                    outcome, report = reader.read_mutated(index)
                    with lock:
                        outcomes.counts[outcome] += 1
                        if outcome not in GOOD:
                            outcomes.failures.append(f"{name} {index}: {outcome}: {report}")
                            if keep is not None:
                                place = keep / f"{name}-{index}"
                                shutil.copytree(reader.folder, place, dirs_exist_ok=True)
                                (place / "report.txt").write_text(f"{outcome}\n{report}")
            finally:
                reader.end()

    threads = [threading.Thread(target=work) for _ in range(jobs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return outcomes


class _Reader:
    """Makes mutated files in a folder, and has a child read them."""

    def __init__(self, name, folder, seed, limit_s):
        self._name, self._seed, self._limit_s = name, seed, limit_s
        self._format = FORMATS[name]
        whole = folder / "whole"
        whole.mkdir()
        self._examples = sorted(self._format.make(whole))
        self.folder = folder / "mutated"
        self._child = None
        self._digests = {path: self._asked(path).get("digest") for path in self._examples}

    def read_mutated(self, index):
        """Return the outcome of a mutated file or folder, and a report."""
        rng = random.Random(f"{self._name} {self._seed} {index}")
        example = rng.choice(self._examples)
        path = self._mutated(example, rng)
        answer = self._asked(path)
        outcome, report = answer["outcome"], answer.get("report", "")
        if outcome == "read" and answer["digest"] != self._digests[example]:
            outcome, report = "altered", "it is read, but what it holds is another"
        return outcome, report

    def end(self):
        if self._child is not None:
            self._child.kill()
            self._child.join()
            self._pipe.close()
            self._child = None

    def _mutated(self, example, rng):
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir()
        path = self.folder / example.name
        if example.is_file():
            path.write_bytes(self._format.mutate(example.read_bytes(), rng))
            return path
        shutil.copytree(example, path)
        files = sorted(f for f in path.rglob("*") if f.is_file())
        suffixes = self._format.suffixes
        file = rng.choice([f for f in files if not suffixes or f.suffix in suffixes])
        if not suffixes and rng.random() < 0.1:
            file.unlink()
        else:
            file.write_bytes(self._format.mutate(file.read_bytes(), rng))
        return path

    def _asked(self, path):
        if self._child is None:
            self._start()
        assert self._child is not None
        try:
            self._pipe.send(path)
            if self._pipe.poll(self._limit_s):
                return self._pipe.recv()
            answer = {"outcome": "hang", "report": f"no answer within {self._limit_s:g} s"}
        except (EOFError, OSError):
            self._child.join()
            answer = {"outcome": "crash", "report": f"the child ended with {self._child.exitcode}"}
        self.end()
        return answer

    def _start(self):
        self._pipe, theirs = SPAWNED.Pipe()
        self._child = SPAWNED.Process(target=main, args=(theirs, self._name))
        self._child.start()
        theirs.close()
        # A whole file first: it has all libraries loaded, which takes seconds.
        self._pipe.send(self._examples[0])
        answer = self._pipe.recv() if self._pipe.poll(START_S) else {"outcome": "hang"}
        if answer["outcome"] != "read":
            raise RuntimeError(f"{self._name}: a whole file cannot be read: {answer}")
