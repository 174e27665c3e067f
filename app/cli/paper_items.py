"""Makes the paper's figures, tables and studies."""

from collections.abc import Callable
from contextlib import ExitStack
from functools import cached_property, partial
from math import inf
from pathlib import Path
from time import perf_counter
from typing import get_args

from app.cli.console import about, console, counting, print_table, render_missing
from app.cli.drawing import load_fitted
from app.cli.latent import final_map
from app.cli.outputs import make_room_for, write_json, write_text
from app.cli.paper import QUICK_COUNT, Item, Paper
from app.cli.training_display import TrainingDisplay
from app.figures import paper_figures
from model.errors import CheckpointError, TfscopeError, require
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
from model.generator.catalog import shipped_models
from model.latent.latent_map import LatentMap
from model.networks.blocks import choose_device
from model.networks.card import load_card
from model.paper import tables
from model.paper.edits import PAPER_R, ValueStep, region_edits, value_edits
from model.paper.exploration import Exploration, detail, overview, walk
from model.paper.pictures import Compared, approach, compared_samples
from model.paper.subject import Subject, open_subject
from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.options import TrainingJob, TrainingOptions
from model.training.plan import TrainingPlan, choose_precision
from model.training.sources import StoredSource

MAP_SAMPLES = 10_000
QUICK_MAP_SAMPLES = 400
PICTURE_COUNT = 200
TABLE_COUNT = 2000
TIMED_SAMPLES = 40
REPEATS = 20
QUICK_BLOCKS = 4

STUDY_IMAGES, STUDY_COUNT = 8000, 500
QUICK_SAMPLES = QUICK_STUDY_IMAGES = 64


def make_items(asked: Paper) -> None:
    """Make one item, or all."""
    every = [item for item in get_args(Item) if item != "all"]
    with _Maker(asked) as maker:
        for item in every if asked.item == "all" else [asked.item]:
            for path in maker.make(item):
                print(f"{item}: {path}")


class _Maker(ExitStack):
    """Makes items, and caches what several of them need."""

    def __init__(self, asked: Paper) -> None:
        super().__init__()
        self._asked = asked

    def make(self, item: Item) -> list[Path]:
        """Make an item, and return its files."""
        pictures: dict[Item, Callable[[Path], None]] = {
            "teaser": self._teaser,
            "overview": lambda path: paper_figures.save_overview(
                path, *self._labels, approach(self._subject, self._inputs)
            ),
            "sensitivity": lambda path: paper_figures.save_region_edits(
                path, *self._labels, self._subject.window, region_edits(self._subject, self._inputs)
            ),
            "value-fields": lambda path: paper_figures.save_value_edits(
                path, *self._labels, self._subject.window, self._value_steps
            ),
            "exploration": lambda path: paper_figures.save_explorations(
                path,
                *self._labels,
                [self._explored, detail(self._subject, self._map, self._explored)],
            ),
            "interpolation": self._interpolation,
            "qualitative": self._qualitative,
        }
        if item in pictures:
            path = self._asked.out / f"{item}.png"
            make_room_for(path)
            pictures[item](path)
            return [path]
        if item == "table1":
            return self._write(item, self._table_1())
        if item == "table2":
            quick = self._asked.quick
            counts = (3, QUICK_BLOCKS) if quick else (REPEATS, PAPER_R)
            return self._write(item, tables.table_2(self._subject, *counts))
        return _make_study(self._asked, item)

    def _teaser(self, path: Path) -> None:
        found = *self._labels, self._subject.window, self._compared
        paper_figures.save_teaser(path, *found, self._value_steps[0], self._explored)

    def _interpolation(self, path: Path) -> None:
        candidates = QUICK_COUNT if self._asked.quick else 48
        places = walk(self._subject, self._map, self._inputs, candidates=candidates)
        paper_figures.save_walk(path, *self._labels, self._inputs, self._map, places)

    def _qualitative(self, path: Path) -> None:
        found = {self._subject.volume.name: self._compared}
        for subject in self._subjects[1:]:
            count = self._asked.samples(PICTURE_COUNT)
            found[subject.volume.name] = compared_samples(subject, count)
        paper_figures.save_qualitative(path, found)

    @cached_property
    def _folders(self) -> list[Path]:
        if self._asked.models:
            return list(self._asked.models)
        # Pictures show the first model, so the most accurate one comes first.
        errors = {folder: load_card(folder).metrics for folder in shipped_models()}
        folders = sorted(errors, key=lambda each: errors[each].get("holdout", {}).get("rmse", inf))
        if not folders:
            raise CheckpointError(
                "No model is shipped; train one with 'train', and give its folder by --model."
            )
        if self._asked.volume.path is None:
            return folders
        volume = self._asked.volume.read()
        own = volume.fingerprint
        fitting = [each for each in folders if load_card(each).scene.volume_fingerprint == own]
        if not fitting:
            raise CheckpointError(
                f"No model is shipped for '{volume.name}'; train one with 'train', and give its "
                "folder by --model."
            )
        return fitting

    @cached_property
    def _subjects(self) -> list[Subject]:
        opened = []
        for folder in self._folders:
            opened.append(open_subject(folder, self._asked.volume, self._asked.device))
            self.callback(opened[-1].close)
        return opened

    @property
    def _subject(self) -> Subject:
        """The model for all figures that show one volume."""
        return self._subjects[0]

    @property
    def _labels(self) -> tuple[str, str]:
        return self._subject.volume.name, self._subject.volume.units

    @cached_property
    def _inputs(self) -> SceneInputs:
        scene = self._subject.generator.scene
        if self._asked.tf is not None:
            tf = load_fitted(self._asked.tf, scene.scalar_range, scene.scale)
        else:
            tf = default_transfer_function(self._subject.volume)
        return SceneInputs.of(self._asked.view, tf)

    @cached_property
    def _map(self) -> LatentMap:
        samples = QUICK_MAP_SAMPLES if self._asked.quick else MAP_SAMPLES
        return final_map(self._subject.space, samples)

    @cached_property
    def _explored(self) -> Exploration:
        return overview(self._subject, self._map, self._inputs)

    @cached_property
    def _value_steps(self) -> list[ValueStep]:
        return value_edits(self._subject, self._inputs)

    @cached_property
    def _compared(self) -> list[Compared]:
        return compared_samples(self._subject, self._asked.samples(PICTURE_COUNT))

    def _table_1(self) -> tables.Table:
        count = self._asked.samples(TABLE_COUNT)
        store, nearest = None, None
        if self._asked.store is not None:
            store = SampleStore(self._asked.store)
            store.require_holdout(count)
        errors = [self._errors(subject, count, store) for subject in self._subjects]
        if store is not None:
            with counting("nearest training images", count) as show:
                nearest = tables.nearest_errors(store, count, show)
        return tables.table_1(
            self._subjects, errors, count, 4 if self._asked.quick else TIMED_SAMPLES, store, nearest
        )

    def _errors(self, subject: Subject, count: int, store: SampleStore | None) -> tables.Means:
        if store is not None and store.scene != subject.generator.scene:
            print(
                f"{subject.folder.name} has another scene than the data set: it is measured on "
                "samples of its own."
            )
            store = None
        # The first images also take the time for compiling and loading.
        tables.holdout_errors(subject, 1, store=store)
        start = perf_counter()
        tables.holdout_errors(subject, 4, store=store)
        seconds = (perf_counter() - start) / 4 * count
        print(f"Measuring {subject.folder.name} takes {about(seconds)}.")
        with counting(f"measuring {subject.folder.name}", count) as show:
            return tables.holdout_errors(subject, count, show, store)

    def _write(self, item: Item, table: tables.Table) -> list[Path]:
        paths = [self._asked.out / f"{item}{suffix}" for suffix in (".md", ".json")]
        write_text(paths[0], table.markdown())
        write_json(paths[1], table.to_json())
        print_table(table.title, table.heading, table.rows)
        for note in table.notes:
            print(note)
        return paths


def _make_study(asked: Paper, item: Item) -> list[Path]:
    """Run the missing part of a study, in a folder that all studies share."""
    study = STUDIES[str(item)]
    folder = asked.out / ("studies-quick" if asked.quick else "studies")
    job = TrainingJob(
        out=folder,
        volume=asked.volume,
        # As the paper's study of dimensions: 64 x 64 pixels, so the rate of a run's first stage.
        preset="draft",
        settings=(f"joint.learning_rate={TrainingOptions().small.learning_rate}",),
        minutes=None if asked.quick else asked.minutes,
        samples=QUICK_SAMPLES if asked.quick else None,
        workers=asked.workers,
        device=asked.device,
    )
    missing = [v for v in study.variants if not (folder / v.name / "result.json").is_file()]
    if missing and not asked.quick:
        seconds = 60 * asked.minutes * len(missing)
        print(
            f"{item}: {len(missing)} models of {asked.minutes:g} minutes each, "
            f"{about(seconds)}, plus rendering and measuring. It can be stopped and resumed."
        )
    images = QUICK_STUDY_IMAGES if asked.quick else STUDY_IMAGES
    return study_models(str(item), job, images, asked.samples(STUDY_COUNT))


SENSITIVITIES = 20  # hold-out samples at most that are compared with the renderer


def study_models(name: str, job: TrainingJob, images: int, count: int) -> list[Path]:
    """Render missing samples, train and measure missing models, write table and figures."""
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
    paper_figures.save_side_by_side(written[-1], study, result, study_pictures(study, plan))
    if study.varied:
        written.append(out.with_name(f"{name}-errors.png"))
        paper_figures.save_error_curves(written[-1], study, result)
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
    if store.missing_samples():
        render_missing(store, partial(render_store, store, volume, job.workers))
    return store


def _print(study: Study, result: dict[str, object]) -> None:
    heading, *rows = study_table(study, result)
    print_table(study.title, heading, rows)
    console.print(f"The paper's numbers: {study.paper}.")
    for line in recipe_lines(study, result):
        console.print(line)
