"""Running a training job."""

from __future__ import annotations

import os
from collections.abc import Callable

from model.devices import choose_device
from model.errors import TrainingError
from model.samples.sample_store import SampleStore
from model.scene.volume import Volume
from model.training import parallel
from model.training.job import TrainingJob
from model.training.plan import TrainingPlan, TrainingReport, check_image_size
from model.training.precision import choose_precision
from model.training.sources import SampleSource, StoredSource
from model.training.state import check_new, load_progress
from model.training.streamed_samples import StreamSource
from model.training.trainer import train
from model.training.warm_start import WarmStart

MANY_WORKERS = 4
"""Number of processors from which on samples are rendered by processes beside a GPU."""


def run_job(
    job: TrainingJob,
    on_report: Callable[[TrainingReport], None] = lambda report: None,
) -> None:
    """Train; with several processes, each calls this.

    Parameters
    ----------
    on_report : callable
        Called in the first process after each optimization step.

    Raises
    ------
    TrainingError, DatasetError, VolumeError, CheckpointError, DeviceError
        When the run cannot start; see :func:`model.training.trainer.train`.
    KeyboardInterrupt
        When it was stopped, and is saved.
    """
    if job.resume:
        _check_resumption(job)
    elif not parallel.rank_to_be():
        check_new(job.out)
    with parallel.process_group(choose_device(job.device)) as device:
        volume = _volume(job)
        source = _source(job, volume, device.type)
        if volume is not None:
            # A stored data set has a range of its own.
            volume = volume.over(source.scene.scalar_range, source.scene.scale)
        check_image_size(job.size, source.scene)
        start = None if job.start is None else WarmStart.read(job.start)
        plan = TrainingPlan(
            source=source,
            preset=job.preset,
            size=job.size if start is None else start.size_of(job.size),
            options=job.options,
            budget=job.budget,
            folder=job.out,
            device=device,
            start=start,
            precision=parallel.from_first(choose_precision(device, job.precision)),
        )
        train(plan, job.resume, on_report)


def _volume(job: TrainingJob) -> Volume | None:
    """Return the job's volume; None if it is not needed."""
    return job.volume.read() if job.store is None or job.volume.path is not None else None


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
    # A GPU that trains is not to wait for the interpreter's lock, which rendering threads hold.
    in_processes = device == "cuda" and (job.workers or os.cpu_count() or 1) >= MANY_WORKERS
    return StreamSource(
        volume,
        scene,
        job.seed,
        job.reuse,
        job.workers,
        processes=in_processes,
    )


def _check_resumption(job: TrainingJob) -> None:
    """Refuse with a better sentence what the run itself would refuse."""
    progress, recipe = load_progress(job.out)
    if job.store is None and "reuse" not in recipe:
        raise TrainingError(
            f"{job.out}: the run learns from a stored data set; name it.", dataset="STORE"
        )
    if job.store is not None and "reuse" in recipe:
        raise TrainingError(
            f"{job.out}: the run renders its samples itself; leave the data set out."
        )
    if progress.stage == "done":
        raise TrainingError(
            f"{job.out}: the run is finished; train longer in another folder, from this model.",
            start_from=str(job.out),
        )
