import json

import pytest

from tests.fuzz.child import read_planted
from tests.fuzz.formats import FORMATS, Format
from tests.fuzz.job import GOOD, fuzz

OUTCOMES = ["read", "refused", "error", "memory", "altered", "crash"]


@pytest.mark.parametrize("outcomes", [OUTCOMES, pytest.param(["hang"], marks=pytest.mark.slow)])
def test_every_outcome_is_told_from_the_others(outcomes, tmp_path):
    def make(folder):
        (folder / "planted").write_bytes(b"good")
        return [folder / "planted"]

    left = iter(outcomes)
    kind = Format(make, read_planted, mutate=lambda *_: next(left).encode())
    limit_s = 3.0 if outcomes == ["hang"] else 60.0
    found = fuzz("planted", kind, len(outcomes), 0, tmp_path / "kept", limit_s)
    assert found.counts == dict.fromkeys(outcomes, 1)
    kept = {path.parent.name for path in (tmp_path / "kept").glob("*/planted")}
    assert kept == {f"planted-{n}" for n, each in enumerate(outcomes) if each not in GOOD}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(FORMATS))
def test_mutated_files_are_read_or_refused(name):
    found = fuzz(name, FORMATS[name], 200, 19)
    assert not found.failures, json.dumps(found.failures[:3], indent=1)[:4000]
