"""``evaluate``: hold-out errors of a model and of the nearest training images."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from app.cli.console import console, counting
from app.cli.outputs import check_outputs, write_json, write_text
from model.errors import DatasetError, VolumeError
from model.evaluation.error_profile import Group, error_profile, to_json
from model.evaluation.holdout import evaluate, pictures
from model.evaluation.report import AGREEMENTS, MEASURES, extremes, html_report, picture_sheet
from model.generator.generator import Generator
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import draw_sample
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.volume_files.source import VolumeSource, volume_of

DEFAULT_SENSITIVITIES = 200


def evaluate_model(
    folder: Path,
    count: int,
    source: VolumeSource,
    store_path: Path | None,
    neighbours: int,
    json_path: Path | None,
    device: str,
    workers: int | None,
    sensitivities: int | None,
    report_path: Path | None,
) -> None:
    """Measure the model, print a table, and write JSON and an HTML report if requested.

    Without a store, the hold-out samples and `neighbours` training samples are
    rendered again from the model's seed.
    """
    check_outputs(json_path, report_path)
    generator = Generator.load(folder, device)
    # Before the measurements, so that a missing volume is reported early.
    volume = _volume_to_differentiate(generator, source, sensitivities)
    if store_path is not None:
        store = _store(generator, folder, store_path, count)
        result, page = _measure(generator, store, count, report_path is not None)
    else:
        with tempfile.TemporaryDirectory() as scratch:
            store = _render(generator, Path(scratch), count, source, neighbours, workers)
            result, page = _measure(generator, store, count, report_path is not None)
    _print(result)

    def write() -> None:
        if json_path is not None:
            write_json(json_path, {"model": str(folder), **result})
        if report_path is not None and page is not None:
            title = f"{generator.scene.volume_name}: {folder}"
            write_text(report_path, html_report(title, result, *page))

    write()
    if volume is not None:
        agreement = _agreement(generator, volume, sensitivities or DEFAULT_SENSITIVITIES)
        _print_agreement(agreement)
        result["sensitivity_agreement"] = agreement
        write()


def _store(generator: Generator, folder: Path, path: Path, count: int) -> SampleStore:
    """Open the model's data set and check its scene, seed and number of hold-out samples."""
    store = SampleStore(path)
    store.require_complete()
    seed = generator.card.training.get("dataset_seed", store.seed)
    if store.scene != generator.scene or store.seed != seed:
        raise DatasetError(
            f"{path}: the data set has another scene or seed than the model {folder}; "
            "give the one that it was trained on, or none."
        )
    if count > store.count("holdout"):
        raise DatasetError(
            f"{path}: only {store.count('holdout')} hold-out samples are there, "
            f"not {count}; lower --count, or add some with 'dataset --holdout'."
        )
    return store


def _render(
    generator: Generator,
    scratch: Path,
    count: int,
    source: VolumeSource,
    neighbours: int,
    workers: int | None,
) -> SampleStore:
    scene = generator.scene
    volume = volume_of(scene.volume_fingerprint, scene.volume_name, source)
    training = generator.card.training
    neighbours = min(neighbours, int(training.get("samples_stored", neighbours)))
    seed = int(training.get("dataset_seed", 0))
    store = SampleStore.create(
        scratch / "samples.zarr", scene, seed, {"holdout": count, "train": neighbours}
    )
    with counting("rendering", count + neighbours) as (progress, task):
        render_store(store, volume, workers, lambda new: progress.advance(task, new))
    return store


def _measure(
    generator: Generator, store: SampleStore, count: int, illustrated: bool
) -> tuple[dict[str, Any], tuple[dict[str, list[Group]], NDArray[np.uint8]] | None]:
    """Return the measures and, if `illustrated`, the error profile and the image sheet."""
    with counting("measuring", count) as (progress, task):
        evaluation = evaluate(
            generator, store, count, lambda done: progress.update(task, completed=done)
        )
    errors = evaluation.generator["rmse"]
    samples = store.read("holdout", range(len(errors)))
    profile = error_profile(generator.scene, samples, errors)
    result = {**evaluation.to_json(), "profile": to_json(profile)}
    if not illustrated:
        return result, None
    return result, (profile, picture_sheet(*pictures(generator, store, extremes(errors))))


def _volume_to_differentiate(
    generator: Generator, source: VolumeSource, count: int | None
) -> Volume | None:
    """Return the volume for the comparison of sensitivities, or None for no comparison.

    There is none for lit scenes, if `count` is 0, or if `count` is None and the volume
    is not available.
    """
    scene = generator.scene
    if count == 0 or scene.lighting != "none":
        return None
    try:
        return volume_of(scene.volume_fingerprint, scene.volume_name, source)
    except VolumeError:
        if count is not None:
            raise
        console.print("Give --volume to have the sensitivities compared with the renderer's own.")
        return None


def _agreement(generator: Generator, volume: Volume, count: int) -> dict[str, Any]:
    """Compare sensitivities with the renderer's on the first hold-out samples, as plain data."""
    seed = int(generator.card.training.get("dataset_seed", 0))
    samples = [draw_sample(generator.scene, seed, "holdout", i) for i in range(count)]
    with counting("differentiating", count) as (progress, task):
        agreement = sensitivity_agreement(
            generator, volume, samples, lambda done: progress.update(task, completed=done)
        )
    return {"count": count, **agreement.to_json()}


def _print_agreement(agreement: dict[str, Any]) -> None:
    title = (
        f"sensitivity to the opacity TF against the renderer's own, {agreement['count']} samples"
    )
    table = Table(title=title, title_justify="left")
    for name in ("", "quartile 1", "median", "quartile 3"):
        table.add_column(name, justify="right" if name else "left")
    for key, label in AGREEMENTS.items():
        values = agreement[key]
        cells = [f"{values[k]:.2f}" for k in ("quartile1", "median", "quartile3")]
        table.add_row(label, *cells)
    console.print(table)


def _print(result: dict[str, Any]) -> None:
    neighbour = result["nearest_neighbour"]
    statistics = ("mean", "median", "p95")
    table = Table(title=f"{result['count']} hold-out samples", title_justify="left")
    table.add_column("")
    for who in ("generator", "nearest"):
        for statistic in statistics:
            table.add_column(f"{who}\n{statistic}", justify="right")
    for key, label in MEASURES.items():
        if key not in result:
            continue
        other = neighbour.get(key, {})
        cells = [f"{result[key][s]:.4f}" for s in statistics]
        cells += [f"{other[s]:.4f}" if other else "" for s in statistics]
        table.add_row(label, *cells)
    console.print(table)
    console.print(f"nearest: the nearest of {neighbour['count']} training images, by RMSE")
    whole = sum(scale["error"] for scale in result["scales"]) or 1.0
    shares = [f"{scale['error'] / whole:.0%} of {scale['pixels']}" for scale in result["scales"]]
    console.print(f"the squared error, by the size of details in pixels: {', '.join(shares)}")
