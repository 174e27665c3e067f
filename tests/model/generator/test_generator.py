import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from skimage.transform import resize

from model.errors import TfscopeError
from model.generator import catalog as shipped
from model.networks.blocks import choose_device
from model.networks.checkpoint import load_model
from model.networks.generator_network import EncodedInputs, decode_unit, encode_unit
from model.samples.sampling import draw_sample
from model.scene.inputs import rgb_to_lab
from model.scene.region import Region
from model.sensitivity.learned import Sensitivity
from model.volume_files import read_volume
from model.volume_files.shipped import DEFAULT_VOLUME, shipped_volumes


@pytest.fixture(scope="module")
def samples(scene):
    return [draw_sample(scene, 1, "train", i) for i in range(3)]


def test_an_image_is_what_the_network_says(lively_generator, scene, samples):
    s = samples[0]
    lab = rgb_to_lab(s.color_tf.sample(scene.scalar_range)).T[None]
    with torch.inference_mode():
        expected, opacity_image = lively_generator.network(
            EncodedInputs(
                torch.from_numpy(s.view.vector(scene.view_range))[None],
                encode_unit(s.opacity_tf.sample(scene.scalar_range)[None]),
                torch.from_numpy(lab.copy()),
            )
        )
    image = lively_generator.render(s)
    colors = decode_unit(expected)[0].permute(1, 2, 0).numpy()
    np.testing.assert_allclose(image[..., :3], colors, atol=1e-6)
    small = lively_generator.image_pairs(lively_generator.encoded([s]))[1][0]
    np.testing.assert_allclose(small, decode_unit(opacity_image)[0, 0], atol=1e-6)
    enlarged = resize(small, (64, 64), order=1, mode="edge", anti_aliasing=False)
    np.testing.assert_allclose(image[..., 3], enlarged, atol=1e-5)


def test_a_batch_equals_single_images(lively_generator, samples):
    batch = lively_generator.render_batch(samples)
    assert batch.shape == (3, 64, 64, 4)
    for image, sample in zip(batch, samples, strict=True):
        np.testing.assert_allclose(image, lively_generator.render(sample), atol=1e-5)
    # Each of the three inputs makes a difference: none may be another sample's.
    for name in ("view", "opacity_tf", "color_tf"):
        other = replace(samples[0], **{name: getattr(samples[1], name)})
        assert np.abs(lively_generator.render(other) - batch[0]).max() > 1e-3


def test_a_tf_made_for_another_range_means_the_same_values(lively_generator, samples):
    s = samples[0]
    wider = replace(s, opacity_tf=replace(s.opacity_tf, scalar_range=(-50.0, 300.0)))
    found = (lively_generator.render(each) for each in (s, wider))
    np.testing.assert_array_equal(*found)


def test_devices(lively_generator):
    assert choose_device("cpu").type == "cpu"
    assert choose_device("auto").type == ("cuda" if torch.cuda.is_available() else "cpu")
    with pytest.raises(TfscopeError, match="choose auto, cpu or cuda"):
        choose_device("tpu")
    if not torch.cuda.is_available():
        with pytest.raises(TfscopeError, match="sees no NVIDIA GPU"):
            choose_device("cuda")


def test_panning_moves_images_and_their_sensitivities(lively_generator, samples):
    still = samples[0]
    # By 8 pixels to the right and 16 up, of 64.
    moved = replace(still, view=replace(still.view, pan_x=0.25, pan_y=0.5))
    expected = np.zeros((64, 64, 4), np.float32)
    expected[:48, 8:] = lively_generator.render(still)[16:, :56]
    np.testing.assert_allclose(lively_generator.render(moved), expected, atol=1e-6)
    edit = np.zeros(256, np.float32)
    edit[100] = 1.0
    before = Sensitivity(lively_generator, still).change(edit)
    after = Sensitivity(lively_generator, moved).change(edit)
    np.testing.assert_allclose(after[:48, 8:], before[16:, :56], atol=1e-6)
    np.testing.assert_allclose(
        Sensitivity(lively_generator, moved).region(Region(18, 14, 28, 24)),
        Sensitivity(lively_generator, still).region(Region(10, 30, 20, 40)),
        atol=1e-6,
    )


def test_every_shipped_model_belongs_to_a_shipped_volume():
    by_fingerprint = {read_volume(path).fingerprint for path in shipped_volumes()}
    assert DEFAULT_VOLUME in shipped_volumes() and shipped.shipped_models()
    for folder in shipped.shipped_models():
        card, _ = load_model(folder)
        assert card.scene.volume_fingerprint in by_fingerprint
        chosen = shipped.model_for(card.scene.volume_fingerprint)
        assert chosen is not None
        assert chosen <= folder
        assert load_model(chosen)[0].scene.volume_fingerprint == card.scene.volume_fingerprint
        volume = shipped.volume_for(folder)
        assert volume is not None
        assert read_volume(volume).fingerprint == card.scene.volume_fingerprint


def test_damaged_models_are_passed_over(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "RESOURCES", tmp_path)
    contents = ("{", "[]", '{"scene": 3}', json.dumps({"scene": {"volume_fingerprint": "abc"}}))
    for name, content in zip("abcd", contents, strict=True):
        folder = tmp_path / "models" / name
        folder.mkdir(parents=True)
        (folder / "model.json").write_text(content)
    assert shipped.model_for("abc") == tmp_path / "models" / "d"
    assert shipped.model_for("xyz") is None
    assert shipped.volume_for(tmp_path / "models" / "a") is None
    assert shipped.volume_for(tmp_path / "models" / "d") is None
