import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from torch import nn

from model.errors import CheckpointError
from model.latent.codes import CODEC_FILE, SHIPPED_CODEC, WEIGHTS_FILE, load_codec
from model.latent.latent_space import UNIT_SCENE, LatentSpace
from model.samples.sampling import draw_opacity_tfs


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
    assert found == pytest.approx(decoded.numpy()[inside], abs=1e-3)


def test_extreme_tfs_have_finite_codes():
    """Trap 8 of the paper's networks: empty, opaque and single-bin TFs."""
    _, codec = load_codec()
    extremes = np.concatenate([np.zeros((1, 256)), np.ones((1, 256)), np.eye(256)])
    codes = codec.encode(extremes.astype(np.float32))
    assert np.isfinite(codes).all()
    decoded = codec.decode(codes * 5)
    assert np.isfinite(decoded).all()
    assert decoded[1].min() > 0.9
