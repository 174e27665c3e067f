"""The commands ``dataset``, ``train``, ``evaluate`` and ``study`` and their options.

The module is long because it holds the name, limits and help of each option, but no logic.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import choices, options, values
from app.cli.volume_options import takes_volume
from model.errors import TrainingError
from model.networks.names import PresetName, StudyName
from model.scene.scene import TFFamily
from model.volume_files.source import VolumeSource


@takes_volume()
def dataset(
    *,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="STORE", help="Zarr folder.", callback=values.output_folder),
    ],
    count: Annotated[
        int,
        typer.Option(
            "--count", min=1, max=10_000_000, help="Training samples; a store never shrinks."
        ),
    ],
    source: VolumeSource,
    size: options.PictureSize = 256,
    seed: options.Seed = 0,
    lighting: options.LightingName = "none",
    movable_light: options.MovableLight = False,
    family: options.TFFamilyName = "drawn",
    window: options.Window = None,
    up: options.UpAxis = None,
    holdout: Annotated[
        int | None,
        typer.Option("--holdout", min=1, help="Hold-out samples. (default: a tenth, at most 2000)"),
    ] = None,
    workers: options.Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="Render on the workers of a Dask scheduler such as tcp://host:8786. "
            "(default: processes of its own)",
        ),
    ] = None,
) -> None:
    """Render random samples into a store; run it again to go on or to add more."""
    from app.cli.dataset import SceneOptions, make_dataset

    scene = SceneOptions(
        size,
        lighting,
        values.scalar_window(window),
        movable_light,
        family,
        up or "",
    )
    make_dataset(source, scene, out, count, holdout, seed, workers, scheduler)


@takes_volume()
def train(
    *,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder of run and model.",
            callback=values.output_folder,
        ),
    ],
    preset: Annotated[
        PresetName | None,
        typer.Option(
            "--preset",
            help="Images of 64, 128 or 256 pixels by the paper's two networks at a quarter of "
            "their width, with a deeper decoder of TFs and features modulated by the codes of view "
            "and TFs; or of 256 by the networks as they are in the paper. (default: compact; with "
            "--faithful, paper)",
        ),
    ] = None,
    source: VolumeSource,
    store: options.StoreFolder = None,
    minutes: Annotated[float | None, typer.Option("--minutes", help="Budget in minutes.")] = None,
    samples: Annotated[
        int | None, typer.Option("--samples", help="Budget in samples seen.")
    ] = None,
    epochs: Annotated[
        float | None,
        typer.Option(
            "--epochs",
            min=0.001,
            help="Budget in passes of each stage over the samples: those of --dataset, or 200000 "
            "that are rendered. (default with --faithful: 30)",
        ),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out.")] = False,
    start: Annotated[
        Path | None,
        typer.Option(
            "--start-from",
            metavar="MODEL",
            help="Begin with a trained model's weights; with another --seed it sees other samples.",
            callback=values.model,
        ),
    ] = None,
    faithful: Annotated[
        bool,
        typer.Option(
            "--faithful",
            help="The paper's networks, losses, TFs, batches, rates, stages and epochs, nothing "
            "added.",
        ),
    ] = False,
    color_attention: Annotated[
        bool,
        typer.Option(
            "--color-attention",
            help="A variant of the networks: pixels look their colours up in the colour TF, by an "
            "attention over scalar values.",
        ),
    ] = False,
    width: Annotated[
        float | None,
        typer.Option(
            "--width",
            min=0.02,
            max=4,
            help="Channels of the networks, as a fraction of the paper's. (default: the preset's)",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Change one number of the recipe, such as opacity_l1_weight=50 or "
            "joint.learning_rate=5e-4; may be repeated.",
        ),
    ] = None,
    reuse: Annotated[
        float | None,
        typer.Option(
            "--reuse",
            min=1,
            help="How often each fresh sample is learned from; more takes less rendering. "
            "(default: 4, or more when lit)",
        ),
    ] = None,
    lighting: options.LightingName = "none",
    movable_light: options.MovableLight = False,
    family: Annotated[
        TFFamily | None,
        typer.Option(
            "--tf-family",
            help=f"{options.FAMILY_HELP} (default: drawn; with --faithful, paper)",
        ),
    ] = None,
    window: options.Window = None,
    up: options.UpAxis = None,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    device: options.DeviceName = "auto",
    precision: options.TrainingPrecisionName = "auto",
) -> None:
    """Train a generator of one volume's renderings."""
    from model.training.epochs import (
        PAPER_EPOCHS,
        PAPER_IMAGES,
        halvings_of_epochs,
        samples_of_epochs,
    )
    from model.training.job import TrainingJob
    from model.training.options import TrainingOptions

    preset = preset or ("paper" if faithful else "compact")
    if family is None:
        # Those of a stored data set are what they are.
        of_paper = faithful and store is None
        family = "paper" if of_paper else "drawn"
    if epochs is not None and (minutes is not None or samples is not None):
        raise TrainingError("Give one of --epochs, --minutes and --samples.")
    if faithful and minutes is None and samples is None:
        epochs = epochs or PAPER_EPOCHS
    changes = tuple(settings or ())
    if epochs is not None:
        recipe = (TrainingOptions.faithful() if faithful else TrainingOptions()).with_settings(
            changes
        )
        images = PAPER_IMAGES
        if store is not None:
            # Late: with it comes Zarr.
            from model.samples.sample_store import SampleStore

            images = SampleStore(store).count("train")
        samples = samples_of_epochs(epochs, images, recipe)
        # Before what was asked for, which has the last word.
        changes = halvings_of_epochs(epochs) + changes if faithful else changes
        if faithful and store is None and reuse is None:
            # As often as in the paper is each image learned from.
            reuse = max(1.0, epochs)
    asked = TrainingJob(
        out=out,
        volume=source,
        store=store,
        preset=preset,
        color_attention=color_attention,
        width=width,
        faithful=faithful,
        settings=changes,
        minutes=choices.minutes_of(minutes, samples, 60.0),
        samples=samples,
        lighting=lighting,
        movable_light=movable_light,
        tf_family=family,
        window=values.scalar_window(window),
        up=up or "",
        reuse=reuse,
        start=start,
        seed=seed,
        workers=workers,
        device=device,
        precision=precision,
        resume=resume,
    )
    asked.volume.check()
    if resume and not out.is_dir():
        raise TrainingError(f"{out}: there is no training run to resume; start one instead.")
    # Late: with it comes all that trains.
    from app.cli.train import train_model

    train_model(asked)


@takes_volume(placed=False)
def evaluate(
    *,
    model: Annotated[
        Path,
        typer.Option("--model", help="Folder of a trained model.", callback=values.model),
    ],
    count: Annotated[int, typer.Option("--count", min=1, help="Hold-out samples.")] = 2000,
    source: VolumeSource,
    store: options.StoreFolder = None,
    json: options.JsonFile = None,
    record: Annotated[
        bool,
        typer.Option("--record", help="Also write the errors into the model's card."),
    ] = False,
    device: options.DeviceName = "auto",
    workers: options.Workers = None,
) -> None:
    """Measure a model on hold-out samples, beside the nearest training image."""
    from app.cli.evaluate import evaluate_model
    from model.evaluation.job import EvaluationJob

    job = EvaluationJob(model, count, source, store, workers, device)
    evaluate_model(job, json, record)


@takes_volume()
def study(
    *,
    study: Annotated[StudyName, typer.Argument(metavar="STUDY", help="Which one.")],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder of samples, runs and table.",
            callback=values.output_folder,
        ),
    ],
    source: VolumeSource,
    preset: Annotated[PresetName, typer.Option("--preset", help="Size of all networks.")] = "draft",
    lighting: options.LightingName = "none",
    faithful: Annotated[
        bool,
        typer.Option("--faithful", help="All models by the paper's recipe, see 'train'."),
    ] = False,
    minutes: Annotated[
        float | None, typer.Option("--minutes", help="Budget of each model. (default: 10)")
    ] = None,
    samples: Annotated[
        int | None, typer.Option("--samples", help="Budget of each model in samples seen.")
    ] = None,
    images: Annotated[
        int, typer.Option("--images", min=16, help="Training samples that are rendered first.")
    ] = 20_000,
    count: Annotated[int, typer.Option("--count", min=1, help="Hold-out samples.")] = 500,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    device: options.DeviceName = "auto",
) -> None:
    """The paper's studies anew: baselines, latent-dim or l1-weight. Run again to go on."""
    from model.training.job import TrainingJob

    job = TrainingJob(
        out=out,
        volume=source,
        preset=preset,
        faithful=faithful,
        lighting=lighting,
        minutes=choices.minutes_of(minutes, samples, 10.0),
        samples=samples,
        seed=seed,
        workers=workers,
        device=device,
    )
    from app.cli.study import StudyOrder, study_models

    for path in study_models(StudyOrder(study, job, images, count)):
        typer.echo(f"{study}: {path}")
