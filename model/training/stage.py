"""Base class of training stages, which performs the optimization steps.

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
from model.networks.names import Precision
from model.training.batch import EncodedBatch
from model.training.ema import EMA
from model.training.losses import adversarial
from model.training.optimizers import adam, cosine_decay, halving_decay, set_rate
from model.training.options import StageOptions, TrainingOptions
from model.training.parallel import average_gradients, ranks
from model.training.recording import RecordedPass

Losses = dict[str, float]


@dataclass(frozen=True)
class StepResult:
    """Losses and gradient norm of one optimization step.

    Attributes
    ----------
    losses : dict of float
        Unweighted losses by name.
    gradient : float
        Norm of the generator's gradient. If it is not finite, the generator
        was not updated.
    """

    losses: Losses
    gradient: float


class Stage(ABC):
    """Training of a generator, by losses and, if there is one, against a discriminator.

    Subclasses define the generated image, the networks' inputs and the
    generator's losses besides the adversarial one.

    Attributes
    ----------
    image_size : int or None
        Width and height of the colour images it learns, if smaller than the scene's.
    average : EMA
        Average of the generator, for evaluation and saved models.
    steps : int
        Number of optimization steps done.
    parts : int
        Number of parts that each batch is split into, accumulating gradients;
        more than 1 after memory has run out. Batch-norm statistics are then
        those of the parts.
    recorded : bool
        Whether steps without a discriminator are recorded once, as a CUDA graph, and then
        repeated, as on a GPU: a step is thousands of small kernels, and starting each of them
        from Python takes longer than they do.
    """

    name: str
    image_size: int | None = None

    def __init__(
        self,
        generator: nn.Module,
        discriminator: nn.Module | None,
        stage: StageOptions,
        options: TrainingOptions,
        device: torch.device,
        precision: Precision = "float32",
    ) -> None:
        if options.kaiming_init:
            kaiming_init(generator)
        self.generator = place(generator, device)
        self.discriminator: nn.Module | None = None
        self.discriminator_optimizer: torch.optim.Optimizer | None = None
        if discriminator is not None:
            if options.kaiming_init:
                kaiming_init(discriminator)
            self.discriminator = place(discriminator, device)
            self.discriminator_optimizer = adam(self.discriminator, options.beta2)
        self.average: EMA[Any] = EMA(self.generator, options.average_decay)
        self.stage = stage
        self.options = options
        self.device = device
        self._rounded = precision == "bfloat16"
        self.steps = 0
        self.parts = 1
        self.recorded = device.type == "cuda"
        self.generator_optimizer = adam(self.generator, options.beta2, self.recorded)
        self._recording: RecordedPass | None = None

    def start_from(self, generator: nn.Module) -> None:
        """Copy the weights of a trained generator; to be called before the first step.

        Of one that draws smaller images, layers that the larger ones add or change keep
        their initial weights.
        """
        trained = generator.state_dict()
        for network in (self.generator, self.average.network):
            own = network.state_dict()
            fitting = {n: v for n, v in trained.items() if n in own and v.shape == own[n].shape}
            network.load_state_dict({**own, **fitting})

    def step(self, batch: EncodedBatch, progress: float) -> StepResult:
        """Train the generator, and once it has joined the discriminator, on one batch.

        Parameters
        ----------
        progress : float
            Fraction of this stage's budget used, 0..1; determines the learning rate.

        Returns
        -------
        StepResult

        Raises
        ------
        TrainingError
            When memory runs out even with parts of two samples, or with several ranks.
        """
        self._set_learning_rate(progress)
        joined = progress >= self.options.adversarial_start
        adversaries = joined and self.discriminator is not None
        judged: Losses = {}
        while True:
            try:
                return self._step(batch, adversaries, judged)
            except torch.OutOfMemoryError as error:
                self._split(batch, error)

    def _step(self, batch: EncodedBatch, adversaries: bool, judged: Losses) -> StepResult:
        """Attempt a step; `judged` keeps the discriminator's loss, so that it learns only once."""
        self._prepare()
        if self.recorded and not adversaries and self.parts == 1 and ranks() == 1:
            return self._recorded_step(batch)
        parts = batch.parts(self.parts)
        # Keep the graph while the discriminator is trained only if the batch is not split.
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
                    losses |= self._feature_losses(part, fake)
            total = torch.stack([weights[name] * loss for name, loss in losses.items()]).sum()
            (share * total).backward()  # type: ignore[no-untyped-call]
            for name, loss in losses.items():
                reported[name] = reported.get(name, 0.0) + share * float(loss.detach())
        average_gradients(self.generator.parameters())
        gradient = float(clip_grad_norm_(self.generator.parameters(), math.inf))
        if math.isfinite(gradient):
            self.generator_optimizer.step()
            self._count()
        return StepResult(reported, gradient)

    def _recorded_step(self, batch: EncodedBatch) -> StepResult:
        """Attempt a step without a discriminator by a recorded pass."""
        if self._recording is None:
            self._recording = RecordedPass(self._pass)
        values = self._recording.run(batch)
        *losses, gradient = values.tolist()
        if math.isfinite(gradient):
            self._count()
        return StepResult(dict(zip(self._names, losses, strict=True)), gradient)

    def _pass(self, batch: EncodedBatch) -> Tensor:
        """Learn from a batch; return the losses, named by ``_names``, and the gradient's norm.

        All of it is done on the device, which must not wait for this process.
        """
        self.generator_optimizer.zero_grad(set_to_none=True)
        fake, extra = self._generated(batch)
        losses = self._generator_losses(batch, fake, extra)
        weights = self._weights()
        torch.stack([weights[name] * loss for name, loss in losses.items()]).sum().backward()  # type: ignore[no-untyped-call]
        gradient = clip_grad_norm_(self.generator.parameters(), math.inf)
        # What the fused optimizer skips its step by.
        self.generator_optimizer.found_inf = (~gradient.isfinite()).float()  # type: ignore[attr-defined]
        self.generator_optimizer.step()
        self._names = list(losses)
        return torch.stack([*(loss.detach().float() for loss in losses.values()), gradient])

    def _count(self) -> None:
        """Count a step that has changed the generator, and average the generator."""
        self.average.update(self.generator, self.steps)
        self.steps += 1

    def _prepare(self) -> None:  # noqa: B027
        """Draw what the losses of the next step need besides its batch."""

    def _generated(self, batch: EncodedBatch) -> tuple[Tensor, Any]:
        with self._autocast():
            return self._generate(batch)

    def _train_discriminator(
        self, parts: list[EncodedBatch], kept: tuple[Tensor, Any] | None
    ) -> float:
        """Perform a step of the discriminator and return its loss."""
        assert self.discriminator is not None and self.discriminator_optimizer is not None
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
        """Double the number of parts after memory has run out."""
        # Other ranks wait for this one's gradients and would not split their batches.
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
            if optimizer is not None:
                set_rate(optimizer, self.stage.learning_rate * decay)

    def _autocast(self) -> AbstractContextManager[None]:
        # bfloat16 has float32's exponent range, so no loss scaling is needed.
        dtype = torch.bfloat16 if self._rounded else None
        return torch.autocast(self.device.type, dtype, self._rounded)

    def _real(self, batch: EncodedBatch) -> Tensor:
        """Rendered images of a batch, which the discriminator is shown."""
        raise NotImplementedError

    def _judge(self, batch: EncodedBatch, image: Tensor) -> Tensor:
        """Discriminator's logits for images of a batch."""
        raise NotImplementedError

    def _feature_losses(self, batch: EncodedBatch, fake: Tensor) -> dict[str, Tensor]:
        """Losses by the discriminator's features, once it has joined, by name."""
        return {}

    @abstractmethod
    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, Any]:
        """Generate images for a batch; also return other outputs needed by the losses."""

    @abstractmethod
    def _generator_losses(self, batch: EncodedBatch, fake: Tensor, extra: Any) -> dict[str, Tensor]:
        """Generator's losses besides the adversarial one, by name."""

    @abstractmethod
    def _weights(self) -> dict[str, float]:
        """Weight of each of the generator's losses, by name."""
