"""Clean pictures, and the error that is told of them, against many samples."""

from __future__ import annotations

import numpy as np
import pytest

from model.rendering.path_tracing.cleaning import Denoiser, cleaned, error_of
from model.rendering.path_tracing.denoising import available
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.view import View
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

needs_denoiser = pytest.mark.skipif(not available(), reason="no denoiser for this machine")


@pytest.fixture(scope="module")
def jet():
    volume = read_volume(next(p for p in shipped_volumes() if "jet" in p.name))
    tf = default_transfer_function(volume)
    return volume, SceneInputs.of(View(30.0, 15.0, 0.0, 0.8), tf)


@pytest.fixture(scope="module")
def truth(jet):
    volume, inputs = jet
    tracer = PathTracer(volume, seed=1)
    *_, many = tracer.refine(inputs, 96, 256)
    tracer.close()
    return many


@needs_denoiser
def test_noise_falls_against_many_samples(jet, truth):
    volume, inputs = jet
    tracer = PathTracer(volume)
    found = list(tracer.refine(inputs, 96, 4))
    tracer.close()

    def error(image):
        return np.sqrt(np.mean((image - truth.rgba)[..., :3] ** 2))

    for estimate in found:
        clean = cleaned(estimate, Denoiser())
        assert clean.dtype == np.float32
        assert error(clean) < 0.4 * error(estimate.rgba)
        np.testing.assert_array_equal(clean[..., 3], truth.rgba[..., 3])
        assert (clean[clean[..., 3] == 0] == 0).all()


def test_what_guides_the_denoiser_is_the_unlit_picture(jet):
    volume, inputs = jet
    tracer = PathTracer(volume)
    *_, estimate = tracer.refine(inputs, 48, 2)
    tracer.close()
    caster = RaycastRenderer(volume)
    unlit = caster.render(inputs, 48)
    caster.close()
    np.testing.assert_allclose(estimate.albedo, unlit[..., :3], atol=1 / 500)
    np.testing.assert_array_equal(estimate.rgba[..., :3], estimate.radiance.clip(0, 1))


@pytest.mark.slow
@needs_denoiser
def test_the_estimated_error_is_that_against_many_samples(jet, truth):
    volume, inputs = jet
    tracer = PathTracer(volume)
    for estimate in tracer.refine(inputs, 96, 16):
        if estimate.samples == 1:
            assert np.isinf(error_of(estimate, Denoiser()))
            continue
        clean = cleaned(estimate, Denoiser())
        square = np.mean((clean - truth.rgba)[..., :3] ** 2) - truth.error**2
        told = error_of(estimate, Denoiser())
        assert told / 1.5 < np.sqrt(square) < told * 1.5
    tracer.close()
