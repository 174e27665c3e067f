"""The stages of a training run, in order, and their fractions of the budget."""

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
    """Stages of a run and their fractions of the budget.

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
        By name, in order.
    ends : dict of float
        Fraction of the budget used when each stage ends.
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
        """Names of the stages, in order."""
        return list(self.stages)

    def share(self, name: str, spent: float) -> float:
        """Fraction of a stage's part of the budget used.

        Parameters
        ----------
        name : str
        spent : float
            Fraction of the whole budget used.

        Returns
        -------
        float
            From 0; 1 or more when the stage is over. 0 also for a run that is resumed
            with a larger budget and has not used its earlier stages' part of it.
        """
        number = self.names.index(name)
        first = self.ends[self.names[number - 1]] if number else 0.0
        return max(0.0, (spent - first) / (self.ends[name] - first))

    def begun(self, name: str) -> list[Stage]:
        """Return the stages up to and including the named one; all for "done"."""
        if name == "done":
            return list(self.stages.values())
        return list(self.stages.values())[: self.names.index(name) + 1]

    def generator(self) -> GeneratorNetwork:
        """Return the averaged networks as one generator, in evaluation mode."""
        if "joint" in self.stages:
            network: GeneratorNetwork = self.stages["joint"].average.network
            return network.eval()
        opacity, translation = self.stages["opacity"], self.stages["translation"]
        return TwoStageGenerator(
            self._size, opacity.average.network, translation.average.network
        ).eval()

    def start_from(self, generator: GeneratorNetwork) -> None:
        """Copy a trained generator's weights; to be called before the first step.

        Parameters
        ----------
        generator : GeneratorNetwork
            A generator of the run's size and scene.
        """
        for name, stage in self.stages.items():
            stage.start_from(generator if name == "joint" else getattr(generator, name))

    def draws_color(self, name: str) -> bool:
        """Return True if the named stage, or one before it, trains colour images."""
        return name != "opacity"
