"""Construction of the networks of each architecture."""

from __future__ import annotations

from model.networks.generator_network import GeneratorNetwork, OpacityNetwork
from model.networks.paper.opacity import OpacityGenerator
from model.networks.paper.translation import TranslationGenerator
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene


def build_generator(size: NetworkSize, scene: Scene) -> GeneratorNetwork:
    """Build the complete generator of a size's architecture, with initial weights."""
    if size.architecture == "grid":
        # Late, as below: its kernels take Numba, which the paper's networks do without.
        from model.networks.grid.grid_generator import GridGenerator

        return GridGenerator(size, scene)
    translation = TranslationGenerator(size, condition_numbers(scene))
    return TwoStageGenerator(size, build_opacity(size, scene), translation)


def build_opacity(size: NetworkSize, scene: Scene) -> OpacityNetwork:
    """Build the opacity generator of a size's architecture, with initial weights."""
    if size.architecture == "paper":
        return OpacityGenerator(size)
    from model.networks.grid.grid_opacity import GridOpacityGenerator

    return GridOpacityGenerator(size, scene)
