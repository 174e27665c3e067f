import numpy as np
import pytest
from toy_codec import ToyCodec

from model.errors import LatentError
from model.latent.codes import sample_codes, samples_of


@pytest.fixture
def tfs():
    codes = np.random.default_rng(0).uniform(-0.9, 0.9, (300, 2))
    return ToyCodec().decode(codes)


def test_samples_are_decoded_codes_within_the_box_of_the_known_ones(tfs):
    samples = sample_codes(ToyCodec(), tfs, 500)
    known = ToyCodec().encode(tfs)
    assert samples.codes.shape == (500, 2)
    assert (samples.codes >= known.min(axis=0) - 0.01).all()
    assert (samples.codes <= known.max(axis=0) + 0.01).all()
    assert samples.tfs == pytest.approx(ToyCodec().decode(samples.codes))
    # Uniform, so that either half of the box has half of them.
    assert (samples.codes > 0).mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.08)
    # Singular values are deviations along the principal axes.
    variances = np.linalg.eigvalsh(np.cov(samples.codes.T.astype(np.float64), bias=True))
    assert np.square(samples.singular_values) == pytest.approx(variances[::-1], rel=1e-4)


def test_effective_dimension_counts_equal_axes():
    codes = np.zeros((4, 3), dtype=np.float32)
    codes[:, 0] = 1, -1, 0, 0
    codes[:, 1] = 0, 0, 1, -1
    samples = samples_of(_Constant(), codes)
    assert samples.effective_dimension == pytest.approx(2.0)
    assert samples_of(_Constant(), codes * 0).effective_dimension == 0.0


@pytest.mark.parametrize(("value", "message"), [(0.5, "collapsed"), (np.nan, "not finite")])
def test_a_codec_without_different_codes_is_refused(tfs, value, message):
    with pytest.raises(LatentError, match=message):
        sample_codes(_Constant(value), tfs, 50)


class _Constant(ToyCodec):
    def __init__(self, value=0.0):
        self.value = value

    def encode(self, opacities):
        return np.full((len(opacities), 3), self.value, dtype=np.float32)

    def decode(self, codes):
        return np.zeros((len(codes), 256), dtype=np.float32)
