"""The paper's studies, repeated at a chosen size and budget."""

from __future__ import annotations

from pathlib import Path

from app.cli.console import console, counting, print_table
from app.cli.outputs import make_room_for, write_json, write_text
from app.cli.training_display import TrainingDisplay
from model.errors import TfscopeError, require
from model.evaluation.study import (
    STUDIES,
    Study,
    StudyPlan,
    markdown,
    recipe_lines,
    run_study,
    study_pictures,
    study_table,
)
from model.networks.blocks import choose_device
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.options import TrainingJob
from model.training.plan import TrainingPlan, choose_precision
from model.training.sources import StoredSource

SENSITIVITIES = 20
"""Hold-out samples, at most, whose sensitivities are compared with the renderer's."""


def study_models(name: str, job: TrainingJob, images: int, count: int) -> list[Path]:
    """Render missing samples, train and measure missing models, write table and figures.

    The job has the settings of all variants, and the study's folder; `images` is the number of
    training samples, `count` that of hold-out samples. The files written are returned.
    """
    require("evaluate")
    study = STUDIES[name]
    volume = job.volume.read()
    store = _store(job, volume, images, count)
    device = choose_device(job.device)
    base = TrainingPlan(
        source=StoredSource(store),
        preset=job.preset,
        size=job.size,
        options=job.options,
        budget=job.budget,
        folder=job.out,
        device=device,
        precision=choose_precision(device, job.precision),
    )
    plan = StudyPlan(store, volume, base, count, min(SENSITIVITIES, count))
    with TrainingDisplay() as display:
        result = run_study(study, plan, lambda v: display.begin(v.label), display.show)
    _print(study, result)
    out = job.out / name
    write_json(out.with_suffix(".json"), result)
    write_text(out.with_suffix(".md"), markdown(study, result))
    written = [out.with_suffix(suffix) for suffix in (".md", ".json", ".png")]
    from app.figures.study_figures import save_error_curves, save_side_by_side

    save_side_by_side(written[-1], study, result, study_pictures(study, plan))
    if study.varied:
        written.append(out.with_name(f"{name}-errors.png"))
        save_error_curves(written[-1], study, result)
    return written


def _store(job: TrainingJob, volume: Volume, images: int, count: int) -> SampleStore:
    """Return the study's store after rendering its missing samples."""
    scene = Scene.of(
        volume, job.size.image_size, job.lighting, renderer="raycast", tf_family="paper"
    )
    path = job.out / "samples.zarr"
    make_room_for(path)
    if path.exists():
        stored = SampleStore(path).count("train")
        if stored != images:
            raise TfscopeError(
                f"{path}: the studies here share {stored} training images, not {images}; "
                f"give --images {stored}, or another --out."
            )
    store = SampleStore.create(path, scene, job.seed, {"train": images, "holdout": count})
    missing = store.missing_samples()
    if missing:
        done = 0

        def advance(new: int) -> None:
            nonlocal done
            done += new
            show(done)

        with counting("rendering", missing) as show:
            render_store(store, volume, job.workers, advance)
    return store


def _print(study: Study, result: dict[str, object]) -> None:
    heading, *rows = study_table(study, result)
    print_table(study.title, heading, rows)
    console.print(f"The paper's numbers: {study.paper}.")
    for line in recipe_lines(study, result):
        console.print(line)
