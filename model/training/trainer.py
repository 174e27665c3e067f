"""The training run: all stages in one loop that can stop and resume anywhere.

A run lives in a folder: ``training.json`` with its tensors (the resumable
state), ``log.csv``, ``sheets/`` with pictures, and, from the first interval
that draws colours on, the model itself, which the window can open while
training goes on.
"""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch
from filelock import FileLock, Timeout

from model.checkpoint import ModelCard, save_model
from model.dataset import SampleBatch
from model.encoding import EncodedBatch, encode_batch
from model.errors import TrainingError
from model.networks.blocks import NetworkSize
from model.training import parallel
from model.training.guard import Guard
from model.training.options import Budget, TrainingOptions
from model.training.progress import MEASURES, HoldoutProbe, RunLog
from model.training.schedule import Schedule
from model.training.sources import SampleSource
from model.training.stage import Losses, Stage
from model.training.state import STATE_FILE, Progress, load_progress, load_stage, save_state

LOCK_FILE = "training.lock"


@dataclass(frozen=True)
class TrainingPlan:
    """What to train, on what, for how long, and where to.

    Attributes
    ----------
    source : SampleSource
    preset : str
        Name of the preset, for the record.
    size : NetworkSize
    options : TrainingOptions
    budget : Budget
    folder : Path
    device : torch.device
    interval : float
        Seconds between states on disk: what a kill can lose at most.
    """

    source: SampleSource
    preset: str
    size: NetworkSize
    options: TrainingOptions
    budget: Budget
    folder: Path
    device: torch.device
    interval: float = 60.0

    def recipe(self) -> dict[str, Any]:
        """What must not change when a run is resumed, as plain data."""
        return {
            "preset": self.preset,
            "size": asdict(self.size),
            **self.source.recipe(),
            "options": self.options.to_json(),
        }

    def check_recipe(self, found: dict[str, Any]) -> None:
        """Raise :class:`model.errors.TrainingError` when the folder's run has another recipe."""
        changed = _differences(_plain(self.recipe()), found)
        if changed:
            raise TrainingError(
                f"{self.folder}: the run to resume has {', '.join(changed)}; "
                "give the options that it was started with."
            )


@dataclass(frozen=True)
class TrainingReport:
    """What the run tells at each step, for a progress bar.

    Attributes
    ----------
    stage : str
    spent : float
        Share of the whole budget that is used up, 0..1.
    seconds : float
    samples : int
    losses : dict of float
    metrics : dict of float
        Of the last interval's hold-out; empty before the first.
    notice : str
        Something to be said once; mostly empty.
    """

    stage: str
    spent: float
    seconds: float
    samples: int
    losses: Losses
    metrics: dict[str, float]
    notice: str = ""


def train(
    plan: TrainingPlan,
    resume: bool = False,
    on_report: Callable[[TrainingReport], None] = lambda report: None,
) -> None:
    """Train within the budget.

    Parameters
    ----------
    plan : TrainingPlan
    resume : bool
        Go on with the run in the folder; without it the folder must hold none.
    on_report : callable
        Called after each optimisation step.

    Raises
    ------
    TrainingError
        When the folder holds a run (or, resuming, none or another one), when
        another process trains there, when the data set is too small, or when a
        loss is no longer finite.
    """
    try:
        with _alone(plan.folder):
            _Run(plan, resume, on_report).train()
    finally:
        plan.source.close()


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keep other processes from training in the same folder."""
    if parallel.rank():
        yield
        return
    lock = FileLock(folder / LOCK_FILE, timeout=0)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise TrainingError(
            f"{folder}: another process is training there; wait for it, stop it, "
            "or choose another folder."
        ) from None
    except OSError as error:
        raise _unwritable(folder, error) from error
    try:
        yield
    finally:
        lock.release()


def _unwritable(folder: Path, error: OSError) -> TrainingError:
    return TrainingError(
        f"{folder}: the run cannot be written ({error.strerror}); "
        "make room or choose another folder."
    )


class _Run:
    def __init__(
        self, plan: TrainingPlan, resume: bool, on_report: Callable[[TrainingReport], None]
    ) -> None:
        self.plan = plan
        self.on_report = on_report
        self.schedule = Schedule(plan.size, plan.options, plan.source.scene, plan.device)
        self.progress = self._first_progress(resume)
        # All have looked into the folder before the first one writes to it.
        parallel.wait_for_all()
        self.guard = Guard()
        self.log = RunLog(plan.folder, self.progress.samples)
        self.metrics = self.log.last_metrics()
        self.probe = HoldoutProbe(plan.source, plan.size, plan.device)
        if resume:
            for stage in self.schedule.begun(self.progress.stage):
                load_stage(plan.folder, stage)
        self._started = time.monotonic() - self.progress.seconds
        self._saved = time.monotonic()

    def train(self) -> None:
        try:
            names = self.schedule.names
            for name in names[names.index(self.progress.stage) :]:
                if name != self.progress.stage:
                    self.progress.enter(name)
                    self._checkpoint()
                self._train_stage(self.schedule.stages[name])
            self.progress.stage = "done"
            self._checkpoint()
        except KeyboardInterrupt:
            self._checkpoint()
            raise
        except OSError as error:
            raise _unwritable(self.plan.folder, error) from error

    def _first_progress(self, resume: bool) -> Progress:
        plan = self.plan
        image_size = plan.source.scene.image_size
        if plan.size.image_size != image_size:
            raise TrainingError(
                f"The samples have {image_size} pixels but the preset '{plan.preset}' draws "
                f"{plan.size.image_size}; make a data set with --size {plan.size.image_size}."
            )
        plan.source.check(max(s.stage.batch_size for s in self.schedule.stages.values()))
        if not resume:
            if (plan.folder / STATE_FILE).exists():
                raise TrainingError(
                    f"{plan.folder}: the folder holds a training run; "
                    "add --resume to go on with it, or choose another folder."
                )
            return Progress(self.schedule.names[0])
        progress, recipe = load_progress(plan.folder)
        plan.check_recipe(recipe)
        if progress.stage == "done":
            raise TrainingError(
                f"{plan.folder}: the run is finished; train longer in another folder."
            )
        return progress

    def _train_stage(self, stage: Stage) -> None:
        share, _ = self._decide()
        recent: list[Losses] = []
        for samples in self._batches(stage.stage.batch_size):
            if share >= 1 and stage.steps:
                break
            parts = stage.parts
            result = stage.step(self._encoded(samples), share)
            losses = result.losses
            self._stop_if(stage, self.guard.check_step(result))
            recent.append(losses)
            self.progress.batch += 1
            self.progress.samples += len(samples) * parallel.ranks()
            self.progress.seconds = time.monotonic() - self._started
            share, due = self._decide()
            notice = "" if stage.parts == parts else _split_notice(stage)
            self._report(losses, notice)
            if due:
                if parallel.rank() == 0:
                    self._take_stock(stage, recent)
                self._saved = time.monotonic()
                recent.clear()

    def _take_stock(self, stage: Stage, recent: list[Losses]) -> None:
        """Measure, and save what is worth it."""
        measured = self._measure(recent)
        seen = self.progress.batch * stage.stage.batch_size * parallel.ranks()
        self._stop_if(stage, self.guard.check_measurement(measured, seen))
        if self.guard.healthy:
            self._checkpoint()

    def _decide(self) -> tuple[float, bool]:
        """Share of the stage that is over, and whether to measure and save; alike on all ranks."""
        share = self._stage_share()
        due = time.monotonic() - self._saved > self.plan.interval or share >= 1
        share, flag = parallel.from_first([share, float(due)], self.plan.device)
        return share, bool(flag)

    def _stage_share(self) -> float:
        """Share of the current stage's part of the budget that is used up."""
        spent = self.plan.budget.spent(self.progress.seconds, self.progress.samples)
        return self.schedule.share(self.progress.stage, spent)

    def _batches(self, batch_size: int) -> Iterator[SampleBatch]:
        """Training samples without end, from where the run stands."""
        stage = self.schedule.names.index(self.progress.stage)
        seed = self.plan.options.seed
        own = parallel.own_stage(stage)
        return self.plan.source.batches(own, batch_size, seed, self.progress.batch)

    def _encoded(self, samples: SampleBatch) -> EncodedBatch:
        plan = self.plan
        view_range = plan.source.scene.view_range
        batch = encode_batch(samples, view_range, plan.size.opacity_size)
        return batch.to(plan.device)

    def _stop_if(self, stage: Stage, trouble: str | None) -> None:
        if trouble is not None:
            raise TrainingError(
                f"{self.plan.folder}: the {stage.name} stage was stopped after "
                f"{self.progress.samples:,} samples: {trouble}. "
                "The folder holds the last good state."
            )

    def _measure(self, recent: list[Losses]) -> dict[str, float]:
        names = dict.fromkeys(name for losses in recent for name in losses)
        losses = {k: float(np.mean([r[k] for r in recent if k in r])) for k in names}
        sheet = self.plan.folder / "sheets" / f"{self.progress.samples:09d}.png"
        measured = self.probe.measure(self.schedule.generator(), sheet)
        self.metrics = {name: measured[name] for name in MEASURES}
        self.log.write(self.progress, losses, measured)
        # Only what the stage trains can collapse.
        if not self.schedule.draws_color(self.progress.stage):
            measured["diversity"] = measured["opacity_diversity"]
        return measured

    def _checkpoint(self) -> None:
        if parallel.rank():
            return
        self.progress.seconds = time.monotonic() - self._started
        name = self.progress.stage
        begun = self.schedule.begun(name)
        save_state(self.plan.folder, self.progress, self.plan.recipe(), begun)
        if self.schedule.draws_color(name) and begun[-1].steps:
            save_model(self.plan.folder, self._card(), self.schedule.generator())
        self._saved = time.monotonic()

    def _card(self) -> ModelCard:
        plan = self.plan
        return ModelCard(
            scene=plan.source.scene,
            preset=plan.preset,
            size=plan.size,
            training={
                "options": plan.options.to_json(),
                "stage": self.progress.stage,
                "seconds": round(self.progress.seconds, 1),
                "samples_seen": self.progress.samples,
                **plan.source.summary(),
                "device": str(plan.device),
                "curve": self.log.curve(),
            },
            metrics={"holdout": self.metrics, "holdout_count": self.probe.count},
            versions={
                "python": platform.python_version(),
                **{name: version(name) for name in ("torch", "vtk", "numpy")},
            },
        )

    def _report(self, losses: Losses, notice: str) -> None:
        spent = self.plan.budget.spent(self.progress.seconds, self.progress.samples)
        self.on_report(
            TrainingReport(
                stage=self.progress.stage,
                spent=min(spent, 1.0),
                seconds=self.progress.seconds,
                samples=self.progress.samples,
                losses=losses,
                metrics=self.metrics,
                notice=notice,
            )
        )


def _split_notice(stage: Stage) -> str:
    return (
        f"The memory is too small for {stage.stage.batch_size} samples at once: from here on "
        f"each batch of the {stage.name} stage is learned from in {stage.parts} parts."
    )


def _differences(asked: dict[str, Any], found: dict[str, Any], path: str = "") -> list[str]:
    """What a run has otherwise than it is asked for, such as "options.seed 1, not 0"."""
    changed = []
    for name, value in asked.items():
        other = found.get(name)
        if isinstance(value, dict) and isinstance(other, dict):
            changed += _differences(value, other, f"{path}{name}.")
        elif other != value:
            changed.append(f"{path}{name} {other}, not {value}")
    return changed


def _plain(recipe: dict[str, Any]) -> dict[str, Any]:
    """A recipe as it comes back from JSON, with lists for tuples."""
    plain: dict[str, Any] = json.loads(json.dumps(recipe))
    return plain
