"""What a run leaves for people to look at: hold-out metrics, curves, pictures."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import torch
from skimage.io import imsave

from model import metrics
from model.dataset import SampleStore
from model.encoding import decode_unit, encode_batch
from model.networks.blocks import NetworkSize
from model.networks.two_stage import TwoStageGenerator
from model.training.stages import Losses
from model.training.state import Progress

PROBE_SAMPLES = 128
SHEET_SAMPLES = 8


class HoldoutProbe:
    """Measures a generator on the same few hold-out samples again and again.

    Parameters
    ----------
    store : SampleStore
    size : NetworkSize
    device : torch.device
    """

    def __init__(self, store: SampleStore, size: NetworkSize, device: torch.device) -> None:
        self.count = min(PROBE_SAMPLES, store.count("holdout"))
        samples = store.read("holdout", range(self.count))
        self.batch = encode_batch(samples, store.scene.view_range, size.opacity_size).to(device)

    def measure(self, generator: TwoStageGenerator) -> dict[str, float]:
        """Mean RMSE of opacity TFs, opacity images and images, and mean colour EMD."""
        image, opacity = self._render(generator)
        with torch.inference_mode():
            tf = generator.opacity.decode(generator.opacity.encode(self.batch.opacity_tf))
        truth = _pixels(self.batch.image)
        pairs = list(zip(_pixels(image), truth, strict=True))
        opacity_pairs = zip(_pixels(opacity), _pixels(self.batch.opacity_image), strict=True)
        tf_error = decode_unit(tf) - decode_unit(self.batch.opacity_tf)
        return {
            "tf_rmse": float(tf_error.square().mean(1).sqrt().mean()),
            "opacity_rmse": float(np.mean([metrics.rmse(a, b) for a, b in opacity_pairs])),
            "rmse": float(np.mean([metrics.rmse(a, b) for a, b in pairs])),
            "emd": float(np.mean([metrics.color_emd(a, b) for a, b in pairs])),
        }

    def save_sheet(self, generator: TwoStageGenerator, path: Path) -> None:
        """Write a picture of fixed samples.

        Rows, from the top: true images, generated images, true opacity
        images, generated opacity images.
        """
        image, opacity = self._render(generator)
        side = image.shape[-1]
        rows = [
            _pixels(self.batch.image),
            _pixels(image),
            _enlarge(_pixels(self.batch.opacity_image), side),
            _enlarge(_pixels(opacity), side),
        ]
        sheet = np.concatenate([np.concatenate(list(r[:SHEET_SAMPLES]), axis=1) for r in rows])
        path.parent.mkdir(parents=True, exist_ok=True)
        imsave(path, np.rint(np.clip(sheet, 0, 1) * 255).astype(np.uint8), check_contrast=False)

    @torch.inference_mode()
    def _render(self, generator: TwoStageGenerator) -> tuple[torch.Tensor, torch.Tensor]:
        b = self.batch
        image, opacity = generator(b.view, b.opacity_tf, b.color_tf)
        return image, opacity


class RunLog:
    """The run's curve as ``log.csv``: one row per interval.

    Parameters
    ----------
    folder : Path
    samples : int
        Where the run stands; later rows, of a session that was killed before
        its state was saved, are dropped.
    """

    def __init__(self, folder: Path, samples: int) -> None:
        self._path = folder / "log.csv"
        self._rows: list[dict[str, Any]] = []
        if self._path.is_file():
            with self._path.open(newline="", encoding="utf-8") as file:
                self._rows = [r for r in csv.DictReader(file) if int(r["samples"]) <= samples]

    def write(self, progress: Progress, losses: Losses, measured: dict[str, float]) -> None:
        """Add a row."""
        row: dict[str, Any] = {
            "stage": progress.stage,
            "seconds": round(progress.seconds, 1),
            "samples": progress.samples,
        }
        row |= {f"loss_{k}": round(v, 6) for k, v in losses.items()}
        row |= {k: round(v, 6) for k, v in measured.items()}
        self._rows.append(row)
        columns = list(dict.fromkeys(name for r in self._rows for name in r))
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, columns, restval="")
            writer.writeheader()
            writer.writerows(self._rows)

    def curve(self) -> list[dict[str, Any]]:
        """The rows, for the model's card."""
        return [{k: v for k, v in row.items() if v != ""} for row in self._rows]


def _pixels(images: torch.Tensor) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Images (N, C, H, W) in [-1, 1] as (N, H, W, 3) in [0, 1]; opacity becomes grey."""
    array = decode_unit(images).permute(0, 2, 3, 1).cpu().numpy()
    return np.broadcast_to(array, (*array.shape[:3], 3))


def _enlarge(
    images: np.ndarray[Any, np.dtype[np.float32]], side: int
) -> np.ndarray[Any, np.dtype[np.float32]]:
    factor = side // images.shape[1]
    return images.repeat(factor, axis=1).repeat(factor, axis=2)
