"""Records of a training run for users: hold-out metrics, learning curve and image sheets."""

from __future__ import annotations

import csv
import io
from contextlib import suppress
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import torch
from skimage.io import imsave
from torch.nn.functional import adaptive_avg_pool2d

from model import metrics
from model.files import write_atomically
from model.networks.encoding import decode_unit
from model.networks.generator_network import GeneratorNetwork
from model.networks.size import NetworkSize
from model.training.batch import encode_batch
from model.training.guard import diversity, latent_health
from model.training.sources import SampleSource
from model.training.stage import Losses
from model.training.state import Progress

PROBE_SAMPLES = 128
SHEET_SAMPLES = 8
PROBE_BATCH = 16
MEASURES = ("tf_rmse", "opacity_rmse", "rmse")
"""Metrics that are displayed and recorded in the model's card."""


class HoldoutProbe:
    """Measures generators on a fixed set of hold-out samples."""

    def __init__(self, source: SampleSource, size: NetworkSize, device: torch.device) -> None:
        samples = source.first("holdout", PROBE_SAMPLES)
        self.count = len(samples)
        self.batch = encode_batch(samples, source.scene, size.opacity_size, device)

    def measure(self, generator: GeneratorNetwork, sheet: Path) -> dict[str, float]:
        """Measure a generator and write a sheet of images of the first samples.

        Parameters
        ----------
        sheet : Path
            PNG file. Rows, from the top: true images, generated images, true
            opacity images, generated opacity images.

        Returns
        -------
        dict of float
            Mean RMSE of opacity TFs, opacity images and images, at the
            size that the generator draws, and the indicators checked by
            :class:`model.training.guard.CollapseGuard`.
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
    """Learning curve of a run, ``log.csv``: one row per measurement.

    Parameters
    ----------
    samples : int
        Samples seen by the run so far; later rows, of a session that was killed
        before its state was saved, are dropped.
    """

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
    """Write rows of images below one another, all enlarged to the size of the largest."""
    side = max(row.shape[1] for row in rows)
    enlarged = []
    for row in rows:
        factor = side // row.shape[1]
        enlarged.append(row[:SHEET_SAMPLES].repeat(factor, axis=1).repeat(factor, axis=2))
    sheet = np.concatenate([np.concatenate(list(row), axis=1) for row in enlarged])
    path.parent.mkdir(parents=True, exist_ok=True)
    imsave(path, np.rint(np.clip(sheet, 0, 1) * 255).astype(np.uint8), check_contrast=False)
