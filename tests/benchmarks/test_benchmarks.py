import numpy as np
import pytest

from model.kernel_cache import KernelGroup
from tests.benchmarks import extremes, motion, networks, path_light, renderers, sensitivity
from tests.benchmarks.opening import distinct


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Options of a volume of bytes that a benchmark is done with at once."""
    path = tmp_path_factory.mktemp("volumes") / "ramp_20x18x16_uint8.raw"
    path.write_bytes(24 * bytes(range(240)))
    return f"--volume {path} --size 16".split()


@pytest.fixture
def windows(qapp, monkeypatch):
    """Windows compile the kernels that they use, and start no processes that compile others."""
    monkeypatch.setattr(KernelGroup, "is_prepared", True)


def test_all_tables_are_printed(small, capsys):
    for benchmark in (renderers, sensitivity):
        benchmark.main([*small, "--count", "1"])
        assert "ramp" in capsys.readouterr().out
    path_light.main([*small, "--samples", "2", "--truth", "2", "--frames", "3"])
    assert "Turning" in capsys.readouterr().out
    networks.main(["--preset", "draft", "--backend", "eager", "--seconds", "0"])
    assert "eager" in capsys.readouterr().out


def test_a_drag_is_measured(small, capsys, windows, monkeypatch):
    monkeypatch.setattr(motion, "QUIET_S", 0.1)
    for what in ("view", "handle"):
        motion.main([*small[:2], "--lighting", "none", "--seconds", "0.2", "--drag", what])
        assert f"{what} dragged" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("kinds", "rows"), [(["--kind", "ordinary"], 1), pytest.param([], 50, marks=pytest.mark.slow)]
)
def test_extremes_are_written_into_their_page_and_nothing_is_infinite(kinds, rows, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(2 * "# Table\n\n{}{}\n".format(*extremes.HERE))
    extremes.main([*kinds, "--out", str(page)])
    text = page.read_text()
    assert text.count("| no extreme |") == 2
    assert "| not finite |" not in text
    assert text.count("\n| ") > 2 * rows


def test_pictures_that_all_differ_are_counted():
    gray = [np.full((4, 4, 3), level) for level in (0, 0.04, 0.08, 0.3, 0.31)]
    assert distinct(gray) == 3
