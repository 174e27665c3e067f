from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from model.errors import CheckpointError
from model.latent.codec_folder import CODEC_FILE, SHIPPED_CODEC, WEIGHTS_FILE, load_codec
from model.latent.codes import TFCodec
from model.latent.latent_space import UNIT_SCENE, LatentSpace
from model.samples.sampling import draw_opacity_tfs


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the shipped one."""
    return Path(shutil.copytree(SHIPPED_CODEC, tmp_path / "codec"))


def test_damaged_folders_are_refused(folder: Path) -> None:
    weights, described = folder / WEIGHTS_FILE, folder / CODEC_FILE
    content, text = weights.read_bytes(), described.read_text()
    weights.write_bytes(content[:-3])
    with pytest.raises(CheckpointError, match="truncated"):
        load_codec(folder)
    weights.write_bytes(content)
    for changed, problem in (
        ("{", "not JSON"),
        ("[]", "malformed"),
        (json.dumps({**json.loads(text), "tfscope_codec": 9}), "format is 9"),
        (json.dumps({**json.loads(text), "latent_dim": 4}), "not those"),
        (json.dumps({"tfscope_codec": 1}), "malformed"),
    ):
        described.write_text(changed)
        with pytest.raises(CheckpointError, match=problem):
            load_codec(folder)
    described.unlink()
    with pytest.raises(CheckpointError, match="holds no codec"):
        load_codec(folder)


def test_the_shipped_codec_keeps_tfs_and_has_a_map() -> None:
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


def test_extreme_tfs_have_finite_codes() -> None:
    """Trap 8 of the paper's networks: empty, opaque and single-bin TFs."""
    codec = TFCodec(load_codec()[1])
    extremes = np.concatenate([np.zeros((1, 256)), np.ones((1, 256)), np.eye(256)])
    codes = codec.encode(extremes.astype(np.float32))
    assert np.isfinite(codes).all()
    decoded = codec.decode(codes * 5)
    assert np.isfinite(decoded).all()
    assert decoded[1].min() > 0.9
