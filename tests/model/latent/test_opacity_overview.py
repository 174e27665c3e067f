from __future__ import annotations

import numpy as np
import pytest
from blobs import blobs

from model.latent.opacity_overview import RayLengths
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_opacity_tfs
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.tf_perturbation import with_opacity
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume

WHITE = ColorTF((0.0, 255.0), ((0.0, 1.0, 1.0, 1.0),))


@pytest.fixture(scope="module")
def volume() -> Volume:
    return blobs()


def mode(mean: float, width: float, height: float) -> np.ndarray:
    return OpacityTF((0.0, 255.0), (GaussianMode(mean, width, height),)).sample()


@pytest.mark.parametrize("view", [View(), View(90, 0, 0, 1), View(31, -64, 20, 0.5)])
def test_mean_opacities_are_those_of_the_ray_caster(volume: Volume, view: View) -> None:
    tfs = draw_opacity_tfs(Scene.of(volume, 16), 0, 0, 20)
    means = RayLengths.of(volume, view, 16, 0.1).overview(tfs).opacity
    renderer = RaycastRenderer(volume, sample_distance=0.1)
    empty = SceneInputs.of(view, TransferFunction(OpacityTF((0.0, 255.0)), WHITE))
    for opacities, mean in zip(tfs, means, strict=True):
        expected = renderer.render(with_opacity(empty, opacities), 16)[..., 3].mean()
        assert mean == pytest.approx(expected, abs=0.005)
    renderer.close()


def test_empty_and_solid_images_are_found(volume: Volume) -> None:
    tfs = np.stack([np.zeros(256), np.full(256, 0.9), mode(120, 20, 0.3), np.full(256, 1e-5)])
    overview = RayLengths.of(volume, View()).overview(tfs)
    assert overview.is_empty.tolist() == [True, False, False, True]
    assert overview.is_solid.tolist() == [False, True, False, False]
    assert overview.shows_something.tolist() == [False, False, True, False]
    assert overview.opacity[0] == 0 < overview.opacity[2] < overview.opacity[1]


def test_values_that_are_seen(volume: Volume) -> None:
    tfs = np.stack([mode(60, 10, 0.3), mode(180, 10, 0.3), np.zeros(256)])
    overview = RayLengths.of(volume, View()).overview(tfs)
    dominant = overview.dominant_values((0.0, 255.0))
    assert dominant[:2] == pytest.approx([60, 180], abs=8)
    assert np.isnan(dominant[2])
    assert overview.shares[:2].sum(axis=1) == pytest.approx([1, 1], rel=1e-4)
    assert overview.shares[2].sum() == 0
    assert overview.shows((160.0, 200.0), (0.0, 255.0)).tolist() == [False, True, False]
    broad = RayLengths.of(volume, View()).overview(mode(120, 1.5, 0.5)[None])
    assert broad.shows((120.4, 120.4), (0.0, 255.0)).all()
    assert overview.shows((200.0, 160.0), (0.0, 255.0)).tolist() == [False, True, False]
