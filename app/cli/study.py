"""``study``: the paper's studies anew, at a chosen size and budget."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from app.cli import options
from app.cli.console import console, counting
from app.cli.outputs import write_json, write_text
from app.cli.train import TrainingDisplay, budget_of, execution_of, size_of
from model.devices import choose_device
from model.errors import TfscopeError
from model.evaluation.study import STUDIES, Study, StudyPlan, run_study
from model.evaluation.study_table import markdown, study_table
from model.networks.size import Architecture, NetworkSize
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.samples.sampling import Split
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.options import TrainingOptions
from model.training.plan import TrainingPlan
from model.training.sources import StoredSource


@dataclass(frozen=True)
class StudyOrder:
    """What to study: the command's options, see there."""

    study: str
    volume: options.VolumeSource
    out: Path
    preset: str
    architecture: Architecture | None
    minutes: float | None
    samples: int | None
    images: int
    count: int
    sensitivities: int
    settings: tuple[str, ...]
    seed: int
    workers: int | None
    device: str
    precision: str


DEFAULT_MINUTES = 10.0


def study_models(order: StudyOrder) -> None:
    """Render the samples, train and measure what is missing, print and write the table."""
    study = STUDIES[order.study]
    size = size_of(order.preset, order.architecture)
    volume = order.volume.read()
    store = _store(order, volume, size)
    recipe = TrainingOptions(seed=order.seed).with_settings(order.settings)
    device = choose_device(order.device)
    base = TrainingPlan(
        source=StoredSource(store),
        preset=order.preset,
        size=size,
        options=recipe,
        budget=budget_of(order.minutes, order.samples, DEFAULT_MINUTES),
        folder=order.out,
        device=device,
        execution=execution_of(size, recipe, store.scene, device, order.precision),
    )
    plan = StudyPlan(store, volume, base, order.count, order.sensitivities)
    with TrainingDisplay() as display:
        result = run_study(study, plan, lambda v: display.begin(v.label), display.show)
    _print(study, result)
    write_json(order.out / f"{order.study}.json", result)
    table = order.out / f"{order.study}.md"
    write_text(table, markdown(study, result))
    console.print(f"The table is in {table}.")


def _store(order: StudyOrder, volume: Volume, size: NetworkSize) -> SampleStore:
    """The study's samples, rendered where they are missing."""
    scene = Scene.of(volume, size.image_size, renderer="raycast")
    counts: dict[Split, int] = {"train": order.images, "holdout": order.count}
    try:
        order.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TfscopeError(
            f"{order.out}: the folder cannot be made ({error.strerror}); choose another place."
        ) from error
    path = order.out / "samples.zarr"
    if path.exists():
        stored = SampleStore(path).count("train")
        if stored != order.images:
            raise TfscopeError(
                f"{path}: the studies here share {stored} training images, not {order.images}; "
                f"give --images {stored}, or another --out."
            )
    store = SampleStore.create(path, scene, order.seed, counts)
    missing = store.missing_samples()
    if missing:
        with counting("rendering", missing) as (progress, task):
            render_store(store, volume, order.workers, lambda new: progress.advance(task, new))
    return store


def _print(study: Study, result: dict[str, object]) -> None:
    heading, *rows = study_table(study, result)
    table = Table(title=study.title, title_justify="left")
    for i, name in enumerate(heading):
        table.add_column(name, justify="right" if i else "left", no_wrap=not i)
    for row in rows:
        table.add_row(*row)
    console.print(table)
    console.print(f"The paper's numbers: {study.paper}.")
