import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from torch import nn
from toy_codec import ToyCodec

from model.errors import CheckpointError, LatentError
from model.latent.codes import (
    CODEC_FILE,
    SHIPPED_CODEC,
    WEIGHTS_FILE,
    load_codec,
    sample_codes,
    samples_of,
)
from model.latent.latent_space import UNIT_SCENE, LatentSpace
from model.samples.sampling import draw_opacity_tfs


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
    np.testing.assert_allclose(samples.tfs, ToyCodec().decode(samples.codes), rtol=1e-6)
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


@pytest.fixture
def folder(tmp_path):
    """A copy of the shipped one."""
    return Path(shutil.copytree(SHIPPED_CODEC, tmp_path / "codec"))


def test_damaged_folders_are_refused(folder):
    weights, described = folder / WEIGHTS_FILE, folder / CODEC_FILE
    content, text = weights.read_bytes(), described.read_text()
    weights.write_bytes(content[:-3])
    with pytest.raises(CheckpointError, match="truncated"):
        load_codec(folder)
    weights.write_bytes(content)
    for changed, problem in (
        ("{", "malformed"),
        ("[]", "malformed"),
        (json.dumps({**json.loads(text), "tfscope_codec": 9}), "format is 9"),
        (json.dumps({"tfscope_codec": 1}), "malformed"),
    ):
        described.write_text(changed)
        with pytest.raises(CheckpointError, match=problem):
            load_codec(folder)
    described.unlink()
    with pytest.raises(CheckpointError, match="holds no codec"):
        load_codec(folder)


def test_the_shipped_codec_keeps_tfs_and_has_a_map():
    space = LatentSpace.shipped((0.0, 255.0), (32.0, 224.0))
    tfs = draw_opacity_tfs(UNIT_SCENE, 99, 0, 500)
    codes = space.codec.encode(tfs)
    assert np.abs(codes).max() <= 1
    errors = np.sqrt(np.square(space.codec.decode(codes) - tfs).mean(axis=1))
    assert np.median(errors) < 0.04
    map_ = space.open_map()
    assert map_.is_final
    assert map_.codes.shape == (10_000, 8)
    assert map_.samples.effective_dimension > 6
    # Nothing in the way where a TF shows nothing.
    nothing = space.codec.decode(space.codec.encode(np.zeros((1, 256), dtype=np.float32)))
    assert nothing.max() < 0.005


def test_it_is_the_network_that_was_trained():
    """The same numbers as PyTorch's own layers with the shipped weights give."""
    weights = {k: v.float() for k, v in load_file(SHIPPED_CODEC / WEIGHTS_FILE).items()}
    channels = [1, 16, 32, 64, 128, 128]
    layers = []
    for a, b in itertools.pairwise(channels):
        layers += [nn.Conv1d(a, b, 5, stride=2, padding=2), nn.LeakyReLU(0.2)]
    layers += [nn.Conv1d(128, 256, 8), nn.LeakyReLU(0.2), nn.Flatten()]
    hidden = [m for n in (8, 512, 512) for m in (nn.Linear(n, 512), nn.LeakyReLU(0.2))]
    network = nn.ModuleDict(
        {
            "encoder": nn.Sequential(nn.Sequential(*layers), nn.Linear(256, 16)),
            "tf_decoder": nn.Sequential(nn.Sequential(*hidden), nn.Linear(512, 256)),
        }
    )
    network.load_state_dict(weights)
    tfs = torch.from_numpy(draw_opacity_tfs(UNIT_SCENE, 5, 0, 200))
    with torch.inference_mode():
        means = network["encoder"](2 * tfs.sqrt()[:, None] - 1)[:, :8]
        codes = 2 * torch.distributions.Normal(0.0, 1.0).cdf(means) - 1
        rough = network["tf_decoder"](means)[:, None]
        binomial = torch.tensor([1.0, 8, 28, 56, 70, 56, 28, 8, 1])[None, None] / 256
        padded = nn.functional.pad(rough, (4, 4), mode="replicate")
        decoded = nn.functional.conv1d(padded, binomial)[:, 0].sigmoid().square()
    _, codec = load_codec()
    assert codec.encode(tfs.numpy()) == pytest.approx(codes.numpy(), abs=1e-4)
    inside = (codes.abs() < 0.999).all(dim=1).numpy()
    assert inside.sum() > 50
    found = codec.decode(codes.numpy()[inside])
    np.testing.assert_allclose(found, decoded.numpy()[inside], atol=1e-3)


def test_extreme_tfs_have_finite_codes():
    """Trap 8 of the paper's networks: empty, opaque and single-bin TFs."""
    _, codec = load_codec()
    extremes = np.concatenate([np.zeros((1, 256)), np.ones((1, 256)), np.eye(256)])
    codes = codec.encode(extremes.astype(np.float32))
    assert np.isfinite(codes).all()
    decoded = codec.decode(codes * 5)
    assert np.isfinite(decoded).all()
    assert decoded[1].min() > 0.9
