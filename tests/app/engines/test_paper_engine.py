import numpy as np
import pytest
import torch
from lively import SIZE, lively_network
from ramp import make_tf, make_volume

from app.engines.drawer import Drawer
from app.engines.engines import GeneratorEngine
from app.engines.renderer_engine import RendererEngine
from app.engines.requests import UNWATCHED, BatchRequest, Quality, RegionSensitivityRequest
from model.errors import NotOfferedError
from model.generator.generator import Generator
from model.latent.codes import NetworkCodec
from model.networks.card import ModelCard
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.scene import Scene
from model.scene.view import View

VIEW = View(40, 20, 3, 1.0)
INPUTS = SceneInputs.of(VIEW, make_tf())
SMALL = Quality(16)


@pytest.fixture(scope="module")
def engine():
    card = ModelCard(Scene.of(make_volume(), SIZE.image_size), "draft", SIZE)
    return GeneratorEngine(Generator(card, lively_network(), torch.device("cpu")))


@pytest.fixture(scope="module")
def ray_caster():
    return RendererEngine(Drawer(RaycastRenderer(make_volume(), threads=1), 1.0))


def test_codes_are_drawn_as_the_tfs_that_they_are_of(engine):
    assert engine.draws_codes
    other = SceneInputs.of(VIEW, make_tf(140.0))
    tfs = np.stack([one.opacity_tf.sample() for one in (INPUTS, other)])
    codes = tuple(map(tuple, NetworkCodec(engine._generator.network.codec).encode(tfs).tolist()))
    from_codes = BatchRequest(INPUTS, SMALL, (other,), codes).answer(engine, UNWATCHED)
    from_tfs = BatchRequest(INPUTS, SMALL, (other,)).answer(engine, UNWATCHED)
    assert np.abs(from_tfs[0] - from_tfs[1]).max() > 1e-4
    np.testing.assert_allclose(from_codes, from_tfs, atol=1e-5)


def test_the_ray_caster_draws_no_codes(ray_caster):
    assert not ray_caster.draws_codes
    with pytest.raises(NotOfferedError):
        BatchRequest(INPUTS, SMALL, codes=((0.0,) * 8,)).answer(ray_caster, UNWATCHED)


def test_what_is_kept_of_an_image_belongs_to_it(engine):
    other = SceneInputs.of(View(200, -10, 0, 1.0), make_tf(140.0))
    half, whole = Outline.rectangle(0, 0, 0.5, 0.5), Outline()
    asked = [(INPUTS, half, 6.0), (INPUTS, whole, 6.0), (other, whole, 6.0), (INPUTS, half, 9.0)]
    for inputs, region, width in asked:
        request = RegionSensitivityRequest(inputs, SMALL, region, width)
        fresh = GeneratorEngine(engine._generator)
        found = request.answer(engine, UNWATCHED)
        np.testing.assert_allclose(found, request.answer(fresh, UNWATCHED), rtol=1e-5, atol=1e-9)
        assert np.abs(found).max() > 0
