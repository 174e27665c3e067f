import numpy as np
import pytest
import torch

from model.latent.codes import sample_codes
from model.latent.embedding import principal_places
from model.latent.latent_map import LatentMap
from model.networks.generator_network import decode_unit
from model.paper.exploration import DETAIL_SHARE, WHOLE_SHARE, detail, overview, walk
from model.paper.pictures import approach
from model.samples.sampling import draw_opacity_tfs, draw_sample


@pytest.fixture(scope="module")
def map_(subject):
    known = draw_opacity_tfs(subject.generator.scene, 0, 0, 300)
    samples = sample_codes(subject.space.codec, known, 200, 0)
    return LatentMap(samples, principal_places(samples.codes), is_final=True)


def test_two_scales_of_one_map(subject, map_, inputs):
    whole = overview(subject, map_, inputs)
    finer = detail(subject, map_, whole)
    extent = np.ptp(map_.places, axis=0)
    for one, share in ((whole, WHOLE_SHARE), (finer, DETAIL_SHARE)):
        left, lower, right, upper = one.brush
        assert (right - left, upper - lower) == pytest.approx(tuple(share * extent), rel=1e-3)
        assert left <= one.hovered.place[0] <= right and lower <= one.hovered.place[1] <= upper
        expected = subject.generator.render_latent(one.hovered.code, one.inputs)[..., :3]
        np.testing.assert_allclose(one.hovered.image, expected, atol=1e-5)
        codes = torch.from_numpy(one.hovered.code)[None]
        expected = decode_unit(subject.generator.network.codec.decode(codes))[0].detach()
        np.testing.assert_allclose(one.hovered.opacities, expected.numpy(), atol=1e-5)
        means = map_.cells(one.brush)
        for row, column in np.argwhere(means.count > 0):
            picture = subject.generator.render_latent(means.codes[row, column], one.inputs)
            np.testing.assert_allclose(one.cells[row, column], picture[..., :3], atol=1e-5)
        assert np.isnan(one.cells[means.count == 0]).all()
    # From the other side, and nearer.
    assert finer.inputs.view.azimuth - inputs.view.azimuth == 180
    assert finer.inputs.view.distance <= inputs.view.distance


def test_a_walk_visits_places_that_differ(subject, map_, inputs):
    places = walk(subject, map_, inputs, candidates=30)
    assert len(places) == 4
    x = [place.place[0] for place in places]
    assert x == sorted(x)
    assert len({place.place for place in places}) == 4
    images = np.stack([place.image for place in places])
    apart = [np.abs(a - b).mean() for i, a in enumerate(images) for b in images[i + 1 :]]
    chosen = map_.codes[:: len(map_.codes) // 30][:30]
    drawn = subject.generator.render_latent(chosen, inputs)[..., :3]
    # The other half shows less: such pictures differ from the rest, but tell nothing.
    drawn = sorted(drawn, key=np.std)[15:]
    usual = [np.abs(a - b).mean() for i, a in enumerate(drawn) for b in drawn[i + 1 :]]
    assert np.mean(apart) > np.mean(usual)
    # The code of a place is interpolated, so that its picture is not quite one of these.
    assert min(map(np.std, images)) > 0.7 * min(map(np.std, drawn))


def test_the_approach_counts_the_networks_that_the_reference_has(subject, inputs):
    found = approach(subject, inputs)
    assert [name for name, _ in found.networks] == [
        "opacity generator", "opacity discriminator",
        "translation generator", "translation discriminator",
    ]  # fmt: skip
    network = subject.generator.network
    whole = sum(p.numel() for p in network.parameters())
    assert found.networks[0][1] + found.networks[2][1] == whole
    for index, sample in enumerate(found.training):
        expected = draw_sample(subject.generator.scene, subject.seed, "train", index)
        assert sample.inputs == expected
        np.testing.assert_array_equal(sample.image, subject.truth(expected))
