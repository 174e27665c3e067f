import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from model.rendering.path_tracing import denoising
from model.rendering.path_tracing.denoising import DenoisingError, available, denoise

needs_denoiser = pytest.mark.skipif(not available(), reason="no denoiser for this machine")


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


@needs_denoiser
def test_what_is_denoised_quickly_is_nearly_the_same_picture():
    rng = np.random.default_rng(3)
    rows, columns = np.mgrid[:64, :64] / 64
    smooth = np.stack([rows, columns, 1 - rows], axis=-1).astype(np.float32)
    noisy = (smooth * rng.exponential(1.0, smooth.shape)).astype(np.float32)
    best, quick = (denoise(noisy, np.full_like(noisy, 0.5), quick) for quick in (False, True))
    errors = [np.sqrt(np.mean((each - smooth) ** 2)) for each in (best, quick)]
    assert errors[1] < 1.2 * errors[0] < 0.15
    # They are two filters, whose results are not confused.
    assert np.abs(best - quick).max() > 0
    np.testing.assert_array_equal(denoise(noisy, np.full_like(noisy, 0.5)), best)


class Library:
    """Stands in for the package: its device has an error."""

    OIDN_FORMAT_FLOAT3 = 3

    class Device:
        @staticmethod
        def is_cpu_available():
            return True

        def commit(self):
            pass

        def get_error(self):
            return "out of memory"


@pytest.fixture
def forgets():
    """What is known of the package is asked anew, before and after."""
    for ask in (denoising._package, denoising._denoiser):
        ask.cache_clear()
    yield
    for ask in (denoising._package, denoising._denoiser):
        ask.cache_clear()


@pytest.mark.parametrize(("package", "said"), [(None, "no denoiser"), (Library, "out of memory")])
def test_without_a_package_that_works_there_is_no_denoiser(monkeypatch, forgets, package, said):
    monkeypatch.setitem(sys.modules, "pyoidn", package)
    assert available() == (package is not None)
    with pytest.raises(DenoisingError, match=said):
        denoise(np.zeros((4, 4, 3), np.float32))
