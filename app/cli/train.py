"""``train``: a generator of one volume's renderings."""

from __future__ import annotations

import shlex
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from rich.console import Group
from rich.live import Live
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from app.cli import options
from app.cli.console import console
from model.devices import choose_device
from model.errors import TrainingError
from model.networks.size import Architecture, NetworkSize
from model.rendering.raycast import cuda
from model.samples.sample_store import SampleStore
from model.scene.scene import Lighting, RendererName, Scene
from model.scene.transfer_function import Range
from model.training import parallel
from model.training.execution import Execution
from model.training.execution_choice import choose_execution
from model.training.options import PRESETS, Budget, TrainingOptions
from model.training.plan import TrainingPlan, TrainingReport
from model.training.sources import SampleSource, StoredSource
from model.training.state import STATE_FILE, load_progress
from model.training.streamed_samples import StreamSource
from model.training.trainer import train
from model.training.warm_start import WarmStart

DEFAULT_MINUTES = 60.0


@dataclass(frozen=True)
class TrainOrder:
    """What to train: the command's options, see there."""

    volume: options.VolumeSource
    store: Path | None
    preset: str
    out: Path
    minutes: float | None
    samples: int | None
    resume: bool
    start: Path | None
    faithful: bool
    architecture: Architecture | None
    settings: tuple[str, ...]
    lighting: Lighting
    renderer: RendererName
    reuse: float | None
    window: Range | None
    seed: int
    workers: int | None
    device: str
    precision: str


def train_model(order: TrainOrder) -> None:
    """Train, with a progress bar; Ctrl-C saves the run before it ends."""
    budget = budget_of(order.minutes, order.samples, DEFAULT_MINUTES)
    _check_options(order)
    if order.resume:
        _check_resumption(order)
    with parallel.process_group(choose_device(order.device)) as device:
        source, size, recipe = _source(order, device.type), _size(order), _recipe(order)
        plan = TrainingPlan(
            source=source,
            preset=order.preset,
            size=size,
            options=recipe,
            budget=budget,
            folder=order.out,
            device=device,
            start=None if order.start is None else WarmStart.read(order.start),
            execution=execution_of(size, recipe, source.scene, device, order.precision),
        )
        _train(plan, order)


def _train(plan: TrainingPlan, order: TrainOrder) -> None:
    if parallel.rank():
        train(plan, order.resume)
        return
    with TrainingDisplay() as display:
        try:
            train(plan, order.resume, display.show)
        except KeyboardInterrupt:
            if not (plan.folder / STATE_FILE).exists():
                console.print("Stopped before there was anything to save.")
                raise
            again = shlex.join([*(a for a in sys.argv[1:] if a != "--resume"), "--resume"])
            console.print(f"Stopped; the run is saved. Go on with: python main.py {again}")
            raise
    volume = [] if order.volume.path is None else ["--volume", str(order.volume.path)]
    window = shlex.join(["python", "main.py", "--model", str(order.out), *volume])
    console.print(f"The model is in {order.out}; open it with: {window}")


def execution_of(
    size: NetworkSize,
    recipe: TrainingOptions,
    scene: Scene,
    device: torch.device,
    precision: str = "auto",
) -> Execution:
    """How this machine computes training steps fastest; the first process says it."""
    # One after the other: all would slow each other down, and the later ones find it kept.
    if parallel.rank():
        parallel.wait_for_all()
    with parallel.alone():
        chosen = choose_execution(size, recipe, scene, device, precision)
    if not parallel.rank():
        parallel.wait_for_all()
        console.print(f"Steps are computed in {chosen}: the fastest way measured here.")
    return chosen


def budget_of(minutes: float | None, samples: int | None, default: float) -> Budget:
    """The budget that two options ask for; so many minutes when both are left out."""
    return Budget(default if minutes is None and samples is None else minutes, samples)


def size_of(preset: str, architecture: Architecture | None) -> NetworkSize:
    """A preset's size, with another architecture where one is named."""
    size = PRESETS[preset]
    return size if architecture is None else replace(size, architecture=architecture)


def _size(order: TrainOrder) -> NetworkSize:
    """The size; the paper's networks have nothing that was added to them."""
    if order.faithful:
        return replace(
            size_of(order.preset, "paper"), rays=False, modulation=False, deep_codec=False
        )
    return size_of(order.preset, order.architecture)


def _recipe(order: TrainOrder) -> TrainingOptions:
    recipe = TrainingOptions.faithful() if order.faithful else TrainingOptions()
    return replace(recipe, seed=order.seed).with_settings(order.settings)


def _check_options(order: TrainOrder) -> None:
    """Refuse options that would have no effect."""
    fixed = {
        "--lighting": order.lighting != "none",
        "--window": order.window is not None,
        "--reuse": order.reuse is not None,
        "--renderer": order.renderer != "raycast",
        "--workers": order.workers is not None,
    }
    given = [name for name, value in fixed.items() if value]
    if order.store is not None and given:
        raise TrainingError(
            f"With a stored data set {' and '.join(given)} would have no effect: it is rendered "
            "already; leave that out, or leave --dataset out."
        )
    if order.start is not None and order.start.resolve() == order.out.resolve():
        raise TrainingError(
            f"{order.out}: training would write over the model that it starts from; "
            "choose another folder for --out."
        )
    if order.faithful and order.architecture not in (None, "paper"):
        raise TrainingError("The paper's recipe is for its networks; leave --architecture out.")


def _check_resumption(order: TrainOrder) -> None:
    """Refuse with a better sentence what the run itself would refuse."""
    progress, recipe = load_progress(order.out)
    if order.store is None and "reuse" not in recipe:
        raise TrainingError(
            f"{order.out}: the run learns from a stored data set; name it by --dataset."
        )
    if order.store is not None and "reuse" in recipe:
        raise TrainingError(
            f"{order.out}: the run renders its samples itself; leave --dataset out."
        )
    if progress.stage == "done":
        raise TrainingError(
            f"{order.out}: the run is finished; train longer in another folder with "
            f"--start-from {shlex.quote(str(order.out))}."
        )


def _source(order: TrainOrder, device: str) -> SampleSource:
    if order.store is not None:
        store = SampleStore(order.store)
        _check_store(order, store)
        return StoredSource(store)
    volume = order.volume.read()
    size = _size(order)
    scene = Scene.of(volume, size.image_size, order.lighting, order.window, order.renderer)
    on_gpu = device == "cuda" and scene.renderer == "raycast" and cuda.is_available()
    return StreamSource(
        volume,
        scene,
        order.seed,
        order.reuse,
        order.workers,
        device="cuda" if on_gpu else "cpu",
    )


def _check_store(order: TrainOrder, store: SampleStore) -> None:
    if order.volume.path is not None:
        volume = order.volume.read()
        if volume.fingerprint != store.scene.volume_fingerprint:
            raise TrainingError(
                f"{order.store}: the data set shows '{store.scene.volume_name}', "
                f"not {order.volume.path}; leave --volume out or name the right one."
            )


class TrainingDisplay:
    """A bar over the budget with speed and remaining time, and the losses below it."""

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            TaskProgressColumn(),
            TextColumn("{task.fields[speed]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("left"),
        )
        self._losses = Text()
        self._live = Live(Group(self._progress, self._losses), console=console)
        self._task = self._progress.add_task("starting", total=1.0, speed="")
        self._first: TrainingReport | None = None
        self._metrics: dict[str, float] = {}

    def __enter__(self) -> TrainingDisplay:
        self._live.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._live.stop()
        if not console.is_terminal:
            # Into a file, rich leaves the cursor behind the last numbers.
            console.print()

    def begin(self, name: str) -> None:
        """Start over, for the next of several runs."""
        self._live.console.print(name)
        self._first, self._metrics = None, {}

    def show(self, report: TrainingReport) -> None:
        """Show a report; a line stays for each new hold-out measurement."""
        first = self._first = self._first or report
        seconds = max(report.seconds - first.seconds, 1e-3)
        speed = (report.samples - first.samples) / seconds
        self._progress.update(
            self._task,
            description=f"stage {report.stage}",
            completed=report.spent,
            speed=f"{speed:.0f} samples/s",
        )
        if report.notice:
            self._live.console.print(report.notice)
        self._losses.plain = _numbers(report.losses)
        if report.metrics and report.metrics != self._metrics:
            self._metrics = report.metrics
            self._live.console.print(
                f"{report.seconds / 60:6.1f} min {report.samples:>9,} samples  "
                f"hold-out {_numbers(report.metrics)}"
            )


def _numbers(values: dict[str, float]) -> str:
    return "  ".join(f"{name} {value:.3f}" for name, value in values.items())
