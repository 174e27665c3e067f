"""Detection of collapsed training runs, with advice for the user.

GANs fail in known ways: a loss or a gradient is no longer finite, all images
become alike, or the encoder gives all TFs the same code.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from model.training.stage import Stage, StepResult

LEAST_DIVERSITY = 0.1
"""Ratio of the spreads of generated and rendered images below which images have collapsed."""

LEAST_RANK = 1.05
"""Effective rank of the latent codes below which they vary in one dimension only."""

LEAST_SPREAD = 1e-4
"""Largest standard deviation of a latent dimension below which all codes count as equal."""

PATIENCE = 2
"""Number of consecutive collapsed measurements that end a run."""

WARM_UP = 600
"""Number of steps of a stage before which measurements are not checked.

Under the paper's initialization all codes start equal (a spread of 3e-6), and a codec of full
width has an effective rank of 1.0 from step 100 to 400, whatever its batches; by step 600 it is
above 2. Images start alike, too.
"""

LATEST_START = 3000
"""Number of steps after which codes or images that never differed count as collapsed."""


class Trouble(NamedTuple):
    """Description of a failure, as a clause, and a setting of the recipe that may help."""

    what: str
    setting: str


class CollapseGuard:
    """Checks the steps and measurements of a run for collapse.

    Attributes
    ----------
    healthy : bool
        Whether the last measurement showed no collapse; otherwise no checkpoint may
        replace an earlier one.
    """

    def __init__(self) -> None:
        self.healthy = True
        self._bad = 0
        self._differed: set[tuple[str, str]] = set()

    def check_step(self, stage: Stage, result: StepResult) -> Trouble | None:
        """Return the failure of a step with a loss or gradient that is not finite, or None."""
        values = {f"{name} loss": loss for name, loss in result.losses.items()}
        for name, value in {**values, "gradient": result.gradient}.items():
            if not math.isfinite(value):
                what = (
                    f"the {name} is no longer finite; lower the learning rate, or try another seed"
                )
                return Trouble(what, _slower(stage))
        return None

    def check_measurement(
        self, stage: Stage, metrics: dict[str, float], steps: int, last: bool = False
    ) -> Trouble | None:
        """Return the collapse that lasted for :data:`PATIENCE` measurements, or None.

        What was different earlier in the stage and no longer is has collapsed; what never
        was may still be where it started, until :data:`LATEST_START` or the stage's end.

        Parameters
        ----------
        metrics : dict of float
            "latent_rank", "latent_spread" and "diversity" as measured by the probe.
        steps : int
            Number of steps done in this stage.
        last : bool
            Whether the stage is over; a single collapsed measurement then suffices.
        """
        checked = {"codes": _equal_codes(metrics), "images": _alike(stage, metrics)}
        found = None
        for what, trouble in checked.items() if steps >= WARM_UP else ():
            if trouble is None:
                self._differed.add((stage.name, what))
            elif last or steps >= LATEST_START or (stage.name, what) in self._differed:
                found = found or trouble
        self.healthy = found is None
        self._bad = 0 if self.healthy else self._bad + 1
        return found if last or self._bad >= PATIENCE else None


def latent_health(latent: Tensor) -> dict[str, float]:
    """Return statistics of the variation among latent codes of different TFs.

    Parameters
    ----------
    latent : Tensor, shape (N, latent_dim)

    Returns
    -------
    dict of float
        "latent_spread", the largest standard deviation of a dimension, and
        "latent_rank", the effective rank of the codes' covariance (Roy and Vetterli 2007):
        the exponential of the entropy of its normalized eigenvalues, 1 to latent_dim.
    """
    latent = latent.double()
    deviations = latent.std(dim=0)
    centered = latent - latent.mean(dim=0)
    eigenvalues = torch.linalg.svdvals(centered).square()
    shares = eigenvalues / eigenvalues.sum().clamp(min=1e-300)
    entropy = -torch.xlogy(shares, shares).sum()
    return {
        "latent_spread": float(deviations.max()),
        "latent_rank": float(entropy.exp()),
    }


def diversity(images: Tensor, truth: Tensor) -> float:
    """Standard deviation of images (N, C, H, W) about their mean, relative to the true ones'."""
    spreads = [float((x.float() - x.float().mean(dim=0)).square().mean()) for x in (images, truth)]
    return math.sqrt(spreads[0] / max(spreads[1], 1e-12))


def _equal_codes(metrics: dict[str, float]) -> Trouble | None:
    if metrics["latent_spread"] >= LEAST_SPREAD and metrics["latent_rank"] >= LEAST_RANK:
        return None
    return Trouble(
        "the latent codes of all opacity TFs are the same "
        f"(largest standard deviation {metrics['latent_spread']:.2g}, "
        f"effective rank {metrics['latent_rank']:.2f}); raise the weight of the decoded TF, "
        "or try another seed",
        "decoded_tf_weight=4000",
    )


def _alike(stage: Stage, metrics: dict[str, float]) -> Trouble | None:
    if metrics["diversity"] >= LEAST_DIVERSITY:
        return None
    early = stage.options.adversarial_start < 0.8
    later = "let the discriminator join later, or " if early else ""
    return Trouble(
        "all generated images are alike "
        f"(their spread is {metrics['diversity']:.1%} of the rendered ones'); "
        f"{later}lower the learning rate",
        "adversarial_start=0.8" if early else _slower(stage),
    )


def _slower(stage: Stage) -> str:
    """Return a setting of the recipe with a quarter of the stage's learning rate."""
    return f"{stage.name}.learning_rate={stage.stage.learning_rate / 4:g}"
