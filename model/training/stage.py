"""What every stage of training does: one optimization step after another.

Discriminators and generators use the logits form of the adversarial loss: its
gradient does not vanish where a sigmoid saturates.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.utils import clip_grad_norm_

from model.errors import TrainingError
from model.networks.blocks import kaiming_init, place
from model.training.batch import EncodedBatch
from model.training.ema import EMA
from model.training.execution import STANDARD, Execution
from model.training.losses import adversarial
from model.training.optimizers import adam, cosine_decay, halving_decay, set_rate
from model.training.options import StageOptions, TrainingOptions
from model.training.parallel import average_gradients, ranks

Losses = dict[str, float]


@dataclass(frozen=True)
class StepResult:
    """What one optimization step tells.

    Attributes
    ----------
    losses : dict of float
        Each loss by name, without its factor in the sum.
    gradient : float
        Norm of the generator's gradient. The generator has not been changed
        where it is not finite.
    """

    losses: Losses
    gradient: float


class Stage(ABC):
    """A generator and a discriminator that are trained against each other.

    Subclasses say how a fake image is made, what each network is given, and
    what the generator pays beside the adversarial loss.

    Attributes
    ----------
    generator, discriminator : torch.nn.Module
    average : EMA
        The generator that is evaluated and shipped.
    steps : int
        Optimization steps done.
    parts : int
        Parts that batches are learned from in; more than one after the memory
        has run out. Batch norm then sees the parts.
    execution : Execution
        How steps are computed.
    """

    name: str

    def __init__(
        self,
        generator: nn.Module,
        discriminator: nn.Module,
        stage: StageOptions,
        options: TrainingOptions,
        device: torch.device,
        execution: Execution = STANDARD,
    ) -> None:
        if options.kaiming_init:
            kaiming_init(generator)
            kaiming_init(discriminator)
        last = execution.channels_last
        self.generator = place(generator, device, last)
        self.discriminator = place(discriminator, device, last)
        self.average: EMA[Any] = EMA(self.generator, options.average_decay)
        self.stage = stage
        self.options = options
        self.device = device
        self.steps = 0
        self.parts = 1
        self.execution = execution
        fused = execution.fused
        self.generator_optimizer = adam(self.generator, options.beta2, options.grid_rate, fused)
        self.discriminator_optimizer = adam(self.discriminator, options.beta2, fused=fused)
        if execution.compiled:
            self._generate = torch.compile(self._generate)  # type: ignore[method-assign]

    def start_from(self, generator: nn.Module) -> None:
        """Take over the weights of a trained generator; before the first step."""
        for network in (self.generator, self.average.network):
            network.load_state_dict(generator.state_dict())

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

        Raises
        ------
        TrainingError
            When not even two samples fit into memory.
        """
        self._set_learning_rate(progress)
        adversaries = progress >= self.options.adversarial_start
        judged: Losses = {}
        while True:
            try:
                return self._step(batch, adversaries, judged)
            except torch.OutOfMemoryError as error:
                self._split(batch, error)

    def _step(self, batch: EncodedBatch, adversaries: bool, judged: Losses) -> StepResult:
        """One try; `judged` keeps the discriminator's loss, which learns once only."""
        parts = batch.parts(self.parts)
        # Only of a whole batch may the graph be kept while the discriminator is trained.
        kept = self._generated(batch) if len(parts) == 1 else None
        if adversaries and not judged:
            judged["discriminator"] = self._train_discriminator(parts, kept)
        reported = dict(judged)
        self.generator_optimizer.zero_grad(set_to_none=True)
        weights = self._weights()
        for part in parts:
            share = len(part) / len(batch)
            fake, extra = kept or self._generated(part)
            losses = self._generator_losses(part, fake, extra)
            if adversaries:
                with self._autocast():
                    losses["adversarial"] = adversarial(self._judge(part, fake), 1.0)
            total = torch.stack([weights[name] * loss for name, loss in losses.items()]).sum()
            (share * total).backward()  # type: ignore[no-untyped-call]
            for name, loss in losses.items():
                reported[name] = reported.get(name, 0.0) + share * float(loss.detach())
        average_gradients(self.generator.parameters())
        gradient = float(clip_grad_norm_(self.generator.parameters(), math.inf))
        if math.isfinite(gradient):
            self.generator_optimizer.step()
            self.average.update(self.generator, self.steps)
            self.steps += 1
        return StepResult(reported, gradient)

    def _generated(self, batch: EncodedBatch) -> tuple[Tensor, Any]:
        with self._autocast():
            return self._generate(batch)

    def _train_discriminator(
        self, parts: list[EncodedBatch], kept: tuple[Tensor, Any] | None
    ) -> float:
        """One step of the discriminator; returns its loss."""
        self.discriminator_optimizer.zero_grad(set_to_none=True)
        whole = sum(map(len, parts))
        reported = 0.0
        for part in parts:
            with torch.no_grad():
                fake, _ = kept or self._generated(part)
            with self._autocast():
                real_logits = self._judge(part, self._real(part))
                fake_logits = self._judge(part, fake.detach())
            loss = adversarial(real_logits, 1.0) + adversarial(fake_logits, 0.0)
            loss = len(part) / whole * loss
            loss.backward()  # type: ignore[no-untyped-call]
            reported += float(loss.detach())
        average_gradients(self.discriminator.parameters())
        self.discriminator_optimizer.step()
        return reported

    def _split(self, batch: EncodedBatch, error: torch.OutOfMemoryError) -> None:
        """Have batches learned from in twice as many parts."""
        # The other ranks are waiting for this one's gradients, and do not know.
        if ranks() > 1 or len(batch) <= 2 * self.parts:
            raise TrainingError(
                f"The {self.name} stage has run out of memory with batches of {len(batch)} samples "
                f"in {self.parts} parts; choose a smaller preset, or smaller batches.",
                set=f"{self.name}.batch_size={max(2, len(batch) // 2)}",
            ) from error
        self.parts *= 2
        if self.device.type == "cuda":
            torch.cuda.empty_cache()

    def _set_learning_rate(self, progress: float) -> None:
        halvings = self.stage.halvings
        cosine = self.options.cosine
        decay = cosine_decay(progress) if cosine else halving_decay(progress, halvings)
        for optimizer in (self.generator_optimizer, self.discriminator_optimizer):
            set_rate(optimizer, self.stage.learning_rate * decay)

    def _autocast(self) -> AbstractContextManager[None]:
        # bfloat16 keeps float32's exponents: no loss scaling, no overflow.
        precision = self.execution.dtype
        rounded = precision != torch.float32
        return torch.autocast(self.device.type, precision if rounded else None, rounded)

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
