import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from toy_codec import ToyCodec, toy_space

from model.errors import CheckpointError, LatentError, TransferFunctionError
from model.latent import latent_space
from model.latent.codes import CODEC_FILE, SHIPPED_CODEC, WEIGHTS_FILE, load_codec, sample_codes
from model.samples.sampling import draw_opacity_tfs, draw_sample
from model.scene.transfer_function import GaussianMode, OpacityTF

CODES = np.random.default_rng(0).uniform(-1, 1, (20, 3)).astype(np.float32)
PLACES = np.random.default_rng(1).uniform(-1, 1, (20, 2)).astype(np.float32)


@pytest.fixture
def kept_map(tmp_path):
    kept_map = tmp_path / "deep" / latent_space.MAP_FILE
    latent_space.save_map(kept_map, latent_space.map_key("one"), CODES, PLACES)
    return kept_map


def test_a_map_of_another_codec_is_refused(kept_map):
    with pytest.raises(LatentError, match="another codec"):
        latent_space.load_map(kept_map, latent_space.map_key("other"))
    assert latent_space.map_key("one", 10) != latent_space.map_key("one", 11)


def test_damaged_maps_are_refused(kept_map):
    content = kept_map.read_bytes()
    for damaged in (b"", content[: len(content) // 2], b"PK" + content[50:], b"no map at all"):
        kept_map.write_bytes(damaged)
        with pytest.raises(LatentError):
            latent_space.load_map(kept_map, latent_space.map_key("one"))
    with pytest.raises(LatentError, match="cannot be read"):
        latent_space.load_map(kept_map.with_name("missing.npz"), latent_space.map_key("one"))


@pytest.mark.parametrize(
    ("model_codes", "places"),
    [(CODES * np.nan, PLACES), (CODES, PLACES[:5]), (CODES[:0], PLACES[:0])],
    ids=["not finite", "of different lengths", "empty"],
)
def test_maps_of_nonsense_are_refused(kept_map, model_codes, places):
    latent_space.save_map(kept_map, latent_space.map_key("one"), model_codes, places)
    with pytest.raises(LatentError, match="damaged"):
        latent_space.load_map(kept_map, latent_space.map_key("one"))


def test_a_space_finds_the_map_that_it_kept(tmp_path):
    space = toy_space(tmp_path, (0.0, 9.0), (3.0, 6.0))
    fresh = space.open_map(30)
    assert not fresh.is_final
    places = np.random.default_rng(0).uniform(-1, 1, (30, 2)).astype(np.float32)
    space.keep_map(fresh.codes, places)
    again = space.open_map(30)
    assert again.is_final
    assert again.places == pytest.approx(places, abs=1e-3)
    assert again.codes == pytest.approx(fresh.codes, abs=1e-3)
    assert not space.open_map(31).is_final


def test_a_damaged_map_is_computed_anew(tmp_path):
    (tmp_path / latent_space.MAP_FILE).write_bytes(b"damaged")
    assert not toy_space(tmp_path, (0.0, 1.0), (0.0, 1.0)).open_map(30).is_final


FRAME = latent_space.TFFrame((0.0, 1000.0), (200.0, 800.0))
RAMP = np.linspace(0.2, 0.7, 256)


def test_a_tf_fills_the_window():
    tf = FRAME.opacity_tf(RAMP)
    assert tf.scalar_range == (0.0, 1000.0)
    assert tf([200.0, 500.0, 800.0]) == pytest.approx([0.2, 0.45, 0.7], abs=1e-6)
    # Nothing below, where the background is; the last opacity above.
    assert tf([0.0, 199.9, 900.0]) == pytest.approx([0.0, 0.0, 0.7], abs=1e-6)
    assert tf.sample(FRAME.window) == pytest.approx(RAMP, abs=1e-6)
    assert FRAME.opacity_tf(RAMP + 5)(500.0) == 1.0
    # What lies outside of it is lost.
    outside = OpacityTF((0.0, 1000.0), (GaussianMode(50.0, 20.0, 0.9),))
    assert outside.sample(FRAME.window).max() < 1e-6
    # A window of the whole range adds no step.
    whole = latent_space.TFFrame((0.0, 1000.0), (0.0, 1000.0))
    assert len(whole.opacity_tf(RAMP).points) == 256
    assert whole.stretched(RAMP[None])[0] == pytest.approx(RAMP, abs=1e-6)
    with pytest.raises(TransferFunctionError):
        latent_space.TFFrame((0.0, 1.0), (0.5, 0.5))


def test_stretched_tfs_are_the_sampled_ones():
    rng = np.random.default_rng(0)
    smooth = np.cumsum(rng.normal(0, 0.01, (5, 256)), axis=1) % 1
    for opacities, stretched in zip(smooth, FRAME.stretched(smooth), strict=True):
        assert stretched == pytest.approx(FRAME.opacity_tf(opacities).sample(), abs=1e-5)


@pytest.fixture(scope="module")
def space(lively_folder):
    return latent_space.LatentSpace.of_model(lively_folder)


@pytest.fixture(scope="module")
def model_codes(space):
    tfs = np.random.default_rng(1).uniform(0, 1, (5, 256)).astype(np.float32)
    return space.codec.encode(np.cumsum(tfs, axis=1) / 256)


def test_a_code_is_drawn_in_place_of_the_tf(lively_generator, space, model_codes, scene):
    inputs = draw_sample(scene, 3, "train", 0)
    codes = np.stack([space.code_of(inputs.opacity_tf), model_codes[0]])
    same, other = lively_generator.render_latent(codes, inputs)
    np.testing.assert_allclose(same, lively_generator.render(inputs), atol=1e-5)
    assert np.abs(other - same).max() > 0.01


def test_codes_that_cannot_be_drawn_are_refused(lively_generator, model_codes, scene):
    inputs = draw_sample(scene, 3, "train", 0)
    with pytest.raises(LatentError, match="8 numbers, not 7"):
        lively_generator.render_latent(model_codes[:, :7], inputs)
    with pytest.raises(LatentError, match="finite"):
        lively_generator.render_latent(model_codes * np.nan, inputs)


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


@pytest.mark.parametrize(("value", "message"), [(0.5, "collapsed"), (np.nan, "not finite")])
def test_a_codec_without_different_codes_is_refused(tfs, value, message, monkeypatch):
    alike = np.full((len(tfs), 2), value, dtype=np.float32)
    monkeypatch.setattr(ToyCodec, "encode", lambda *_: alike)
    with pytest.raises(LatentError, match=message):
        sample_codes(ToyCodec(), tfs, 50)


def test_damaged_folders_are_refused(tmp_path):
    folder = Path(shutil.copytree(SHIPPED_CODEC, tmp_path / "codec"))
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
    space = latent_space.LatentSpace.shipped((0.0, 255.0), (32.0, 224.0))
    tfs = draw_opacity_tfs(latent_space.UNIT_SCENE, 99, 0, 500)
    codes = space.codec.encode(tfs)
    assert np.abs(codes).max() <= 1
    errors = np.sqrt(np.square(space.codec.decode(codes) - tfs).mean(axis=1))
    assert np.median(errors) < 0.04
    map_ = space.open_map()
    assert map_.is_final
    assert map_.codes.shape == (10_000, 8)
    # No principal axis has more than three times the deviation of another.
    assert map_.samples.singular_values.min() > map_.samples.singular_values.max() / 3
    # Nothing in the way where a TF shows nothing.
    nothing = space.codec.decode(space.codec.encode(np.zeros((1, 256), dtype=np.float32)))
    assert nothing.max() < 0.005


def test_extreme_tfs_have_finite_codes():
    """Trap 8 of the paper's networks: empty, opaque and single-bin TFs."""
    _, codec = load_codec()
    extremes = np.concatenate([np.zeros((1, 256)), np.ones((1, 256)), np.eye(256)])
    codes = codec.encode(extremes.astype(np.float32))
    assert np.isfinite(codes).all()
    decoded = codec.decode(codes * 5)
    assert np.isfinite(decoded).all()
    assert decoded[1].min() > 0.9
