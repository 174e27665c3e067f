"""Construction of the complete generator."""

from __future__ import annotations

from model.networks.paper.opacity import OpacityGenerator
from model.networks.paper.translation import TranslationGenerator
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene


def build_generator(size: NetworkSize, scene: Scene) -> TwoStageGenerator:
    """Build the networks of a size for a scene's inputs, with initial weights."""
    translation = TranslationGenerator(size, condition_numbers(scene))
    return TwoStageGenerator(size, OpacityGenerator(size), translation)
