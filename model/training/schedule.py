"""The stages of a training run, in their order, and what each gets of the budget."""

from __future__ import annotations

import torch

from model.networks.build import build_generator, build_opacity
from model.networks.generator_network import GeneratorNetwork
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.training.codec_loss import CodecLoss
from model.training.execution import STANDARD, Execution
from model.training.joint import JointStage
from model.training.options import TrainingOptions
from model.training.stage import Stage
from model.training.stages import OpacityStage, TranslationStage


class Schedule:
    """All stages of a run.

    Parameters
    ----------
    size : NetworkSize
    options : TrainingOptions
    scene : Scene
    device : torch.device
    execution : Execution

    Attributes
    ----------
    stages : dict of Stage
        By name, in their order.
    ends : dict of float
        Share of the budget that is used up when a stage ends.
    """

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        scene: Scene,
        device: torch.device,
        execution: Execution = STANDARD,
    ) -> None:
        self._size = size
        torch.manual_seed(options.seed)
        self.stages: dict[str, Stage]
        codec_loss, conditions = CodecLoss(scene, options), condition_numbers(scene)
        # Both images of a feature grid come from one network.
        if options.one_stage or size.architecture == "grid":
            generator = build_generator(size, scene)
            self.stages = {
                "joint": JointStage(
                    size, options, generator, conditions, codec_loss, device, execution
                )
            }
            self.ends = {"joint": 1.0}
        else:
            network = build_opacity(size, scene)
            opacity = OpacityStage(size, options, network, codec_loss, device, execution)
            average = opacity.average.network
            translation = TranslationStage(size, options, average, conditions, device, execution)
            self.stages = {"opacity": opacity, "translation": translation}
            self.ends = {"opacity": options.opacity_time_share, "translation": 1.0}

    @property
    def names(self) -> list[str]:
        """Names of the stages, in their order."""
        return list(self.stages)

    def share(self, name: str, spent: float) -> float:
        """Share of a stage's part of the budget that is used up.

        Parameters
        ----------
        name : str
        spent : float
            Share of the whole budget that is used up.

        Returns
        -------
        float
            From 0; 1 or more when the stage is over. A run that is resumed with
            a larger budget may be before the start of its stage: 0.
        """
        number = self.names.index(name)
        first = self.ends[self.names[number - 1]] if number else 0.0
        return max(0.0, (spent - first) / (self.ends[name] - first))

    def begun(self, name: str) -> list[Stage]:
        """The stages up to the named one; all for "done"."""
        if name == "done":
            return list(self.stages.values())
        return list(self.stages.values())[: self.names.index(name) + 1]

    def generator(self) -> GeneratorNetwork:
        """The averaged networks as one generator."""
        if "joint" in self.stages:
            network: GeneratorNetwork = self.stages["joint"].average.network
            return network.eval()
        opacity, translation = self.stages["opacity"], self.stages["translation"]
        return TwoStageGenerator(
            self._size, opacity.average.network, translation.average.network
        ).eval()

    def start_from(self, generator: GeneratorNetwork) -> None:
        """Take over a trained generator's weights; before the first step.

        Parameters
        ----------
        generator : GeneratorNetwork
            Of the run's size and scene.
        """
        for name, stage in self.stages.items():
            stage.start_from(generator if name == "joint" else getattr(generator, name))

    def draws_color(self, name: str) -> bool:
        """Whether colour images have been trained by the time of the named stage."""
        return name != "opacity"
