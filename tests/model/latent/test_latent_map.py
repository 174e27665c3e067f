import numpy as np
import pytest
from toy_codec import ToyCodec

from model.latent.codes import samples_of
from model.latent.latent_map import LatentMap


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


def test_some_of_the_samples_keep_places_and_disc(latent_map):
    wanted = latent_map.codes[:, 0] > 0.5
    some = latent_map.only(wanted)
    assert (some.places == latent_map.places[wanted]).all()
    assert (some.samples.tfs == latent_map.samples.tfs[wanted]).all()
    assert some.radius == latent_map.radius
    assert latent_map.only(np.ones(500, dtype=bool)) is latent_map
