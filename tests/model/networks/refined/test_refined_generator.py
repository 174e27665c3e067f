from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from model.errors import TfscopeError
from model.generator.generator import Generator
from model.networks.build import build_generator
from model.networks.card import ModelCard
from model.networks.checkpoint import load_model, save_model
from model.networks.encoding import EncodedInputs
from model.networks.refined.refined_generator import RefinedGenerator
from model.networks.refined.refiner import Refiner
from model.networks.size import NetworkSize
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Lighting, Scene
from model.scene.transfer_function import OpacityTF
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.sensitivity.learned import Sensitivity

SIZE = NetworkSize(0.125, 32, 32, architecture="refined")


def network_of(volume: Volume, scene: Scene, nodes: int = 10_000) -> RefinedGenerator:
    torch.manual_seed(0)
    network = build_generator(replace(SIZE, nodes=nodes), scene, volume)
    assert isinstance(network, RefinedGenerator)
    return network.eval().requires_grad_(False)


def generator_of(network: RefinedGenerator, scene: Scene) -> Generator:
    return Generator(ModelCard(scene, "tiny", network._size), network, torch.device("cpu"))


def trained(network: RefinedGenerator) -> RefinedGenerator:
    """With a refiner whose corrections are not 0, as after training."""
    network.refiner = network.refiner or Refiner(network.renderer.channels, 16)
    torch.nn.init.normal_(network.refiner.correction.weight, std=0.02)
    return network.requires_grad_(False)


def scene_of(volume: Volume, lighting: Lighting = "none") -> Scene:
    return Scene.of(volume, 32, lighting, renderer="raycast", movable_light=lighting != "none")


@pytest.mark.parametrize("lighting", ["none", "direct", "global"])
def test_untrained_and_with_all_voxels_it_is_the_ray_caster(
    volume: Volume, lighting: Lighting
) -> None:
    scene = scene_of(volume, lighting)
    generator = generator_of(network_of(volume, scene), scene)
    renderer = RaycastRenderer(volume, lighting, sample_distance=0.5)
    errors = []
    for i in range(12):
        inputs = draw_sample(scene, 5, "holdout", i)
        difference = generator.render(inputs) - renderer.render(inputs, 32)
        errors.append(np.sqrt(np.mean(difference**2)))
    renderer.close()
    # Its steps are longer, and its shadows coarser.
    assert np.mean(errors) < {"none": 0.01, "direct": 0.02, "global": 0.03}[lighting]


def test_a_model_folder_keeps_the_coarse_volume(volume: Volume, tmp_path: Path) -> None:
    scene = Scene.of(volume, 32, "global", renderer="vtk")
    network = trained(network_of(volume, scene, nodes=1001))
    save_model(tmp_path, ModelCard(scene, "tiny", network._size), network)
    card, loaded = load_model(tmp_path)
    assert isinstance(loaded, RefinedGenerator)
    assert torch.equal(loaded.means, network.means)
    assert torch.equal(loaded.spreads, network.spreads)
    inputs = draw_sample(scene, 1, "holdout", 0)
    ours, theirs = (generator_of(n, card.scene).render(inputs) for n in (network, loaded))
    assert ours[..., :3].max() > 0.02
    np.testing.assert_allclose(ours, theirs, atol=2e-3)


def test_only_light_that_the_kernels_lack_is_refined(volume: Volume) -> None:
    assert network_of(volume, Scene.of(volume, 32, "global", renderer="vtk")).refiner is not None
    for lighting, renderer in (("none", "vtk"), ("direct", "vtk"), ("global", "raycast")):
        scene = Scene.of(volume, 32, lighting, renderer=renderer)
        assert network_of(volume, scene).refiner is None


def test_half_bytes_come_back(volume: Volume) -> None:
    from model.networks.refined.refined_generator import _packed, _unpacked

    levels = np.random.default_rng(0).integers(0, 16, (3, 5, 7), dtype=np.uint8)
    packed = _packed(levels)
    assert packed.size == 53
    np.testing.assert_array_equal(_unpacked(packed, levels.shape), levels)


def test_nodes_that_are_loaded_are_drawn(volume: Volume) -> None:
    scene = scene_of(volume)
    network, empty = network_of(volume, scene), network_of(volume, scene)
    empty.means.zero_()
    empty._renderer = None
    inputs = draw_sample(scene, 1, "holdout", 3)
    generator = generator_of(empty, scene)
    before = generator.render(inputs)
    empty.load_state_dict(copy.deepcopy(network.state_dict()))
    after = generator.render(inputs)
    assert abs(before - after).max() > 0.1
    np.testing.assert_array_equal(after, generator_of(network, scene).render(inputs))


def test_a_code_is_drawn_as_the_tf_that_it_stands_for(volume: Volume) -> None:
    scene = scene_of(volume)
    generator = generator_of(trained(network_of(volume, scene)), scene)
    inputs = draw_sample(scene, 2, "holdout", 0)
    code = generator.encode(inputs.opacity_tf.sample(scene.scalar_range))
    values = np.linspace(*scene.scalar_range, 256)
    decoded = OpacityTF(
        scene.scalar_range,
        points=tuple(zip(values.tolist(), generator.decode(code).tolist(), strict=True)),
    )
    expected = generator.render(replace(inputs, opacity_tf=decoded))
    np.testing.assert_allclose(generator.render_latent(code, inputs), expected, atol=1e-4)


def test_the_image_does_not_depend_on_the_codec(volume: Volume) -> None:
    scene = scene_of(volume)
    network = trained(network_of(volume, scene))
    inputs = draw_sample(scene, 2, "holdout", 1)
    before = generator_of(network, scene).render(inputs)
    for parameter in network.codec.parameters():
        parameter.zero_()
    np.testing.assert_array_equal(generator_of(network, scene).render(inputs), before)


def test_an_empty_tf_is_black_and_a_faint_one_nearly(volume: Volume) -> None:
    scene = scene_of(volume)
    generator = generator_of(network_of(volume, scene), scene)
    inputs = draw_sample(scene, 2, "holdout", 1)
    nothing = replace(inputs, opacity_tf=OpacityTF(scene.scalar_range))
    assert not generator.render(nothing).any()
    faint = replace(inputs, opacity_tf=OpacityTF(scene.scalar_range, points=((0.0, 1e-4),)))
    assert 0 < generator.render(faint).max() < 0.01


def test_its_sensitivities_are_the_exact_ones_where_all_voxels_are_kept(volume: Volume) -> None:
    scene = scene_of(volume)
    generator = generator_of(network_of(volume, scene), scene)
    samples = [draw_sample(scene, 0, "holdout", i) for i in (0, 1, 5)]
    agreement = sensitivity_agreement(generator, volume, samples)
    assert agreement.image_cosine.min() > 0.99
    assert agreement.block_cosine.min() > 0.9


def test_sensitivities_through_the_refining_network(volume: Volume) -> None:
    """Reverse and forward mode agree, and both with differences of whole images."""
    scene = scene_of(volume)
    generator = generator_of(trained(network_of(volume, scene, nodes=2000)), scene)
    inputs = draw_sample(scene, 0, "holdout", 1)
    ours = Sensitivity(generator, inputs, edit_width=0)
    whole, blocks = ours.field(32)[0, 0], ours.field(16)
    bins = np.arange(256)
    for center in (80, 140, 200):
        edit = np.exp(-((bins - center) ** 2) / 200).astype(np.float32)
        change = ours.change(edit)
        norm = np.linalg.norm(ours.image)
        assert whole @ edit == pytest.approx((ours.image * change).sum() / norm, rel=1e-3)
        upper_left = ours.image[:16, :16]
        expected = (upper_left * change[:16, :16]).sum() / np.linalg.norm(upper_left)
        assert blocks[0, 0] @ edit == pytest.approx(expected, rel=1e-3)
        h = 0.01
        opacity = generator.encoded([inputs]).opacity_tf
        images = []
        for sign in (1, -1):
            row = generator.encoded([inputs])
            moved = (opacity + sign * 2 * h * torch.from_numpy(edit)).clamp(-1, 1)
            pair = generator.network(EncodedInputs(row.conditions, moved, row.color_tf))
            images.append(pair[0][0].permute(1, 2, 0).numpy() / 2 + 0.5)
        clipped = ((opacity + 1) / 2 < h * torch.from_numpy(edit)).numpy()[0]
        if not clipped.any():
            difference = (images[0] - images[1]) / (2 * h)
            scale = np.abs(difference).max()
            assert np.sqrt(np.mean((difference - change) ** 2)) < 0.02 * scale


def test_a_scene_that_does_not_know_its_volumes_dimensions_is_refused(volume: Volume) -> None:
    scene = replace(scene_of(volume), dimensions=None)
    with pytest.raises(TfscopeError, match="earlier version"):
        build_generator(SIZE, scene, volume)


def test_a_refiner_starts_as_the_identity() -> None:
    images = torch.rand(2, 8, 32, 32)
    torch.testing.assert_close(Refiner(8, 16)(images), images[:, 4:7])
