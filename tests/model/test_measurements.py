import os

from model import measurements


def test_processors_are_those_that_a_container_may_use(tmp_path, monkeypatch):
    quota = tmp_path / "cpu.max"
    monkeypatch.setattr(measurements, "QUOTA", quota)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: set(range(8)), raising=False)
    assert measurements.processors() == 8
    for text, count in (("max 100000", 8), ("250000 100000", 3), ("1000 100000", 1), ("", 8)):
        quota.write_text(text)
        assert measurements.processors() == count
