"""Measurements in a training run: hold-out metrics, curve, image sheets, and collapse."""

import copy
import csv
import io
import math
from contextlib import suppress
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from skimage.io import imsave
from torch import Tensor
from torch.nn.functional import adaptive_avg_pool2d
from torch.optim.swa_utils import update_bn

from model import metrics
from model.files import write_atomically
from model.networks.generator_network import GeneratorNetwork, decode_unit
from model.networks.size import NetworkSize
from model.training.batch import encode_batch
from model.training.sources import SampleSource
from model.training.stage import Losses, Stage, StepResult
from model.training.state import Progress

PROBE_SAMPLES = 128
SHEET_SAMPLES = 8
PROBE_BATCH = 16
MEASURES = ("tf_rmse", "opacity_rmse", "rmse")  # displayed, and in the model's card


class HoldoutProbe:
    """Measures generators on a fixed set of hold-out samples."""

    def __init__(self, source: SampleSource, size: NetworkSize, device: torch.device) -> None:
        samples = source.first("holdout", PROBE_SAMPLES)
        self.count = len(samples)
        self.batch = encode_batch(samples, source.scene, size.opacity_size, device)

    def measure(self, generator: GeneratorNetwork, sheet: Path) -> dict[str, float]:
        """Measure a generator and write a PNG sheet of images of the first samples.

        Returns mean RMSEs of opacity TFs, opacity images and images, at the generator's image size,
        and the indicators that :class:`CollapseGuard` checks.
        """
        image, opacity, tf, latent = self._render(generator)
        real = adaptive_avg_pool2d(self.batch.image, image.shape[-1])
        images, truth = _pixels(image), _pixels(real)
        opacities, true_opacities = _pixels(opacity), _pixels(self.batch.opacity_image)
        _save_sheet(sheet, [truth, images, true_opacities, opacities])
        tf_error = decode_unit(tf) - decode_unit(self.batch.inputs.opacity_tf)
        pairs = zip(images, truth, strict=True)
        opacity_pairs = zip(opacities, true_opacities, strict=True)
        return {
            "tf_rmse": float(tf_error.square().mean(1).sqrt().mean()),
            "opacity_rmse": float(np.mean([metrics.rmse(a, b) for a, b in opacity_pairs])),
            "rmse": float(np.mean([metrics.rmse(a, b) for a, b in pairs])),
            **latent_health(latent),
            "opacity_diversity": diversity(opacity, self.batch.opacity_image),
            "diversity": diversity(image, real),
        }

    @torch.inference_mode()
    def _render(
        self, generator: GeneratorNetwork
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return images, opacity images, decoded opacity TFs and codes, computed in batches."""
        parts = []
        for start in range(0, self.count, PROBE_BATCH):
            part = slice(start, start + PROBE_BATCH)
            inputs = self.batch.inputs.map(itemgetter(part))
            latent = generator.codec.encode(inputs.opacity_tf)
            image, opacity = generator(inputs)
            parts.append((image, opacity, generator.codec.decode(latent), latent))
        image, opacity, tf, latent = (torch.cat(column) for column in zip(*parts, strict=True))
        return image, opacity, tf, latent


class RunLog:
    """Learning curve of a run, ``log.csv``: one row per measurement."""

    def __init__(self, folder: Path, samples: int) -> None:
        self._path = folder / "log.csv"
        self._rows: list[dict[str, Any]] = []
        if self._path.is_file():
            with self._path.open(newline="", encoding="utf-8") as file:
                rows = [r for r in csv.DictReader(file) if int(r["samples"]) <= samples]
            self._rows = [{k: _value(v) for k, v in row.items()} for row in rows]

    def write(self, progress: Progress, losses: Losses, measured: dict[str, float]) -> None:
        """Add a row and rewrite the file."""
        row: dict[str, Any] = {
            "stage": progress.stage,
            "seconds": round(progress.seconds, 1),
            "samples": progress.samples,
        }
        row |= {f"loss_{k}": round(v, 6) for k, v in losses.items()}
        row |= {k: round(v, 6) for k, v in measured.items()}
        self._rows.append(row)
        columns = list(dict.fromkeys(name for r in self._rows for name in r))
        table = io.StringIO(newline="")
        writer = csv.DictWriter(table, columns, restval="")
        writer.writeheader()
        writer.writerows(self._rows)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(self._path, table.getvalue().encode())

    def last_metrics(self) -> dict[str, float]:
        """Return the most recent metrics; empty before the first measurement."""
        last = self._rows[-1] if self._rows else {}
        return {name: float(last[name]) for name in MEASURES if last.get(name, "") != ""}

    def curve(self) -> list[dict[str, Any]]:
        """Return the rows without empty cells, for the model's card."""
        return [{k: v for k, v in row.items() if v != ""} for row in self._rows]


def _value(text: str) -> int | float | str:
    """Parse a cell as an int or float, or return it as text."""
    for kind in (int, float):
        with suppress(ValueError):
            return kind(text)
    return text


def _pixels(images: torch.Tensor) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Convert images (N, C, H, W) in [-1, 1] to (N, H, W, 3) in [0, 1]; opacity becomes grey."""
    array = decode_unit(images).permute(0, 2, 3, 1).cpu().numpy()
    return np.broadcast_to(array, (*array.shape[:3], 3))


def _save_sheet(path: Path, rows: list[np.ndarray[Any, np.dtype[np.float32]]]) -> None:
    """Write rows of images, all enlarged to the size of the largest."""
    side = max(row.shape[1] for row in rows)
    enlarged = []
    for row in rows:
        factor = side // row.shape[1]
        enlarged.append(row[:SHEET_SAMPLES].repeat(factor, axis=1).repeat(factor, axis=2))
    sheet = np.concatenate([np.concatenate(list(row), axis=1) for row in enlarged])
    path.parent.mkdir(parents=True, exist_ok=True)
    imsave(path, np.rint(np.clip(sheet, 0, 1) * 255).astype(np.uint8), check_contrast=False)


LEAST_DIVERSITY = 0.1  # ratio of spreads, generated to rendered, below which images have collapsed
LEAST_RANK = 1.05  # effective rank of the latent codes below which they vary in one dimension only
LEAST_SPREAD = 1e-4  # largest deviation of a latent number below which all codes count as equal
PATIENCE = 2  # number of consecutive collapsed measurements that end a run

WARM_UP = 600
"""Steps of a stage before measurements are checked. All codes start nearly equal: a codec of full
width has an effective rank of 1.0 up to step 400, and above 2 from step 600."""

LATEST_START = 3000  # steps after which codes or images that never differed count as collapsed


class Trouble(NamedTuple):
    """Description of a failure, as a clause, and a setting of the recipe that may help."""

    what: str
    setting: str


class CollapseGuard:
    """Checks a run for collapse; unless it is `healthy`, no checkpoint may replace another."""

    def __init__(self) -> None:
        self.healthy = True
        self._bad = 0
        self._differed: set[tuple[str, str]] = set()

    def check_step(self, stage: Stage, result: StepResult) -> Trouble | None:
        """Return the failure of a step with a loss or gradient that is not finite, or None."""
        values = {f"{name} loss": loss for name, loss in result.losses.items()}
        for name, value in {**values, "gradient": result.gradient}.items():
            if not math.isfinite(value):
                remedy = "lower the learning rate, or try another seed"
                return Trouble(f"the {name} is no longer finite; {remedy}", _slower(stage))
        return None

    def check_measurement(
        self, stage: Stage, metrics: dict[str, float], steps: int, last: bool = False
    ) -> Trouble | None:
        """Return a collapse over :data:`PATIENCE` measurements, or in the last one."""
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
    """Return statistics of the variation among latent codes of different TFs."""
    latent = latent.double()
    deviations = latent.std(dim=0)
    centered = latent - latent.mean(dim=0)
    eigenvalues = torch.linalg.svdvals(centered).square()
    shares = eigenvalues / eigenvalues.sum().clamp(min=1e-300)
    entropy = -torch.xlogy(shares, shares).sum()
    return {"latent_spread": float(deviations.max()), "latent_rank": float(entropy.exp())}


def diversity(images: Tensor, truth: Tensor) -> float:
    """Standard deviation of images (N, C, H, W) about their mean, relative to the true ones'."""
    spreads = [float((x.float() - x.float().mean(dim=0)).square().mean()) for x in (images, truth)]
    return math.sqrt(spreads[0] / max(spreads[1], 1e-12))


def _equal_codes(metrics: dict[str, float]) -> Trouble | None:
    if metrics["latent_spread"] >= LEAST_SPREAD and metrics["latent_rank"] >= LEAST_RANK:
        return None
    spread, rank = metrics["latent_spread"], metrics["latent_rank"]
    what = (
        "the latent codes of all opacity TFs are the same (largest standard deviation "
        f"{spread:.2g}, effective rank {rank:.2f}); raise the weight of the decoded TF, or try "
        "another seed"
    )
    return Trouble(what, "decoded_tf_weight=4000")


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


NORM_SAMPLES = 64  # training samples; more made no difference

NORM_BATCH = 16


class BatchNormRecalibration:
    """Recomputes a generator's batch-norm statistics on a fixed set of training samples.

    Outputs vary less with averaged weights than during training, so averaged statistics would scale
    them down too far.
    """

    def __init__(self, source: SampleSource, size: NetworkSize, device: torch.device) -> None:
        samples = source.first("train", NORM_SAMPLES)
        batch = encode_batch(samples, source.scene, size.opacity_size, device)
        self._batches = batch.parts(-(-len(batch) // NORM_BATCH))

    def of(self, generator: GeneratorNetwork) -> GeneratorNetwork:
        """Return a recalibrated copy of a generator, in evaluation mode."""
        own = copy.deepcopy(generator)
        # `update_bn` takes the first item of each batch.
        update_bn([[batch.inputs] for batch in self._batches], own)
        return own.eval()
