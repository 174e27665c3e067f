"""The networks of an architecture, by name."""

from __future__ import annotations

from model.networks.blocks import NetworkSize
from model.networks.grid_generator import GridGenerator
from model.networks.grid_opacity import GridOpacityGenerator
from model.networks.opacity import OpacityGenerator, OpacityNetwork
from model.networks.two_stage import GeneratorNetwork, TwoStageGenerator
from model.scene import Scene


def build_generator(size: NetworkSize, scene: Scene) -> GeneratorNetwork:
    """The whole generator of a size's architecture, with its first weights."""
    if size.architecture == "grid":
        return GridGenerator(size, scene)
    return TwoStageGenerator(size, build_opacity(size, scene))


def build_opacity(size: NetworkSize, scene: Scene) -> OpacityNetwork:
    """The opacity generator of a size's architecture."""
    if size.architecture == "paper":
        return OpacityGenerator(size)
    return GridOpacityGenerator(size, scene)
