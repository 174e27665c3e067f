import subprocess
import sys
import threading

import numpy as np
import pytest
from sklearn.decomposition import PCA

from model.errors import LatentError
from model.latent.embedding import EmbeddingProcess, normalized, principal_places, standardized


@pytest.fixture
def codes():
    """Two clusters, far from each other."""
    rng = np.random.default_rng(0)
    centres = np.repeat([[0.0], [8.0]], 40, axis=0)
    return (centres + rng.normal(size=(80, 5))).astype(np.float32)


def test_principal_places_are_those_of_scikit_learn(codes):
    found = principal_places(codes)
    expected = normalized(PCA(2).fit_transform(standardized(codes)))
    signs = np.sign((found * expected).sum(axis=0))
    assert found == pytest.approx(expected * signs, abs=1e-4)
    assert np.abs(found).max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    "codes",
    [
        np.zeros((50, 4)),
        np.full((50, 4), 3e5) + np.random.default_rng(0).normal(0, 1e-7, (50, 4)),
        np.repeat([[0.0, 1.0], [1.0, 0.0]], 25, axis=0),
        np.ones((1, 8)),
        np.full((10, 2), np.nan),
        np.zeros((0, 8)),
    ],
    ids=["all equal", "nearly equal", "two points", "one point", "not finite", "none"],
)
def test_degenerate_codes_are_refused_before_a_process_starts(codes):
    for attempt in (principal_places, EmbeddingProcess):
        with pytest.raises(LatentError):
            attempt(codes.astype(np.float32))


def test_codes_on_a_line_have_a_map():
    line = np.linspace(0, 1, 30, dtype=np.float32)[:, None] * np.ones((1, 3), dtype=np.float32)
    places = principal_places(line)
    assert np.ptp(places[:, 0]) == pytest.approx(2.0)
    assert places[:, 1] == pytest.approx(0.0, abs=1e-5)
    done = EmbeddingProcess(line).run()
    assert done is not None
    assert np.isfinite(done).all()


def test_tsne_keeps_clusters_apart_and_tells_its_progress(codes):
    noted = []
    places = EmbeddingProcess(codes).run(noted.append)
    assert noted == sorted(noted)
    assert noted[-1] == 1.0
    one, other = places[:40], places[40:]
    within = max(np.linalg.norm(part - part.mean(axis=0), axis=1).max() for part in (one, other))
    assert np.linalg.norm(one.mean(axis=0) - other.mean(axis=0)) > within


def test_a_cancelled_process_ends_without_a_map():
    codes = np.random.default_rng(0).normal(size=(3000, 6)).astype(np.float32)
    process = EmbeddingProcess(codes)
    found = ["nothing yet"]
    thread = threading.Thread(target=lambda: found.__setitem__(0, process.run()))
    thread.start()
    process.cancel()
    thread.join(20)
    assert not thread.is_alive()
    assert found == [None]


def test_a_process_that_crashes_is_an_error(codes, monkeypatch):
    start = subprocess.Popen

    def crash(_command, **options):
        return start([sys.executable, "-c", "import os; os.abort()"], **options)

    monkeypatch.setattr(subprocess, "Popen", crash)
    with pytest.raises(LatentError, match="cannot be computed"):
        EmbeddingProcess(codes).run()
