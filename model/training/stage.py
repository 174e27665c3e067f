"""Base class of training stages, which performs the optimization steps.

Discriminators and generators use the logits form of the adversarial loss: its
gradient does not vanish where a sigmoid saturates.
"""

import copy
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Generic

import torch
from torch import Tensor, nn
from torch.nn.functional import binary_cross_entropy_with_logits
from torch.nn.utils import clip_grad_norm_

from model.errors import TrainingError
from model.networks.blocks import Network, kaiming_init, place
from model.networks.names import Precision
from model.networks.size import NetworkSize
from model.training.batch import EncodedBatch
from model.training.codec_loss import CodecLoss
from model.training.options import StageOptions, TrainingOptions
from model.training.parallel import average_gradients, ranks


class EMA(Generic[Network]):
    """Exponential moving average (EMA) of a network, for evaluation and saved models."""

    def __init__(self, network: Network, decay: float) -> None:
        self.network = copy.deepcopy(network).eval().requires_grad_(False)
        self.decay = decay

    @torch.no_grad()
    def update(self, network: Network, step: int) -> None:
        """Update the average with weights and statistics after an optimization step, from 0."""
        decay = min(self.decay, (1 + step) / (10 + step))
        both = (each.state_dict().values() for each in (self.network, network))
        pairs = list(zip(*both, strict=True))
        ours, theirs = zip(*(p for p in pairs if p[0].is_floating_point()), strict=True)
        torch._foreach_lerp_(list(ours), list(theirs), 1 - decay)
        for count, newest in pairs:
            if not count.is_floating_point():
                count.copy_(newest)


Losses = dict[str, float]


def adversarial(logits: Tensor, target: float) -> Tensor:
    """Binary cross-entropy of logits (N, ...) against one target, in float32."""
    logits = logits.float()
    return binary_cross_entropy_with_logits(logits, torch.full_like(logits, target))


@dataclass(frozen=True)
class StepResult:
    """Unweighted losses by name, and the gradient's norm; unless finite, nothing was updated."""

    losses: Losses
    gradient: float


@dataclass(frozen=True)
class Setup:
    """Set-up of all stages of a run: size and number of conditions of the networks, the recipe."""

    size: NetworkSize
    conditions: int
    options: TrainingOptions
    codec_loss: CodecLoss
    device: torch.device
    precision: Precision = "float32"


class Stage(ABC):
    """Training of a generator, by losses and possibly against a discriminator.

    Each batch is split into `parts` whose gradients add up; there is one part until memory runs
    out. On a GPU, steps without a discriminator are `recorded` as one CUDA graph, because Python
    takes longer to start thousands of small kernels than they take to run.
    """

    name: str  # also of the stage's options in the recipe
    image_size: int | None = None  # of the colour images that it learns, if below the scene's

    def __init__(self, generator: nn.Module, discriminator: nn.Module | None, setup: Setup) -> None:
        options, device = setup.options, setup.device
        for network in (generator, discriminator):
            if options.kaiming_init and network is not None:
                kaiming_init(network)
        self.generator = place(generator, device)
        self.discriminator: nn.Module | None = None
        self.discriminator_optimizer: torch.optim.Optimizer | None = None
        if discriminator is not None:
            self.discriminator = place(discriminator, device)
            self.discriminator_optimizer = adam(self.discriminator, options.beta2)
        self.average: EMA[Any] = EMA(self.generator, options.average_decay)
        self.stage: StageOptions = getattr(options, self.name)
        self.options = options
        self.device = device
        self.codec_loss = setup.codec_loss
        self._rounded = setup.precision == "bfloat16"
        self.steps = 0
        self.parts = 1
        self.recorded = device.type == "cuda"
        self.generator_optimizer = adam(self.generator, options.beta2, self.recorded)
        self._recording: RecordedPass | None = None

    def start_from(self, generator: nn.Module) -> None:
        """Copy what fits of a trained generator's weights, before the first step."""
        trained = generator.state_dict()
        for network in (self.generator, self.average.network):
            own = network.state_dict()
            fitting = {n: v for n, v in trained.items() if n in own and v.shape == own[n].shape}
            network.load_state_dict({**own, **fitting})

    def step(self, batch: EncodedBatch, progress: float) -> StepResult:
        """Train on one batch at a fraction of the stage's budget; split it if memory runs out."""
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
        """Attempt a step; `judged` keeps the discriminator's loss: it learns once per batch."""
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
        for part in parts:
            share = len(part) / len(batch)
            for name, loss in self._learn(part, share, adversaries, kept).items():
                reported[name] = reported.get(name, 0.0) + share * float(loss)
        average_gradients(self.generator.parameters())
        gradient = float(clip_grad_norm_(self.generator.parameters(), math.inf))
        if math.isfinite(gradient):
            self.generator_optimizer.step()
            self._count()
        return StepResult(reported, gradient)

    def _learn(
        self, part: EncodedBatch, share: float, adversaries: bool, kept: tuple[Tensor, Any] | None
    ) -> dict[str, Tensor]:
        """Add the gradient of a part of a batch; return its losses by name."""
        fake, extra = kept or self._generated(part)
        losses, weights = self._generator_losses(part, fake, extra), self._weights()
        if adversaries:
            with self._autocast():
                losses["adversarial"] = adversarial(self._judge(part, fake), 1.0)
        total = torch.stack([weights[name] * loss for name, loss in losses.items()]).sum()
        (share * total).backward()  # type: ignore[no-untyped-call]
        return {name: loss.detach() for name, loss in losses.items()}

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
        """Learn from a batch without the CPU; return losses and the gradient's norm."""
        self.generator_optimizer.zero_grad(set_to_none=True)
        losses = self._learn(batch, 1.0, False, None)
        gradient = clip_grad_norm_(self.generator.parameters(), math.inf)
        # The fused optimizer skips its step if this is 1.
        self.generator_optimizer.found_inf = (~gradient.isfinite()).float()  # type: ignore[attr-defined]
        self.generator_optimizer.step()
        self._names = list(losses)
        return torch.stack([*(loss.float() for loss in losses.values()), gradient])

    def _count(self) -> None:
        """Count a step that changed the generator, and update the average."""
        self.average.update(self.generator, self.steps)
        self.steps += 1

    def _prepare(self) -> None:  # noqa: B027
        """Draw random inputs of the next step's losses."""

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
            for group in [] if optimizer is None else optimizer.param_groups:
                if isinstance(group["lr"], Tensor):
                    group["lr"].fill_(self.stage.learning_rate * decay)
                else:
                    group["lr"] = self.stage.learning_rate * decay

    def _autocast(self) -> AbstractContextManager[None]:
        # bfloat16 has float32's exponent range, so no loss scaling is needed.
        dtype = torch.bfloat16 if self._rounded else None
        return torch.autocast(self.device.type, dtype, self._rounded)

    @abstractmethod
    def _real(self, batch: EncodedBatch) -> Tensor:
        """Rendered images of a batch, for the discriminator."""

    def _judge(self, batch: EncodedBatch, image: Tensor) -> Tensor:
        """Discriminator's logits for images of a batch."""
        assert self.discriminator is not None
        logits: Tensor = self.discriminator(batch.inputs, image)
        return logits

    @abstractmethod
    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, Any]:
        """Generate images for a batch; also return other outputs needed by the losses."""

    @abstractmethod
    def _generator_losses(self, batch: EncodedBatch, fake: Tensor, extra: Any) -> dict[str, Tensor]:
        """Generator's losses besides the adversarial one, by name."""

    def _weights(self) -> dict[str, float]:
        """Weights of all losses, by name."""
        options = self.options
        return {
            "adversarial": 1.0,
            "decoded_tf": options.decoded_tf_weight,
            "opacity_l1": options.opacity_l1_weight,
            "l1": options.l1_weight,
        }


FIRST_PASSES = 3  # passes before the recorded one, in which libraries choose algorithms


class RecordedPass:
    """A training pass that is recorded as a CUDA graph and then replayed."""

    def __init__(self, run: Callable[[EncodedBatch], Tensor]) -> None:
        self._run = run
        self._passes = 0
        self._recorded: tuple[torch.cuda.CUDAGraph, EncodedBatch, Tensor] | None = None

    def run(self, batch: EncodedBatch) -> Tensor:
        """Run the pass on a batch; the results are valid until the next pass."""
        if self._recorded is not None and len(self._recorded[1]) != len(batch):
            # The batch size has changed, for example in the last batch.
            self._recorded, self._passes = None, 0
        if self._recorded is None and self._passes < FIRST_PASSES:
            self._passes += 1
            return self._beside(batch)
        if self._recorded is None:
            graph, kept = torch.cuda.CUDAGraph(), batch.map(torch.clone)
            # Other threads prepare batches on the same GPU meanwhile.
            with torch.cuda.graph(graph, capture_error_mode="thread_local"):
                result = self._run(kept)
            self._recorded = graph, kept, result
        graph, kept, result = self._recorded
        for ours, theirs in zip(kept.tensors, batch.tensors, strict=True):
            ours.copy_(theirs)
        graph.replay()
        return result

    def _beside(self, batch: EncodedBatch) -> Tensor:
        # On a separate stream, as recordings require.
        stream: torch.cuda.Stream = torch.cuda.Stream()  # type: ignore[no-untyped-call]
        current = torch.cuda.current_stream()
        stream.wait_stream(current)
        with torch.cuda.stream(stream):
            result = self._run(batch)
        current.wait_stream(stream)
        return result


BETA1 = 0.5

WARM_UP = 0.03  # fraction of a stage over which a cosine schedule's learning rate first rises
LEAST_DECAY = 1e-3  # of a cosine schedule's learning rate, first and last, as a fraction


def adam(network: nn.Module, beta2: float, recorded: bool = False) -> torch.optim.Adam:
    """Return an Adam optimizer with the paper's beta1 (section 6, implementation details)."""
    parameters = list(network.parameters())
    rate: float | Tensor = 1e-3
    if recorded:
        # A plain number would be recorded as a constant.
        rate = torch.tensor(rate, device=parameters[0].device)
    return torch.optim.Adam(parameters, rate, betas=(BETA1, beta2), fused=True, capturable=recorded)


def cosine_decay(progress: float) -> float:
    """Learning-rate factor at a fraction of a stage: it rises linearly, then falls as a cosine."""
    if progress < WARM_UP:
        return max(LEAST_DECAY, progress / WARM_UP)
    angle = math.pi * min(1.0, (progress - WARM_UP) / (1 - WARM_UP))
    return max(LEAST_DECAY, (1 + math.cos(angle)) / 2)


def halving_decay(progress: float, halvings: float) -> float:
    """Learning-rate factor of a rate that is halved a number of times over its stage."""
    return float(0.5 ** int(progress * halvings))
