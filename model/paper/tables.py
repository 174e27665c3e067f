"""Tables 1 and 2 of the paper: data sets with hold-out errors, and the network's size and times."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.evaluation.holdout import generator_errors, neighbor_errors
from model.measurements import processors
from model.paper.edits import PAPER_R
from model.paper.subject import Subject
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample
from model.sensitivity.learned import Sensitivity
from model.training.options import PAPER_IMAGES

Errors = dict[str, NDArray[np.float64]]

MEASURES = ("rmse", "emd", "ssim", "flip")
Means = dict[str, float]  # of the errors on hold-out samples, by measure

MEASURED_TOGETHER = 100  # hold-out samples in memory at once

PAPER_TABLE_1 = (
    ("Combustion", "170 x 160 x 140", "float", "15", "none", "2.7 h", ".046", ".011"),
    ("Combustion", "170 x 160 x 140", "float", "15", "direct", "5 h", ".060", ".011"),
    ("Combustion", "170 x 160 x 140", "float", "15", "global", "14 h", ".060", ".010"),
    ("Engine", "256 x 256 x 110", "byte", "7", "none", "3 h", ".061", ".015"),
    ("Visible Male", "128 x 256 x 256", "byte", "8", "global", "14 h", ".075", ".013"),
    ("Foot", "256 x 256 x 256", "byte", "16", "none", "3.3 h", ".064", ".017"),
    ("Jet", "768 x 336 x 512", "float", "504", "none", "4 h", ".086", ".022"),
    ("Spathorhynchus", "1024 x 1024 x 750", "byte", "750", "global", "5 days", ".116", ".020"),
)
"""The paper's rows."""


def holdout_errors(
    subject: Subject,
    count: int,
    on_progress: Callable[[int], None] = lambda done: None,
    store: SampleStore | None = None,
) -> Means:
    """Measure a model on the first hold-out samples of a data set of its scene."""
    scene = subject.generator.scene

    def errors(indices: range) -> Errors:
        if store is None:
            samples = render_samples(subject.renderer, scene, subject.seed, "holdout", indices)
        else:
            samples = store.read("holdout", indices)
        return generator_errors(subject.generator, samples)

    return _means(count, errors, on_progress)


def nearest_errors(store: SampleStore, count: int, on_progress: Callable[[int], None]) -> Means:
    """Measure the training images nearest to a data set's first hold-out images."""
    return _means(
        count, lambda indices: neighbor_errors(store.read("holdout", indices), store), on_progress
    )


def _means(
    count: int, errors: Callable[[range], Errors], on_progress: Callable[[int], None]
) -> Means:
    rows = []
    for first in range(0, count, MEASURED_TOGETHER):
        indices = range(first, min(first + MEASURED_TOGETHER, count))
        rows.append(errors(indices))
        on_progress(indices.stop)
    return {name: float(np.concatenate([row[name] for row in rows]).mean()) for name in MEASURES}


def table_1(
    subjects: Sequence[Subject],
    errors: Sequence[Means],
    count: int,
    timed: int,
    store: SampleStore | None = None,
    nearest: Means | None = None,
) -> Table:
    """Return Table 1: the models' data sets and errors on this many samples, then the paper's.

    Rendering is timed on `timed` samples.
    """
    heading = (
        "data set", "resolution", "precision", "MB", "light", "200,000 training images",
        "image RMSE", "colour EMD", "SSIM", "FLIP",
    )  # fmt: skip
    rows = [_row_1(s, e, timed) for s, e in zip(subjects, errors, strict=True)]
    if len(rows) > len({row[0] for row in rows}):
        rows = [
            (f"{row[0]}: {s.folder.name}", *row[1:]) for s, row in zip(subjects, rows, strict=True)
        ]
    if nearest is not None and store is not None:
        name = f"nearest of {store.count('train'):,} training images: {store.scene.volume_name}"
        rows.append((name, "", "", "", "", "", *_cells(nearest)))
    rows += [(f"paper: {name}", *rest, "", "") for name, *rest in PAPER_TABLE_1]
    pixels = ", ".join(dict.fromkeys(f"{s.size} x {s.size}" for s in subjects))
    return Table(
        "Table 1: data sets, and errors on hold-out samples",
        heading,
        tuple(rows),
        (
            f"{count:,} hold-out samples (the paper: 2,000), {pixels} pixels "
            "(256 x 256). Time of images: of so many random samples with "
            f"{processors()} threads on this machine, from {timed} of them; the paper's was a "
            "GPU, or a cluster for its lit images.",
        ),
    )


def _row_1(subject: Subject, errors: Means, timed: int) -> tuple[str, ...]:
    volume, scene = subject.volume, subject.generator.scene
    hours = _sample_seconds(subject, timed) / processors() * PAPER_IMAGES / 3600
    return (
        volume.name,
        " x ".join(map(str, volume.dimensions)),
        str(volume.voxels.dtype),
        f"{volume.voxels.nbytes / 1e6:.0f}",
        scene.lighting,
        f"{hours:.1f} h",
        *_cells(errors),
    )


def _cells(errors: Means) -> tuple[str, ...]:
    return tuple(f"{errors[name]:.3f}".removeprefix("0") for name in MEASURES)


def _sample_seconds(subject: Subject, count: int) -> float:
    """Seconds of a rendered sample with one thread."""
    scene = subject.generator.scene
    with closing(make_renderer(subject.volume, scene, threads=1)) as renderer:
        render_samples(renderer, scene, subject.seed, "train", range(1))
        start = time.perf_counter()
        render_samples(renderer, scene, subject.seed, "train", range(count))
        return (time.perf_counter() - start) / count


def table_2(subject: Subject, repeats: int, blocks: int = PAPER_R) -> Table:
    """Return Table 2: size and times of a model, and the paper's.

    Times of images and grids are medians of `repeats`; fields are timed once, as they take long.
    """
    generator = subject.generator
    scene, card = generator.scene, generator.card
    inputs = draw_sample(scene, subject.seed, "holdout", 0)
    codes = np.repeat(subject.space.code_of(inputs.opacity_tf)[None], 16, axis=0)
    weights = sum(t.numel() for t in generator.network.parameters())
    stored = sum(path.stat().st_size for path in subject.folder.glob("generator-*.safetensors"))
    hours = float(card.training.get("seconds", 0)) / 3600
    seen = int(card.training.get("samples_seen", 0))
    block = subject.size // blocks
    render = _seconds(lambda: generator.render(inputs), repeats)
    explore = _seconds(lambda: generator.render_latent(codes, inputs), max(1, repeats // 4))
    field = _once(lambda: Sensitivity(generator, inputs).field(block))
    blockwise = _once(lambda: Sensitivity(generator, inputs).blockwise(block))
    return Table(
        "Table 2: size of the network, and times",
        ("", "size", "train", "render", "TF explore", "TF sensitivity"),
        (
            (
                scene.volume_name,
                f"{4 * weights / 1e6:.0f} MB ({stored / 1e6:.1f} MB stored)",
                f"{hours:.1f} h",
                f"{render:.3f} s",
                f"{explore:.2f} s",
                f"{blockwise:.2f} s ({field:.2f} s)",
            ),
            ("paper (GTX 1080 Ti)", "101 MB", "16.5 h", ".007 s", ".06 s", ".49 s"),
        ),
        (
            f"{generator.device}, {processors()} cores, {subject.size} x {subject.size} pixels, "
            f"{card.size.width:g} of the paper's width, {seen:,} samples seen in training "
            "(starts from earlier models not counted). Size: generators in single precision; on "
            "disk in half. TF explore: the 16 pictures of a grid in one batch. TF sensitivity: "
            f"fields of all values in {blocks} x {blocks} blocks, one backward pass for each "
            "as in the paper, and (in brackets) by one forward pass for each number of the code.",
        ),
    )


def _seconds(work: Callable[[], object], repeats: int) -> float:
    """Median seconds, after a first run to warm up."""
    work()
    return median(_once(work) for _ in range(repeats))


def _once(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


@dataclass(frozen=True)
class Table:
    """A table to print, and to write as Markdown."""

    title: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()

    def markdown(self) -> str:
        """Return the table with its title and notes in Markdown."""
        lines = [f"**{self.title}**", "", _line(self.heading)]
        lines += [_line(["---"] * len(self.heading)), *map(_line, self.rows)]
        for note in self.notes:
            lines += ["", note]
        return "\n".join(lines) + "\n"

    def to_json(self) -> dict[str, Any]:
        """Return the table as plain data: a dict per row."""
        rows = [dict(zip(self.heading, row, strict=True)) for row in self.rows]
        return {"title": self.title, "rows": rows, "notes": list(self.notes)}


def _line(cells: list[str] | tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |"
