"""Denoising: against many samples, with a denoiser and without one."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from model.rendering.path_tracing import denoising
from model.rendering.path_tracing.denoising import (
    DenoisingError,
    available,
    denoise,
    denoised,
    error_of,
)
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
    *_, many = tracer.refine(inputs, 96, 512)
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
        clean = denoised(estimate)
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
            assert np.isinf(error_of(estimate))
            continue
        clean = denoised(estimate)
        square = np.mean((clean - truth.rgba)[..., :3] ** 2) - truth.error**2
        assert error_of(estimate) / 1.5 < np.sqrt(square) < error_of(estimate) * 1.5
    tracer.close()


@needs_denoiser
def test_light_above_one_is_kept_and_threads_do_not_mix_their_pictures():
    rng = np.random.default_rng(2)
    images = [rng.random((size, 40, 3), dtype=np.float32) * 6 for size in (32, 40, 48) * 4]
    alone = [denoise(image, np.full_like(image, 0.5)) for image in images]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda image: denoise(image, np.full_like(image, 0.5)), images))
    for image, expected, found in zip(images, alone, together, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-4)
        assert found.mean() == pytest.approx(image.mean(), rel=0.1)
        assert found.std() < image.std() / 3


def test_without_the_package_there_is_no_denoiser_and_it_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    denoising._package.cache_clear()
    try:
        assert not available()
        with pytest.raises(DenoisingError, match="no denoiser"):
            denoise(np.zeros((4, 4, 3), np.float32))
    finally:
        denoising._package.cache_clear()


def test_a_library_that_fails_is_an_error_in_plain_words(monkeypatch):
    class Library:
        """Stands in for the package: its device has an error."""

        OIDN_FORMAT_FLOAT3 = 3

        class Device:
            @staticmethod
            def is_cpu_available() -> bool:
                return True

            def commit(self) -> None:
                pass

            def get_error(self) -> str:
                return "out of memory"

    monkeypatch.setitem(sys.modules, "pyoidn", Library)
    denoising._package.cache_clear()
    denoising._denoiser.cache_clear()
    try:
        assert available()
        with pytest.raises(DenoisingError, match="out of memory"):
            denoise(np.zeros((4, 4, 3), np.float32))
    finally:
        denoising._package.cache_clear()
        denoising._denoiser.cache_clear()
