import json
from dataclasses import replace

import pytest

from tests.fuzz.formats import FORMATS
from tests.fuzz.job import GOOD, fuzz

HANG = pytest.param("hang", marks=pytest.mark.slow)


@pytest.mark.parametrize(
    "outcome", ["read", "refused", "error", "crash", HANG, "memory", "altered"]
)
def test_every_outcome_is_told_from_the_others(outcome, tmp_path, monkeypatch):
    planted = replace(FORMATS["planted"], mutate=lambda *_: outcome.encode())
    monkeypatch.setitem(FORMATS, "planted", planted)
    limit_s = 3.0 if outcome == "hang" else 60.0
    found = fuzz("planted", 2, 0, tmp_path / "kept", jobs=1, limit_s=limit_s)
    assert found.counts == {outcome: 2}
    kept = sorted((tmp_path / "kept").glob("*/planted"))
    assert len(kept) == (0 if outcome in GOOD else 2)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(FORMATS.keys() - {"planted"}))
def test_mutated_files_are_read_or_refused(name):
    found = fuzz(name, 200, 19)
    assert not found.failures, json.dumps(found.failures[:3], indent=1)[:4000]
