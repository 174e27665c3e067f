"""The stages of a training run, in order, and their fractions of the budget."""

from __future__ import annotations

import torch

from model.networks.generator_network import GeneratorNetwork
from model.networks.names import Precision
from model.networks.paper.opacity import OpacityGenerator
from model.networks.paper.translation import TranslationGenerator
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.training.codec_loss import CodecLoss
from model.training.joint import JointStage, SmallStage, small_size
from model.training.options import TrainingOptions
from model.training.stage import Stage
from model.training.stages import OpacityStage, TranslationStage


class Schedule:
    """Stages of a run and their fractions of the budget.

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
        precision: Precision = "float32",
    ) -> None:
        self._size = size
        torch.manual_seed(options.seed)
        self.stages: dict[str, Stage]
        codec_loss, conditions = CodecLoss(scene, options), condition_numbers(scene)
        if options.one_stage:
            rest = conditions, codec_loss, device, precision
            self.stages, self.ends = {}, {}
            if options.small_time_share and size.image_size > size.opacity_size:
                small = _generator(small_size(size), conditions)
                self.stages["small"] = SmallStage(size, options, small, *rest)
                self.ends["small"] = options.small_time_share
            generator = _generator(size, conditions)
            self.stages["joint"] = JointStage(size, options, generator, *rest)
            self.ends["joint"] = 1.0
        else:
            opacity_generator = OpacityGenerator(size)
            opacity = OpacityStage(size, options, opacity_generator, codec_loss, device, precision)
            average = opacity.average.network
            translation = TranslationStage(size, options, average, conditions, device, precision)
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
            begun = [s for s in self.stages.values() if s.steps] or [self.stages["joint"]]
            network: GeneratorNetwork = begun[-1].average.network
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
            A generator of the run's scene and size, or of smaller images.
        """
        if "small" in self.stages:
            # What it would learn is learned.
            del self.stages["small"], self.ends["small"]
        for name, stage in self.stages.items():
            stage.start_from(generator if name == "joint" else getattr(generator, name))

    def enter(self, name: str) -> None:
        """Prepare the first step of the named stage, once those before it are over."""
        if name == "joint" and "small" in self.stages:
            self.stages[name].start_from(self.stages["small"].average.network)

    def draws_color(self, name: str) -> bool:
        """Return True if the named stage, or one before it, trains colour images."""
        return name != "opacity"

    def draws_whole_images(self, name: str) -> bool:
        """Return True if the generator draws colour images of its own size in the named stage."""
        return name not in ("opacity", "small")


def _generator(size: NetworkSize, conditions: int) -> TwoStageGenerator:
    return TwoStageGenerator(size, translation=TranslationGenerator(size, conditions))
