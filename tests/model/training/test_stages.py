"""One step of each stage, against losses worked out by hand."""

import copy
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from model.errors import TrainingError
from model.networks.generator_network import decode_unit
from model.networks.size import NetworkSize
from model.samples.sampling import draw_edits, draw_opacity_tfs
from model.scene.scene import Scene
from model.training.batch import encode_batch
from model.training.codec_loss import LAYER, CodecLoss, decoded_tf_error
from model.training.options import TrainingOptions
from model.training.stage import EMA, WARM_UP, Setup, adversarial
from model.training.stages import OpacityStage, TranslationStage

SIZE = NetworkSize(0.125, 16, 64)
CPU = torch.device("cpu")
SCENE = Scene("none", "", (0.0, 1.0), (0.2, 0.8), 64)
PLAIN = replace(TrainingOptions(), unrendered_tfs=0, thick_layer_weight=0.0, tf_edit_weight=0.0)
LOSS = CodecLoss(SCENE, replace(PLAIN, unrendered_tfs=8))


@pytest.fixture(scope="module")
def batch(store):
    return encode_batch(store.read("train", range(24)), store.scene, 16)


class FixedCodec(nn.Module):
    """A codec that decodes by a given function."""

    def __init__(self, decode):
        super().__init__()
        self.decode, self.encode = decode, lambda opacity_tf: opacity_tf


def stages(options):
    torch.manual_seed(0)
    setup = Setup(SIZE, 5, options, CodecLoss(SCENE, PLAIN), CPU)
    opacity = OpacityStage(setup)
    return opacity, TranslationStage(setup, opacity.average.network)


def test_the_adversarial_loss_is_minus_log_of_the_probability():
    logits = torch.tensor([[0.3], [-2.0]])
    probability = 1 / (1 + np.exp(-logits.numpy()))
    assert adversarial(logits, 1.0).item() == pytest.approx(-np.log(probability).mean())
    assert adversarial(logits, 0.0).item() == pytest.approx(-np.log(1 - probability).mean())


def test_reported_losses_are_those_of_the_networks(batch):
    opacity, _ = stages(TrainingOptions())
    # The batch-norm statistics of the batch itself are used, so a copy gives the same output.
    before = copy.deepcopy(opacity.generator)
    with torch.no_grad():
        image, decoded_tf = before(batch.inputs)
    losses = opacity.step(batch, 0.0).losses
    l1 = (image.float() - batch.opacity_image).abs().mean().item()
    square = (decoded_tf.float() - batch.inputs.opacity_tf).square().mean().item()
    assert losses["opacity_l1"] == pytest.approx(l1, rel=1e-3)
    assert losses["decoded_tf"] == pytest.approx(square, rel=1e-3)


def test_the_codec_is_to_follow_edits_whatever_it_makes_of_the_tf(batch):
    tfs = draw_opacity_tfs(SCENE, 3, 5, 40)
    edits = (tfs + draw_edits(SCENE, 3, 5, 40)).clip(0, 1) - tfs
    assert np.abs(edits).max() > 0.05
    share = {
        "follows, off by a constant": (lambda tf: tf + 0.5, 0.0),
        "does not follow": (lambda tf: 0 * tf, 1.0),
        "follows by half": (lambda tf: tf / 2, 0.25),
        "the other way": (lambda tf: -tf, 4.0),
    }
    for decode, missed in share.values():
        codec = FixedCodec(decode)
        decoded = codec.decode(batch.inputs.opacity_tf)
        plain, weighted = (
            CodecLoss(SCENE, replace(PLAIN, unrendered_tfs=40, seed=3, tf_edit_weight=weight))(
                codec, decoded, batch, 5
            ).item()
            for weight in (0.0, 3.0)
        )
        # Half of the loss is the batch's; a height is .1.
        expected = 3.0 * missed * np.square(edits / 0.1).mean() / 2
        assert weighted - plain == pytest.approx(expected, rel=1e-3, abs=1e-6)


def test_faint_modes_count_by_what_a_thick_layer_shows():
    rng = np.random.default_rng(0)
    true = rng.uniform(0, 1, (3, 256)) ** 4
    decoded = np.clip(true + rng.normal(0, 0.02, true.shape), 0, 1)
    through = [np.ones_like(true), np.ones_like(true)]
    for _ in range(LAYER):
        through = [t * (1 - tf) for t, tf in zip(through, (true, decoded), strict=True)]
    curves = np.square(2 * (decoded - true)).mean()
    layers = np.square(2 * (through[1] - through[0])).mean()
    ours, theirs = (torch.from_numpy(2 * tf - 1).float() for tf in (decoded, true))
    assert decoded_tf_error(ours, theirs, 0.0).item() == pytest.approx(curves, rel=1e-4)
    error = decoded_tf_error(ours, theirs, 0.3).item()
    assert error == pytest.approx(curves + 0.3 * layers, rel=1e-4)
    assert layers > 10 * curves


def test_the_average_is_exponential():
    network = nn.Linear(1, 1, bias=False)
    average = EMA(network, decay=0.9)
    expected = network.weight.item()
    for step in range(300):
        with torch.no_grad():
            network.weight.fill_(float(step))
        average.update(network, step)
        decay = min(0.9, (1 + step) / (10 + step))
        expected = decay * expected + (1 - decay) * step
        assert average.network.weight.item() == pytest.approx(expected, rel=1e-4)


class Tight(OpacityStage):
    """A stage that has memory for a few samples only."""

    room = 8

    def _generate(self, batch):
        if len(batch) > self.room:
            raise torch.OutOfMemoryError("made up")
        return super()._generate(batch)


@pytest.mark.parametrize("adversarial_start", [0.0, 1.0])
def test_a_batch_too_large_for_the_memory_is_learned_from_in_parts(batch, adversarial_start):
    options = TrainingOptions(adversarial_start=adversarial_start)

    def trained(kind):
        torch.manual_seed(0)
        stage = kind(Setup(SIZE, 5, options, LOSS, CPU))
        # Without batch statistics, parts add up to the whole.
        stage.generator.eval()
        stage.discriminator.eval()
        result = stage.step(batch, WARM_UP)
        return stage, result.losses

    (whole, losses), (parts, losses_in_parts) = trained(OpacityStage), trained(Tight)
    assert (whole.parts, parts.parts) == (1, 4)
    assert losses_in_parts == pytest.approx(losses, rel=1e-2)
    pairs = whole.generator.named_parameters(), parts.generator.parameters()
    for (name, one), other in zip(*pairs, strict=True):
        if one.grad is not None:
            scale = one.grad.abs().max()
            # bfloat16 has 8 bits
            assert (one.grad - other.grad).abs().max() <= 0.05 * scale, name


def test_memory_too_small_for_any_part_is_said(batch):
    stage = Tight(Setup(SIZE, 5, TrainingOptions(), LOSS, CPU))
    stage.room = 1
    with pytest.raises(TrainingError, match="out of memory") as caught:
        stage.step(batch, 0.0)
    assert caught.value.suggested == {"set": "opacity.batch_size=12"}


def test_a_batch_keeps_shapes_ranges_and_meaning(store):
    samples = store.read("train", range(6))
    batch = encode_batch(samples, store.scene, 32)
    assert batch.inputs.conditions.shape == (6, 5)
    assert batch.inputs.opacity_tf.shape == (6, 256)
    assert batch.inputs.color_tf.shape == (6, 3, 256)
    assert batch.opacity_image.shape == (6, 1, 32, 32)
    assert batch.image.shape == (6, 3, 64, 64)
    for value in (*batch.inputs, batch.opacity_image, batch.image):
        assert value.dtype == torch.float32
        assert value.abs().max() <= 1 + 1e-6
    blocks = samples.rgba[..., 3].reshape(6, 32, 2, 32, 2).mean(axis=(2, 4)) / 255
    np.testing.assert_allclose(decode_unit(batch.opacity_image)[:, 0].numpy(), blocks, atol=1e-6)
    green = samples.rgba[2, 40, 20, 1] / 255
    assert decode_unit(batch.image)[2, 1, 40, 20].item() == pytest.approx(green, abs=1e-6)
