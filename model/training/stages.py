"""The two stages of training: networks, losses and one optimisation step each.

Discriminators and generators use the logits form of the adversarial loss: its
gradient does not vanish where a sigmoid saturates.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.utils import clip_grad_norm_

from model.encoding import EncodedBatch
from model.networks.blocks import NetworkSize, keep_variance, place
from model.networks.opacity import OpacityDiscriminator, OpacityNetwork
from model.networks.translation import TranslationDiscriminator, TranslationGenerator
from model.training.average import WeightAverage
from model.training.losses import adversarial, decoded_tf_error, l1
from model.training.optimisers import adam, cosine_decay, halving_decay, set_rate
from model.training.options import StageOptions, TrainingOptions
from model.training.parallel import average_gradients

Losses = dict[str, float]


@dataclass(frozen=True)
class StepResult:
    """What one optimisation step tells.

    Attributes
    ----------
    losses : dict of float
        Each loss by name, without its factor in the sum.
    errors : Tensor of float32, shape (N,)
        Image error of each sample: its mean absolute difference.
    gradient : float
        Norm of the generator's gradient. The generator has not been changed
        where it is not finite.
    """

    losses: Losses
    errors: Tensor
    gradient: float


class Stage(ABC):
    """A generator and a discriminator that are trained against each other.

    Subclasses say how a fake image is made, what each network is given, and
    what the generator pays beside the adversarial loss.

    Attributes
    ----------
    generator, discriminator : torch.nn.Module
    average : WeightAverage
        The generator that is evaluated and shipped.
    steps : int
        Optimisation steps done.
    """

    name: str

    def __init__(
        self,
        generator: nn.Module,
        discriminator: nn.Module,
        stage: StageOptions,
        options: TrainingOptions,
        device: torch.device,
    ) -> None:
        if options.keep_variance:
            keep_variance(generator)
            keep_variance(discriminator)
        self.generator = place(generator, device)
        self.discriminator = place(discriminator, device)
        self.average: WeightAverage[Any] = WeightAverage(self.generator, options.average_decay)
        self.stage = stage
        self.options = options
        self.device = device
        self.steps = 0
        self.generator_optimiser = adam(self.generator, options.grid_rate)
        self.discriminator_optimiser = adam(self.discriminator)

    def begin(self) -> None:  # noqa: B027  (most stages have nothing to take over)
        """Take over what earlier stages have learned; called when the stage begins."""

    def step(self, batch: EncodedBatch, progress: float) -> StepResult:
        """Train both networks on one batch.

        Parameters
        ----------
        batch : EncodedBatch
        progress : float
            Share of this stage's budget that is used up, 0..1; the learning
            rate follows it.

        Returns
        -------
        StepResult
        """
        self._set_learning_rate(progress)
        adversaries = progress >= self.options.adversarial_start
        with self._autocast():
            fake, extra = self._generate(batch)
        errors = (fake.detach().float() - self._real(batch)).abs().mean(dim=(1, 2, 3))
        losses = self._generator_losses(batch, fake, extra)
        reported: Losses = {}
        if adversaries:
            reported["discriminator"] = self._train_discriminator(batch, fake.detach())
            with self._autocast():
                losses["adversarial"] = adversarial(self._judge(batch, fake), 1.0, batch.weight)
        weights = self._weights()
        total = torch.stack([weights[name] * loss for name, loss in losses.items()]).sum()
        self.generator_optimiser.zero_grad(set_to_none=True)
        total.backward()  # type: ignore[no-untyped-call]
        average_gradients(self.generator.parameters())
        gradient = float(clip_grad_norm_(self.generator.parameters(), math.inf))
        reported |= {name: float(loss.detach()) for name, loss in losses.items()}
        if math.isfinite(gradient):
            self.generator_optimiser.step()
            self.average.update(self.generator, self.steps)
            self.steps += 1
        return StepResult(reported, errors, gradient)

    def _train_discriminator(self, batch: EncodedBatch, fake: Tensor) -> float:
        """One step of the discriminator; returns its loss."""
        with self._autocast():
            real_logits = self._judge(batch, self._real(batch))
            fake_logits = self._judge(batch, fake)
        loss = adversarial(real_logits, 1.0, batch.weight)
        loss = loss + adversarial(fake_logits, 0.0, batch.weight)
        self.discriminator_optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        average_gradients(self.discriminator.parameters())
        self.discriminator_optimiser.step()
        return float(loss.detach())

    def _set_learning_rate(self, progress: float) -> None:
        halvings = self.stage.halvings
        cosine = self.options.cosine
        decay = cosine_decay(progress) if cosine else halving_decay(progress, halvings)
        for optimiser in (self.generator_optimiser, self.discriminator_optimiser):
            set_rate(optimiser, self.stage.learning_rate * decay)

    def _autocast(self) -> AbstractContextManager[None]:
        # bfloat16 keeps float32's exponents: no loss scaling, no overflow.
        return torch.autocast(self.device.type, torch.bfloat16)

    @abstractmethod
    def _real(self, batch: EncodedBatch) -> Tensor:
        """The rendered images of a batch."""

    @abstractmethod
    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, Any]:
        """Images made for a batch, and what else the generator's losses need."""

    @abstractmethod
    def _judge(self, batch: EncodedBatch, image: Tensor) -> Tensor:
        """The discriminator's logits for images of a batch."""

    @abstractmethod
    def _generator_losses(self, batch: EncodedBatch, fake: Tensor, extra: Any) -> dict[str, Tensor]:
        """The generator's losses beside the adversarial one."""

    @abstractmethod
    def _weights(self) -> dict[str, float]:
        """Weight of each of the generator's losses."""


class OpacityStage(Stage):
    """Stage 1: the opacity GAN with its decoded-TF loss (paper, Eq. 7)."""

    name = "opacity"
    generator: OpacityNetwork
    average: WeightAverage[OpacityNetwork]

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        opacity: OpacityNetwork,
        device: torch.device,
    ) -> None:
        super().__init__(opacity, OpacityDiscriminator(size), options.opacity, options, device)

    def _real(self, batch: EncodedBatch) -> Tensor:
        return batch.opacity_image

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, Tensor]:
        output = self.generator(batch.view, batch.opacity_tf)
        return output.image, output.decoded_tf

    def _judge(self, batch: EncodedBatch, image: Tensor) -> Tensor:
        logits: Tensor = self.discriminator(batch.view, batch.opacity_tf, image)
        return logits

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: Tensor
    ) -> dict[str, Tensor]:
        return {
            "decoded_tf": decoded_tf_error(extra, batch),
            "opacity_l1": l1(fake, batch.opacity_image, batch.weight),
        }

    def _weights(self) -> dict[str, float]:
        return {
            "adversarial": 1.0,
            "decoded_tf": self.options.decoded_tf_weight,
            "opacity_l1": self.options.opacity_l1_weight,
        }


class ColorStage(Stage):
    """A stage whose generator draws colour images, judged by :class:`TranslationDiscriminator`."""

    def _real(self, batch: EncodedBatch) -> Tensor:
        return batch.image

    def _judge(self, batch: EncodedBatch, image: Tensor) -> Tensor:
        logits: Tensor = self.discriminator(batch.view, batch.opacity_tf, batch.color_tf, image)
        return logits


class TranslationStage(ColorStage):
    """Stage 2: the translation GAN with its l1 loss (paper, Eq. 8), stage 1 frozen.

    Parameters
    ----------
    size : NetworkSize
    options : TrainingOptions
    opacity : OpacityNetwork
        The trained generator of stage 1; it gives the latent codes, and the
        opacity images of the predicted share of samples.
    device : torch.device
    """

    name = "translation"
    generator: TranslationGenerator

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        opacity: OpacityNetwork,
        device: torch.device,
    ) -> None:
        super().__init__(
            TranslationGenerator(size),
            TranslationDiscriminator(size),
            options.translation,
            options,
            device,
        )
        self.opacity = opacity

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, Tensor]:
        with torch.no_grad():
            latent = self.opacity.encode(batch.opacity_tf)
            opacity = self._opacity_images(batch, latent)
        return self.generator(batch.view, latent, batch.color_tf, opacity), latent

    def _opacity_images(self, batch: EncodedBatch, latent: Tensor) -> Tensor:
        """Rendered opacity images, with the predicted share replaced."""
        share = self.options.predicted_share
        if share == 0:
            return batch.opacity_image
        predicted = self.opacity.draw(batch.view, latent).float()
        rng = np.random.default_rng([self.options.seed, self.steps])
        chosen = torch.from_numpy(rng.random(len(predicted)) < share).to(self.device)
        return torch.where(chosen[:, None, None, None], predicted, batch.opacity_image)

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: Tensor
    ) -> dict[str, Tensor]:
        return {"l1": l1(fake, batch.image, batch.weight)}

    def _weights(self) -> dict[str, float]:
        return {"adversarial": 1.0, "l1": self.options.l1_weight}
