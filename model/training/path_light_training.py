"""Training of the network behind the denoiser, by distances from pictures of many samples.

The target's noise is independent of the input's and averages out, so a picture of 64 samples
teaches as much as an exact one.
"""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from model.errors import CheckpointError, TrainingError
from model.networks.blocks import place
from model.networks.path_light_network import (
    PathLightNetwork,
    PathLightSize,
    network_inputs,
    permuted,
)
from model.samples.path_light_pairs import FEW, Pairs
from model.training.stage import EMA

SHARES = (0.5, 0.25, 0.25)  # shares of the numbers of samples in `FEW`
CUT = 96  # width and height of the parts of pictures that are learned, in pixels
REPORT_STEPS = 500  # steps between two reports


@dataclass(frozen=True)
class PathLightOptions:
    """Options of training the network; the minutes include those of earlier runs."""

    minutes: float
    size: PathLightSize = field(default_factory=PathLightSize)
    batch_size: int = 8
    learning_rate: float = 1.5e-3  # follows a cosine to a hundredth of it
    averaging: float = 0.998  # decay of the moving average of the weights
    seed: int = 0


@dataclass(frozen=True)
class PathLightErrors:
    """RMSE of pictures of so many samples, by volume, before and after the network."""

    samples: int
    denoised: dict[str, float]
    finished: dict[str, float]

    @property
    def means(self) -> tuple[float, float]:
        """Mean over the volumes: of denoised and of finished pictures."""
        count = len(self.denoised)
        return sum(self.denoised.values()) / count, sum(self.finished.values()) / count


class PathLightTrainer:
    """Trains the network on pairs, drawn equally often from each volume.

    `start` has the first weights; `steps` and `seconds` include those of earlier runs.
    """

    def __init__(
        self,
        pairs: dict[str, Pairs],
        options: PathLightOptions,
        device: torch.device,
        start: PathLightNetwork | None = None,
    ) -> None:
        if not pairs:
            raise TrainingError("There are no pairs to train on; draw some with 'light pairs'.")
        self._volumes = [_tensors(each) for each in pairs.values()]
        self._options, self._device = options, device
        torch.manual_seed(options.seed)
        network = PathLightNetwork(options.size)
        if start is not None:
            network.load_state_dict(start.state_dict())
        self._network = place(network, device)
        self._average = EMA(self._network, options.averaging)
        self._optimizer = torch.optim.Adam(self._network.parameters(), options.learning_rate)
        self.steps, self.seconds = 0, 0.0
        self._parts: dict[str, Any] = {"network": self._network, "optimizer": self._optimizer}
        self._parts["average"] = self._average.network

    @property
    def network(self) -> PathLightNetwork:
        """The averaged network."""
        return self._average.network

    def run(
        self, say: Callable[[float], object] = lambda loss: None, keep: Path | None = None
    ) -> None:
        """Train until the time is up; `say` gets mean losses, `keep` is the file of checkpoints."""
        losses: list[Tensor] = []
        while self._part < 1:
            begun = time.perf_counter()
            losses.append(self._step())
            self.seconds += time.perf_counter() - begun
            if len(losses) == REPORT_STEPS:
                loss = float(torch.stack(losses).mean())
                losses.clear()
                if not math.isfinite(loss):
                    raise TrainingError("The loss is no longer finite; give a lower rate.")
                say(loss)
                if keep is not None:
                    self._save(keep)
        if keep is not None:
            self._save(keep)

    def resume(self, path: Path) -> None:
        """Go on from a checkpoint; a damaged one, or another network's, is a `TrainingError`."""
        try:
            state = torch.load(path, map_location=self._device, weights_only=True)
            for name, part in self._parts.items():
                part.load_state_dict(state[name])
            self.steps, self.seconds = int(state["steps"]), float(state["seconds"])
        except (OSError, KeyError, ValueError, RuntimeError) as error:
            raise TrainingError(
                f"{path}: training cannot go on from this file ({error}); delete it to begin anew."
            ) from error

    def _save(self, path: Path) -> None:
        state = {name: part.state_dict() for name, part in self._parts.items()}
        state |= {"steps": self.steps, "seconds": self.seconds}
        partial = path.with_suffix(".partial")
        try:
            torch.save(state, partial)
            partial.replace(path)
        except (OSError, RuntimeError) as error:
            raise CheckpointError(f"{path}: the training cannot be saved ({error}).") from error

    @property
    def _part(self) -> float:
        """Part of the training that is done, 0 to 1."""
        return min(self.seconds / (60 * self._options.minutes), 1.0)

    def _step(self) -> Tensor:
        options = self._options
        rng = np.random.default_rng([options.seed, self.steps])
        cosine = 0.5 + 0.5 * math.cos(math.pi * self._part)
        rate = options.learning_rate * (0.01 + 0.99 * cosine)
        for group in self._optimizer.param_groups:
            # The first steps are small, until Adam has estimated the moments.
            group["lr"] = rate * min(1.0, (self.steps + 1) / 100)
        inputs, exact = self._batch(rng)
        found = self._network(inputs)
        # Root mean squares per picture, so that dark pictures count as much as bright ones.
        loss = (found - exact).square().mean((1, 2, 3)).add(1e-6).sqrt().mean()
        self._optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self._network.parameters(), 1.0)
        self._optimizer.step()
        self._average.update(self._network, self.steps)
        self.steps += 1
        return loss.detach()

    def _batch(self, rng: np.random.Generator) -> tuple[Tensor, Tensor]:
        """Parts of pairs, mirrored, turned, and with permuted colours."""
        which = int(rng.choice(len(FEW), p=SHARES))
        inputs: list[Tensor] = []
        exact: list[Tensor] = []
        for _ in range(self._options.batch_size):
            arrays = self._volumes[rng.integers(len(self._volumes))]
            index = int(rng.integers(len(arrays["exact"])))
            seen, wanted = _input(arrays, slice(index, index + 1), which)
            rows, columns = wanted.shape[-2:]
            top = int(rng.integers(max(rows - CUT, 0) + 1))
            left = int(rng.integers(max(columns - CUT, 0) + 1))
            order = torch.as_tensor(rng.permutation(3))
            seen, wanted = permuted(seen, order), wanted[:, order]
            turned = rng.random(3) < 0.5
            for found, image in ((inputs, seen), (exact, wanted)):
                part = image[..., top : top + CUT, left : left + CUT]
                part = part.flip([axis for axis in (-1, -2) if turned[axis]])
                found.append(part.transpose(-1, -2) if turned[2] else part)
        whole = torch.cat(inputs), torch.cat(exact)
        seen, wanted = (t.to(self._device, memory_format=torch.channels_last) for t in whole)
        return seen, wanted


@torch.no_grad()
def path_light_errors(
    network: PathLightNetwork, pairs: dict[str, Pairs], device: torch.device
) -> list[PathLightErrors]:
    """Measure a network on held-out pairs, for each number of samples."""
    found = []
    network = network.to(device)
    for which, samples in enumerate(FEW):
        denoised: dict[str, float] = {}
        finished: dict[str, float] = {}
        for name, each in pairs.items():
            arrays = _tensors(each)
            errors: tuple[list[float], list[float]] = ([], [])
            for index in range(len(each.error)):
                seen, exact = _input(arrays, slice(index, index + 1), which)
                pictures = arrays["denoised"][index, which], network(seen.to(device))[0].cpu()
                for kept, picture in zip(errors, pictures, strict=True):
                    square = (picture.float().clamp(0, 1) - exact[0].clamp(0, 1)).square().mean()
                    kept.append(math.sqrt(max(float(square) - each.error[index] ** 2, 0.0)))
            denoised[name], finished[name] = (float(np.mean(kept)) for kept in errors)
        found.append(PathLightErrors(samples, denoised, finished))
    return found


def described(
    options: PathLightOptions, trainer: PathLightTrainer, pairs: int
) -> dict[str, object]:
    """Return a training's facts for the card."""
    return {
        **asdict(options),
        "pairs": pairs,
        "steps": trainer.steps,
        "trained_minutes": round(trainer.seconds / 60, 1),
    }


def _tensors(pairs: Pairs) -> dict[str, Tensor]:
    return {name: torch.from_numpy(array) for name, array in vars(pairs).items()}


def _input(arrays: dict[str, Tensor], part: slice, which: int) -> tuple[Tensor, Tensor]:
    """Return the network's input of some pairs after `FEW[which]` samples, and the target."""
    colors = {name: arrays[name][part].float() for name in ("unlit", "soft")}
    colors |= {name: arrays[name][part, which].float() for name in ("denoised", "traced")}
    inputs = network_inputs(colors, arrays["opacity"][part].float(), FEW[which])
    return inputs, arrays["exact"][part].float()
