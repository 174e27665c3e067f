import math
import subprocess
import sys
import threading

import numpy as np
import pytest
from sklearn.decomposition import PCA
from toy_codec import ToyCodec

from model.errors import LatentError
from model.latent.codes import samples_of
from model.latent.embedding import EmbeddingProcess, normalized, principal_places, standardized
from model.latent.latent_map import LatentMap, blended_code, cell_means


@pytest.fixture
def latent_map():
    codes = np.random.default_rng(0).uniform(-1, 1, (500, 2)).astype(np.float32)
    # The map is the plane of codes itself, twice as high.
    return LatentMap(samples_of(ToyCodec(), codes), codes * (1, 2), is_final=True)


def test_nearest_samples_are_those_of_a_plain_search(latent_map):
    code = np.array([0.2, -0.4], dtype=np.float32)
    steps = (latent_map.codes - code) / latent_map.codes.std(axis=0)
    expected = np.argsort(np.linalg.norm(steps, axis=1))[:9]
    assert latent_map.nearest(code, 9).tolist() == expected.tolist()
    assert latent_map.distances(code) == pytest.approx(np.linalg.norm(steps, axis=1), rel=1e-5)
    assert len(latent_map.nearest(code, 10_000)) == 500


def test_new_codes_are_placed_among_their_neighbours(latent_map):
    for code in ((0.2, -0.4), (-0.7, 0.6)):
        x, y = latent_map.place(np.array(code))
        assert (x, y) == pytest.approx((code[0], 2 * code[1]), abs=0.1)


@pytest.fixture
def codes():
    return np.random.default_rng(1).normal(size=(400, 3)).astype(np.float32)


@pytest.fixture
def places():
    return np.random.default_rng(2).uniform(-1, 1, (400, 2)).astype(np.float32)


def test_shepard_weights(codes, places):
    radius = LatentMap(None, places, is_final=True).radius
    assert radius == pytest.approx(0.05 * math.dist(places.min(axis=0), places.max(axis=0)))
    for x, y in ((0.1, 0.2), (-0.4, 0.9), (0.99, -0.99)):
        weights = []
        for px, py in places.astype(np.float64).tolist():
            d = math.hypot(px - x, py - y)
            weights.append(math.exp(-(d**2) / (radius / 3) ** 2) if d <= radius else 0.0)
        expected = np.array(weights) @ codes.astype(np.float64) / sum(weights)
        blend = blended_code(codes, places, (x, y), radius)
        assert blend.code == pytest.approx(expected, rel=1e-5)
        assert blend.samples == sum(weight > 0 for weight in weights)


def test_discs_that_are_empty_and_samples_at_one_place_or_at_the_rim(codes, places):
    blend = blended_code(codes, places, (7.0, 7.0), 0.1)
    nearest = np.square(places.astype(np.float64) - 7.0).sum(axis=1).argmin()
    assert blend.samples == 0
    assert blend.code == pytest.approx(codes[nearest])
    same = np.full((400, 2), 0.3, dtype=np.float32)
    assert LatentMap(None, same, is_final=True).radius == 0
    blend = blended_code(codes, same, (0.3, np.float32(0.3)), 1e-6)
    assert blend.code == pytest.approx(codes.mean(axis=0, dtype=np.float64), abs=1e-6)
    # All samples a thousand bandwidths away: the plain formula is 0 / 0.
    rim = np.array([[1.0, 0.0], [1.001, 0.0]], dtype=np.float32)
    assert np.isfinite(blended_code(codes[:2], rim, (0.0, 0.0), 3e-3 * 1000).code).all()


def test_cell_means(codes, places):
    left, lower, right, upper = brush = (-0.5, -0.2, 0.7, 0.6)
    cells = cell_means(codes, places, brush)
    for row in range(4):
        for column in range(4):
            x0, x1 = (left + (right - left) * (column + i) / 4 for i in (0, 1))
            y0, y1 = (upper - (upper - lower) * (row + i) / 4 for i in (1, 0))
            x, y = places.astype(np.float64).T
            inside = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
            assert cells.count[row, column] == inside.sum() > 0
            mean = codes[inside].mean(axis=0, dtype=np.float64)
            assert cells.codes[row, column] == pytest.approx(mean, rel=1e-5, abs=1e-6)
            middle = places[inside].mean(axis=0, dtype=np.float64)
            assert cells.places[row, column] == pytest.approx(middle, abs=1e-6)
    # Empty cells have no code.
    cells = cell_means(codes[:1], np.full((1, 2), 0.9, np.float32), (0, 0, 1, 1))
    assert cells.count.sum() == cells.count[0, 3] == 1
    assert np.isnan(cells.codes[3, 0]).all()
    with pytest.raises(LatentError, match="not finite"):
        cell_means(codes, places, (0, 0, float("nan"), 1))


@pytest.fixture
def clusters():
    """Two clusters, far from each other."""
    rng = np.random.default_rng(0)
    centres = np.repeat([[0.0], [8.0]], 40, axis=0)
    return (centres + rng.normal(size=(80, 5))).astype(np.float32)


def test_principal_places_are_those_of_scikit_learn(clusters):
    found = principal_places(clusters)
    expected = normalized(PCA(2).fit_transform(standardized(clusters)))
    signs = np.sign((found * expected).sum(axis=0))
    assert found == pytest.approx(expected * signs, abs=1e-4)
    assert np.abs(found).max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    "clusters",
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
def test_degenerate_codes_are_refused_before_a_process_starts(clusters):
    for attempt in (principal_places, EmbeddingProcess):
        with pytest.raises(LatentError):
            attempt(clusters.astype(np.float32))


def test_tsne_keeps_clusters_apart_and_tells_its_progress(clusters):
    noted = []
    places = EmbeddingProcess(clusters).run(noted.append)
    assert noted == sorted(noted)
    assert noted[-1] == 1.0
    one, other = places[:40], places[40:]
    within = max(np.linalg.norm(part - part.mean(axis=0), axis=1).max() for part in (one, other))
    assert np.linalg.norm(one.mean(axis=0) - other.mean(axis=0)) > within


def test_a_cancelled_process_ends_without_a_map():
    clusters = np.random.default_rng(0).normal(size=(3000, 6)).astype(np.float32)
    process = EmbeddingProcess(clusters)
    found = ["nothing yet"]
    thread = threading.Thread(target=lambda: found.__setitem__(0, process.run()))
    thread.start()
    process.cancel()
    thread.join(20)
    assert not thread.is_alive()
    assert found == [None]


def test_a_process_that_crashes_is_an_error(clusters, monkeypatch):
    start = subprocess.Popen

    def crash(_command, **options):
        return start([sys.executable, "-c", "import os; os.abort()"], **options)

    monkeypatch.setattr(subprocess, "Popen", crash)
    with pytest.raises(LatentError, match="cannot be computed"):
        EmbeddingProcess(clusters).run()
