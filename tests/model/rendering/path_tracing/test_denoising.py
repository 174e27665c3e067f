import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from model.rendering.path_tracing import denoising
from model.rendering.path_tracing.denoising import DenoisingError, available, denoise, denoiser
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.view import View
from model.scene.volume import Volume
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
    *_, many = PathTracer(volume, seed=1).refine(inputs, 96, 128)
    return many


@needs_denoiser
def test_noise_falls_against_many_samples(jet, truth):
    volume, inputs = jet
    tracer = PathTracer(volume)
    traced = list(tracer.refine(inputs, 96, 4))
    found = list(RefiningRenderer(tracer, denoiser).refined(inputs, 96, 4))

    def error(image):
        return np.sqrt(np.mean((image - truth.rgba)[..., :3] ** 2))

    for estimate, picture in zip(traced, found, strict=True):
        assert picture.rgba.dtype == np.float32
        assert error(picture.rgba) < 0.4 * error(estimate.rgba)
        np.testing.assert_array_equal(picture.rgba[..., 3], truth.rgba[..., 3])
        assert (picture.rgba[picture.rgba[..., 3] == 0] == 0).all()


def test_what_guides_the_denoiser_is_the_unlit_picture(jet):
    volume, inputs = jet
    *_, estimate = PathTracer(volume).refine(inputs, 48, 2)
    unlit = RaycastRenderer(volume).render(inputs, 48, 0.125)
    np.testing.assert_allclose(estimate.albedo, unlit[..., :3], atol=1 / 500)
    np.testing.assert_array_equal(estimate.rgba[..., :3], estimate.radiance.clip(0, 1))


@pytest.mark.slow
@needs_denoiser
def test_the_estimated_error_is_that_against_many_samples(jet, truth):
    volume, inputs = jet
    for picture in RefiningRenderer(PathTracer(volume), denoiser).refined(inputs, 96, 16):
        # The second sample alone has no halves.
        assert np.isinf(picture.error) == (picture.samples < 4)
        if picture.samples >= 4:
            square = np.mean((picture.rgba - truth.rgba)[..., :3] ** 2) - truth.error**2
            assert picture.error / 1.5 < np.sqrt(square) < picture.error * 1.5


@needs_denoiser
def test_a_small_thing_is_cleaned_as_if_nothing_were_around_it():
    """Only the part that was traced is cleaned, at the same place."""
    voxels = np.zeros((24, 24, 24), dtype=np.uint8)
    voxels[14:18, 15:20, 5:9] = 200
    volume = Volume(voxels)
    inputs = SceneInputs.of(View(20.0, 10.0, 0.0, 0.9), default_transfer_function(volume))
    raster, parts = Raster(400, 300), []

    def cleaning(inputs, part):
        parts.append(part)
        return denoiser(inputs, part)

    tracer = PathTracer(volume)
    (estimate,) = tracer.refine(inputs, raster, 1)
    (picture,) = RefiningRenderer(tracer, cleaning).refined(inputs, raster, 1)
    (part,) = parts
    assert part.rows * part.columns < 0.5 * raster.rows * raster.columns
    whole = denoise(estimate.radiance, estimate.albedo, quick=True)
    expected = np.where(estimate.rgba[..., 3:] > 0, whole, 0).clip(0, 1)
    taken = np.std(expected - estimate.radiance)
    assert taken > 0.01
    # The denoiser chooses its exposure by what it sees.
    assert np.std(picture.rgba[..., :3] - expected) < 0.2 * taken


@needs_denoiser
@pytest.mark.parametrize("quick", [False, True])
def test_light_above_one_is_kept_and_threads_do_not_mix_their_pictures(quick):
    def clean(image):
        return denoise(image, np.full_like(image, 0.5), quick)

    rng = np.random.default_rng(2)
    images = [rng.random((size, 40, 3), dtype=np.float32) * 6 for size in (32, 40, 48) * 4]
    alone = [clean(image) for image in images]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(clean, images))
    for image, expected, found in zip(images, alone, together, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-4)
        assert found.mean() == pytest.approx(image.mean(), rel=0.1)
        assert found.std() < image.std() / 3


def test_without_a_package_there_is_no_denoiser(monkeypatch):
    for ask in ("_package", "_denoiser"):
        # What is known of the package is asked anew.
        monkeypatch.setattr(denoising, ask, getattr(denoising, ask).__wrapped__)
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    assert not available()
    with pytest.raises(DenoisingError, match="no denoiser"):
        denoise(*np.zeros((2, 4, 4, 3), np.float32))
