"""Construction of the networks of each architecture."""

from __future__ import annotations

from model.networks.generator_network import GeneratorNetwork
from model.networks.paper.opacity import OpacityGenerator
from model.networks.paper.translation import TranslationGenerator
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.scene.volume import Volume


def build_generator(
    size: NetworkSize, scene: Scene, volume: Volume | None = None
) -> GeneratorNetwork:
    """Build the complete generator of a size's architecture, with initial weights.

    Parameters
    ----------
    size : NetworkSize
    scene : Scene
    volume : Volume, optional
        The scene's volume, for a coarse volume that a network holds; without it that is
        empty until weights are loaded.
    """
    if size.architecture == "refined":
        # Late, as its kernels take Numba, which the paper's networks do without.
        from model.networks.refined.coarse_volume import CoarseVolume
        from model.networks.refined.refined_generator import RefinedGenerator

        coarse = None if volume is None else CoarseVolume.of(volume, size.nodes)
        return RefinedGenerator(size, scene, coarse)
    translation = TranslationGenerator(size, condition_numbers(scene))
    return TwoStageGenerator(size, OpacityGenerator(size), translation)
