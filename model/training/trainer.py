"""The training run: all stages in one loop that can stop and resume after any step.

A run is stored in a folder: ``training.json`` with its tensors (the resumable state), ``log.csv``,
``sheets/`` with images, and, from the first checkpoint of a stage that trains whole colour images,
the model itself, which the window can open during training.
"""

import platform
import time
from collections.abc import Callable, Generator, Iterable
from contextlib import closing, nullcontext
from dataclasses import asdict
from importlib.metadata import version

import numpy as np

from model.errors import CollapseError, TrainingError
from model.files import free_space
from model.measurements import processors
from model.networks.blocks import choose_device
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.networks.generator_network import GeneratorNetwork
from model.samples.sample_store import SampleStore
from model.scene.volume import Volume
from model.training import monitor, parallel, state
from model.training.batch import EncodedBatch, encode_batch
from model.training.options import TrainingJob
from model.training.plan import (
    TrainingPlan,
    TrainingReport,
    WarmStart,
    check_image_size,
    choose_precision,
)
from model.training.sources import SampleSource, StoredSource, StreamSource
from model.training.stage import Losses, Stage
from model.training.stages import Schedule

LONGER = "train longer in another folder, from this model."
FIRST_SAVE_S = 10.0  # time until a run is first saved


def train(
    plan: TrainingPlan,
    resume: bool = False,
    on_report: Callable[[TrainingReport], None] = lambda report: None,
) -> None:
    """Train until the budget is used.

    `on_report` is called after each step. If it raises :class:`KeyboardInterrupt`, or after Ctrl-C,
    the run is saved and ends; a second Ctrl-C ends it unsaved. Raises :class:`CollapseError` if a
    loss is no longer finite, or if codes or images collapse.
    """
    with nullcontext() if parallel.rank() else state.training_in(plan.folder):
        _Run(plan, resume, on_report).train()


class _Run:
    def __init__(
        self, plan: TrainingPlan, resume: bool, on_report: Callable[[TrainingReport], None]
    ) -> None:
        self.plan = plan
        self.on_report = on_report
        self.schedule = Schedule(
            plan.size, plan.options, plan.source.scene, plan.device, plan.precision
        )
        if plan.start is not None:
            plan.start.check(plan.size, plan.source.scene)
            self.schedule.start_from(plan.start.network)
        self.progress = self._first_progress(resume)
        # All ranks must have read the folder before the first one writes to it.
        parallel.wait_for_all()
        self.guard = monitor.CollapseGuard()
        self.log = monitor.RunLog(plan.folder, self.progress.samples)
        self.metrics = self.log.last_metrics()
        self.probe = monitor.HoldoutProbe(plan.source, plan.size, plan.device)
        self.statistics = monitor.BatchNormRecalibration(plan.source, plan.size, plan.device)
        self._evaluated: tuple[int, GeneratorNetwork] | None = None
        if resume:
            for stage in self.schedule.begun(self.progress.stage):
                state.load_stage(plan.folder, stage)
        self._started = time.monotonic() - self.progress.seconds
        self._saved = time.monotonic()
        self._is_on_disk = resume

    def train(self) -> None:
        self._check_room()
        names = self.schedule.names
        with state.interruption() as self.interrupted:
            for name in names[names.index(self.progress.stage) :]:
                if name != self.progress.stage:
                    self.progress.enter(name)
                    self.schedule.enter(name)
                    self._checkpoint()
                stage = self.schedule.stages[name]
                with closing(self._batches(stage)) as batches:
                    self._train_stage(stage, batches)
            self.progress.stage = "done"
            self._checkpoint()

    def _first_progress(self, resume: bool) -> state.Progress:
        plan = self.plan
        check_image_size(plan.size, plan.source.scene)
        stages = self.schedule.stages.values()
        plan.source.check(max(stage.stage.batch_size for stage in stages))
        if not resume:
            state.check_new(plan.folder)
            return state.Progress(self.schedule.names[0])
        progress, recipe = state.load_progress(plan.folder)
        plan.check_recipe(recipe)
        if progress.stage == "done":
            raise TrainingError(f"{plan.folder}: the run is finished; {LONGER}")
        return progress

    def _train_stage(self, stage: Stage, batches: Iterable[EncodedBatch]) -> None:
        share, _, _ = self._decide()
        recent: list[Losses] = []
        for batch in batches:
            if share >= 1 and stage.steps:
                break
            parts = stage.parts
            result = stage.step(batch, share)
            losses = result.losses
            self._stop_if(stage, self.guard.check_step(stage, result))
            recent.append(losses)
            self.progress.batch += 1
            self.progress.samples += len(batch) * parallel.ranks()
            self.progress.seconds = time.monotonic() - self._started
            share, due, stop = self._decide()
            notice = "" if stage.parts == parts else _split_notice(stage)
            try:
                self._report(losses, notice)
            except KeyboardInterrupt:
                stop = True
            unsaved = 0.0 if self._is_on_disk else time.monotonic() - self._saved
            if unsaved > FIRST_SAVE_S and self.guard.healthy:
                # Saved but not measured: after a few seconds, errors mean nothing yet.
                self._checkpoint(is_first=True)
            if due:
                if parallel.rank() == 0:
                    measured = self._measure(recent)
                    collapse = self.guard.check_measurement(
                        stage, measured, self.progress.batch, last=share >= 1
                    )
                    self._stop_if(stage, collapse)
                    if self.guard.healthy:
                        self._checkpoint()
                self._saved = time.monotonic()
                recent.clear()
            if stop:
                if self.guard.healthy:
                    self._checkpoint()
                raise KeyboardInterrupt

    def _decide(self) -> tuple[float, bool, bool]:
        """Return the first rank's share of the stage, and whether to checkpoint and stop."""
        spent = self.plan.budget.spent(self.progress.seconds, self.progress.samples)
        share = self.schedule.share(self.progress.stage, spent)
        due = time.monotonic() - self._saved > self.plan.interval or share >= 1
        return parallel.from_first((share, due, self.interrupted.is_set()))

    def _check_room(self) -> None:
        """Refuse to start if there is no disk space for the first checkpoint."""
        if parallel.rank():
            return
        stages = self.schedule.stages.values()
        weights = sum(t.nbytes for s in stages for t in s.generator.state_dict().values())
        # Weights, average and two moments of the optimizer, in the old and the new file.
        need = 8 * weights
        free = free_space(self.plan.folder)
        if free < need:
            raise TrainingError(
                f"{self.plan.folder}: a checkpoint takes about {need / 1e6:.0f} MB, and "
                f"{free / 1e6:.0f} MB are free; make room, or choose another place."
            )

    def _batches(self, stage: Stage) -> Generator[EncodedBatch]:
        """Endless training samples from the run's current batch."""
        plan = self.plan
        own = parallel.own_stage(self.schedule.names.index(self.progress.stage))
        what = stage.stage.batch_size, plan.options.seed, self.progress.batch, stage.image_size
        with closing(plan.source.batches(own, *what)) as batches:
            for samples in batches:
                yield encode_batch(samples, plan.source.scene, plan.size.opacity_size, plan.device)

    def _stop_if(self, stage: Stage, trouble: monitor.Trouble | None) -> None:
        if trouble is not None:
            saved = (self.plan.folder / state.STATE_FILE).exists()
            raise CollapseError(
                f"{self.plan.folder}: the {stage.name} stage was stopped after "
                f"{self.progress.samples:,} samples: {trouble.what}. "
                + ("The folder holds the last good state." if saved else "Nothing was saved yet."),
                set=trouble.setting,
            )

    def _measure(self, recent: list[Losses]) -> dict[str, float]:
        names = dict.fromkeys(name for losses in recent for name in losses)
        losses = {k: float(np.mean([r[k] for r in recent if k in r])) for k in names}
        sheet = self.plan.folder / "sheets" / f"{self.progress.samples:09d}.png"
        with state.writing(self.plan.folder):
            measured = self.probe.measure(self._generator(), sheet)
            self.metrics = {name: measured[name] for name in monitor.MEASURES}
            self.log.write(self.progress, losses, measured)
        # Check the images that the stage trains.
        if self.progress.stage == "opacity":
            measured["diversity"] = measured["opacity_diversity"]
        return measured

    def _checkpoint(self, is_first: bool = False) -> None:
        if parallel.rank():
            return
        self.progress.seconds = time.monotonic() - self._started
        name = self.progress.stage
        begun = self.schedule.begun(name)
        with state.writing(self.plan.folder):
            state.save_state(self.plan.folder, self.progress, self.plan.recipe(), begun)
            if name not in ("opacity", "small") and begun[-1].steps:
                save_model(self.plan.folder, self._card(), self._generator())
        self._is_on_disk = True
        if not is_first:
            self._saved = time.monotonic()

    def _generator(self) -> GeneratorNetwork:
        """Return the averaged generator for evaluation and saving, after recalibration."""
        if not self.plan.options.average_decay:
            return self.schedule.generator()
        if self._evaluated is None or self._evaluated[0] != self.progress.samples:
            own = self.statistics.of(self.schedule.generator())
            self._evaluated = self.progress.samples, own
        return self._evaluated[1]

    def _card(self) -> ModelCard:
        plan = self.plan
        return ModelCard(
            scene=plan.source.scene,
            preset=plan.preset,
            size=plan.size,
            training={
                "options": asdict(plan.options),
                "stage": self.progress.stage,
                "seconds": round(self.progress.seconds, 1),
                "samples_seen": self.progress.samples,
                **plan.source.summary(),
                "device": str(plan.device),
                "precision": plan.precision,
                "curve": self.log.curve(),
                **({} if plan.start is None else {"start": plan.start.card.training}),
            },
            metrics={"holdout": self.metrics, "holdout_count": self.probe.count},
            versions={
                "python": platform.python_version(),
                **{name: version(name) for name in ("torch", "vtk", "numpy")},
            },
        )

    def _report(self, losses: Losses, notice: str) -> None:
        spent = self.plan.budget.spent(self.progress.seconds, self.progress.samples)
        stage, seconds, samples = self.progress.stage, self.progress.seconds, self.progress.samples
        about = stage, min(spent, 1.0), seconds, samples
        self.on_report(TrainingReport(*about, losses, self.metrics, notice))


def _split_notice(stage: Stage) -> str:
    return (
        f"The memory is too small for {stage.stage.batch_size} samples at once: from now on "
        f"each batch of the {stage.name} stage is split into {stage.parts} parts."
    )


MANY_WORKERS = 4  # number of processors from which processes render a GPU's samples


def run_job(
    job: TrainingJob, on_report: Callable[[TrainingReport], None] = lambda report: None
) -> None:
    """Run a training job; with several processes, each calls this."""
    if job.resume:
        _check_resumption(job)
    elif not parallel.rank_to_be():
        state.check_new(job.out)
    with parallel.process_group(choose_device(job.device)) as device:
        is_needed = job.store is None or job.volume.path is not None
        volume = job.volume.read() if is_needed else None
        source = _source(job, volume, device.type)
        if volume is not None:
            # A stored data set has its own range.
            volume = volume.over(source.scene.scalar_range, source.scene.scale)
        check_image_size(job.size, source.scene)
        start = None if job.start is None else WarmStart.read(job.start)
        precision = parallel.from_first(choose_precision(device, job.precision))
        what = source, job.preset, job.size, job.options, job.budget, job.out, device
        plan = TrainingPlan(*what, start=start, precision=precision)
        train(plan, job.resume, on_report)


def _source(job: TrainingJob, volume: Volume | None, device: str) -> SampleSource:
    if job.store is not None:
        store = SampleStore(job.store)
        check_image_size(job.size, store.scene)
        if volume is not None and volume.fingerprint != store.scene.volume_fingerprint:
            raise TrainingError(
                f"{store.path}: the data set shows '{store.scene.volume_name}', "
                f"not {job.volume.path}; name the right one."
            )
        return StoredSource(store)
    assert volume is not None
    scene = job.scene_of(volume)
    # Rendering threads would hold the interpreter's lock, and the GPU would wait.
    in_processes = device == "cuda" and (job.workers or processors()) >= MANY_WORKERS
    return StreamSource(volume, scene, job.seed, job.reuse, job.workers, processes=in_processes)


def _check_resumption(job: TrainingJob) -> None:
    """Refuse wrong options of a resumed run, with a clear sentence."""
    progress, recipe = state.load_progress(job.out)
    if job.store is None and "reuse" not in recipe:
        raise TrainingError(
            f"{job.out}: the run learns from a stored data set; name it.", dataset="STORE"
        )
    if job.store is not None and "reuse" in recipe:
        raise TrainingError(
            f"{job.out}: the run renders its samples itself; leave the data set out."
        )
    if progress.stage == "done":
        text = f"{job.out}: the run is finished; {LONGER}"
        raise TrainingError(text, start_from=str(job.out))
