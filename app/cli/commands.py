"""The commands and their options; each command is implemented in a module of its own.

The module is long because it holds the name, limits and help of each option, but no logic.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast

import typer

from app.cli import options
from app.cli.bench_commands import bench
from app.cli.latent_commands import codec, latent
from model.errors import TfscopeError
from model.volume_files.source import VolumeSource

application = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Look into volumes through transfer functions, beside a generative model.",
)

application.add_typer(bench, name="bench")
application.command()(latent)
application.command()(codec)


@application.callback(invoke_without_command=True)
def window(
    context: typer.Context,
    model: options.ModelFolder = None,
    volume: options.VolumeFile = None,
    device: options.DeviceName = options.Device.AUTO,
    backend: options.BackendName = options.BackendOption.AUTO,
    precision: options.PrecisionName = options.PrecisionOption.FLOAT32,
    screenshot: Annotated[
        Path | None,
        typer.Option(
            "--screenshot",
            metavar="OUT.png",
            help="Open the window off screen, save its picture and exit.",
        ),
    ] = None,
) -> None:
    """Look into volumes through transfer functions, beside a generative model."""
    if context.invoked_subcommand is None:
        from app.cli.window import open_window

        code = open_window(volume, model, str(device), str(backend), str(precision), screenshot)
        raise typer.Exit(code)
    automatic = (options.Device.AUTO, options.BackendOption.AUTO, options.PrecisionOption.FLOAT32)
    if model or volume or screenshot or (device, backend, precision) != automatic:
        command = context.invoked_subcommand
        raise TfscopeError(f"Options before '{command}' are the window's; put them behind it.")


@application.command()
def info(
    path: Annotated[Path, typer.Argument(metavar="FILE_OR_MODEL", help="A volume or a model.")],
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
) -> None:
    """Print what a volume file or a model folder holds."""
    from app.cli.info import print_info

    print_info(VolumeSource(path, raw, component))


@application.command()
def render(
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="OUT", help="OUT.png on black, or OUT.npy: float32 RGBA (H, W, 4)."
        ),
    ],
    renderer: Annotated[
        options.Renderer,
        typer.Option("--renderer", help="The reference, the fast ray caster, or the model."),
    ] = options.Renderer.VTK,
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    model: options.ModelFolder = None,
    view: options.ViewText = "30,20,0,1",
    tf: options.TFFile = None,
    lighting: Annotated[
        options.LightingOption | None,
        typer.Option("--lighting", help="For VTK and ray caster. (default: the model's, or none)"),
    ] = None,
    light: options.LightText = None,
    size: Annotated[
        int | None,
        typer.Option("--size", min=16, max=4096, help="Pixels. (default: the model's, or 256)"),
    ] = None,
    preintegrated: Annotated[
        bool,
        typer.Option(
            "--preintegrated",
            help="The unlit ray caster misses no narrow peaks of the TF: more exact, and slower.",
        ),
    ] = False,
    device: options.DeviceName = options.Device.AUTO,
    backend: options.BackendName = options.BackendOption.EAGER,
    precision: options.PrecisionName = options.PrecisionOption.FLOAT32,
) -> None:
    """Render one image to a file."""
    from app.cli.render import RenderOrder, render_to_file

    render_to_file(
        RenderOrder(
            renderer=str(renderer),
            volume=VolumeSource(volume, raw, component),
            model=model,
            view=view,
            tf=tf,
            lighting=lighting,
            light=light,
            size=size,
            preintegrated=preintegrated,
            device=str(device),
            backend=str(backend),
            precision=str(precision),
            out=out,
        )
    )


@application.command()
def sensitivity(
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="OUT", help="OUT.npz or OUT.csv: all numbers, OUT.png: a figure."
        ),
    ],
    model: options.ModelFolder = None,
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    engine: Annotated[
        options.SensitivityEngine | None,
        typer.Option(
            "--engine",
            help="The ray caster's own derivative, the generator's, or the generator's block by "
            "block, as in the paper. (default: learned with --model, else exact)",
        ),
    ] = None,
    view: options.ViewText = "30,20,0,1",
    tf: options.TFFile = None,
    lighting: Annotated[
        options.LightingOption | None,
        typer.Option("--lighting", help="Of the ray caster's image; global: by differences."),
    ] = None,
    size: Annotated[
        int | None,
        typer.Option(
            "--size", min=16, max=4096, help="Pixels of the rendering; a model has its own size."
        ),
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(
            "--region",
            metavar="X0,Y0,X1,Y1",
            help="Where in the TF does this rectangle of pixels react? (default: the whole image)",
        ),
    ] = None,
    value: Annotated[
        float | None,
        typer.Option("--value", help="Where in the image does this scalar value show?"),
    ] = None,
    block: Annotated[
        int | None,
        typer.Option(
            "--block", min=1, help="All blocks of this many pixels, to edits at all values."
        ),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            "--width",
            min=0,
            help="Standard deviation of the edits, in the data's units; 0 for single samples of "
            "the TF. (default: 6 of 256 samples)",
        ),
    ] = None,
    measure: Annotated[
        options.MeasureOption,
        typer.Option(
            "--measure",
            help="signed: the change of brightness, as in the paper; change: the size of the "
            "change, also where the picture is black.",
        ),
    ] = options.MeasureOption.SIGNED,
    device: options.DeviceName = options.Device.AUTO,
) -> None:
    """Find where in the TF an edit changes a region, or where in the image an edit shows."""
    from app.cli.sensitivity import EngineName, SensitivityOrder, save_sensitivity

    save_sensitivity(
        SensitivityOrder(
            volume=VolumeSource(volume, raw, component),
            model=model,
            engine=None if engine is None else cast(EngineName, str(engine)),
            view=view,
            tf=tf,
            size=size,
            region=region,
            value=value,
            block=block,
            width=width,
            measure=options.measure(measure),
            lighting=lighting,
            device=str(device),
            out=out,
        )
    )


@application.command()
def dataset(
    out: Annotated[Path, typer.Option("--out", metavar="STORE", help="Zarr folder.")],
    count: Annotated[
        int,
        typer.Option(
            "--count", min=1, max=10_000_000, help="Training samples; a store never shrinks."
        ),
    ],
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    size: Annotated[
        int, typer.Option("--size", min=16, max=4096, help="Width and height in pixels.")
    ] = 256,
    seed: options.Seed = 0,
    renderer: options.SampleRendererName = options.SampleRenderer.RAYCAST,
    lighting: options.LightingName = options.LightingOption.NONE,
    movable_light: options.MovableLight = False,
    family: options.TFFamilyName = options.TFFamilyOption.DRAWN,
    window: options.Window = None,
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
            help="Render on the workers of a Dask scheduler such as tcp://host:8786, or of a "
            "local one. (default: processes of its own)",
        ),
    ] = None,
) -> None:
    """Render random samples into a store; run it again to go on or to add more."""
    from app.cli.dataset import SceneOptions, make_dataset

    source = VolumeSource(volume, raw, component)
    scene = SceneOptions(
        size,
        options.lighting(lighting),
        options.parse_window(window),
        options.renderer_name(renderer),
        movable_light,
        options.family_name(family),
    )
    make_dataset(source, scene, out, count, holdout, seed, workers, scheduler)


@application.command()
def train(
    context: typer.Context,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of run and model.")],
    preset: Annotated[
        options.Preset,
        typer.Option(
            "--preset", help="64 x 64, 128 x 128, 256 x 256, or the paper's networks at 256 x 256."
        ),
    ] = options.Preset.COMPACT,
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    store: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            metavar="STORE",
            help="Samples made with 'dataset'. (default: rendered in the background)",
        ),
    ] = None,
    minutes: Annotated[float | None, typer.Option("--minutes", help="Budget in minutes.")] = None,
    samples: Annotated[
        int | None, typer.Option("--samples", help="Budget in samples seen.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out.")] = False,
    start: Annotated[
        Path | None,
        typer.Option(
            "--start-from",
            metavar="MODEL",
            help="Begin with a trained model's weights; with another --seed it sees other samples.",
        ),
    ] = None,
    faithful: Annotated[
        bool, typer.Option("--faithful", help="The paper's recipe, nothing added.")
    ] = False,
    architecture: Annotated[
        options.ArchitectureOption | None,
        typer.Option(
            "--architecture",
            help="A coarse volume whose images a small network refines, or the paper's two "
            "networks. (default: the preset's)",
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
    renderer: options.SampleRendererName = options.SampleRenderer.RAYCAST,
    lighting: options.LightingName = options.LightingOption.NONE,
    movable_light: options.MovableLight = False,
    family: options.TFFamilyName = options.TFFamilyOption.DRAWN,
    window: options.Window = None,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    device: options.DeviceName = options.Device.AUTO,
    precision: options.TrainingPrecisionName = options.TrainingPrecision.AUTO,
    job: Annotated[
        Path | None,
        typer.Option(
            "--job",
            metavar="JOB.json",
            help="Take everything but --out and --resume from a file that --save-job has written.",
        ),
    ] = None,
    save_job: Annotated[
        Path | None,
        typer.Option("--save-job", metavar="JOB.json", help="Write the job there; do not train."),
    ] = None,
    lines: Annotated[
        bool, typer.Option("--json-lines", help="Tell the progress as JSON, an object per line.")
    ] = False,
    stop: Annotated[
        bool, typer.Option("--stop", help="Ask the run in --out to save and end.")
    ] = False,
) -> None:
    """Train a generator of one volume's renderings."""
    from model.scene.scene import scatters
    from model.training.job import TrainingJob
    from model.training.options import preset_size
    from model.training.stopping import ask_to_stop

    if stop:
        _refuse_others(context, "stop")
        ask_to_stop(out)
        typer.echo(f"The run in {out} will be saved and end after its present step.")
        return
    size = preset_size(str(preset), options.architecture_name(architecture))
    scattering = scatters(options.renderer_name(renderer), options.lighting(lighting))
    # Only the codec learns then, unless a stored data set shows something else.
    only_codec = size.architecture == "refined" and not (faithful or scattering or store)
    asked = TrainingJob(
        out=out,
        volume=VolumeSource(volume, raw, component),
        store=store,
        preset=str(preset),
        architecture=options.architecture_name(architecture),
        faithful=faithful,
        settings=tuple(settings or ()),
        minutes=options.minutes_of(minutes, samples, 5.0 if only_codec else 60.0),
        samples=samples,
        lighting=options.lighting(lighting),
        movable_light=movable_light,
        tf_family=options.family_name(family),
        renderer=options.renderer_name(renderer),
        window=options.parse_window(window),
        reuse=reuse,
        start=start,
        seed=seed,
        workers=workers,
        device=str(device),
        precision=str(precision),
        resume=resume,
    )
    if job is not None:
        _refuse_others(context, "job", "resume", "lines", "save_job")
        asked = replace(TrainingJob.load(job), out=out, resume=resume)
    if save_job is not None:
        asked.save(save_job)
        return
    # Late: with it comes all that trains.
    from app.cli.train import train_model

    train_model(asked, lines)


@application.command()
def evaluate(
    model: Annotated[Path, typer.Option("--model", help="Folder of a trained model.")],
    count: Annotated[int, typer.Option("--count", min=1, help="Hold-out samples.")] = 2000,
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    store: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            metavar="STORE",
            help="The model's samples. (default: rendered anew)",
        ),
    ] = None,
    neighbors: Annotated[
        int, typer.Option("--neighbors", min=1, help="Training images to look up, if rendered.")
    ] = 2000,
    sensitivities: Annotated[
        int | None,
        typer.Option(
            "--sensitivities",
            min=0,
            help="Samples whose sensitivities are held against the renderer's own, in unlit "
            "scenes. (default: 200)",
        ),
    ] = None,
    json: options.JsonFile = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="OUT.html",
            help="Also write a page with errors by view and scalar value, and pictures.",
        ),
    ] = None,
    device: options.DeviceName = options.Device.AUTO,
    workers: options.Workers = None,
) -> None:
    """Measure a model on hold-out samples, beside the nearest training image."""
    from app.cli.outputs import check_outputs

    check_outputs(json, report)
    from app.cli.evaluate import evaluate_model
    from model.evaluation.job import EvaluationJob

    job = EvaluationJob(
        model=model,
        count=count,
        volume=VolumeSource(volume, raw, component),
        store=store,
        neighbors=neighbors,
        sensitivities=sensitivities,
        workers=workers,
        device=str(device),
        illustrated=report is not None,
    )
    evaluate_model(job, json, report)


@application.command()
def study(
    study: Annotated[options.StudyName, typer.Argument(metavar="STUDY", help="Which one.")],
    out: Annotated[
        Path,
        typer.Option("--out", metavar="DIR", help="Folder of samples, runs and table."),
    ],
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    preset: Annotated[
        options.Preset, typer.Option("--preset", help="Size of all networks.")
    ] = options.Preset.DRAFT,
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
    sensitivities: Annotated[
        int,
        typer.Option(
            "--sensitivities",
            min=0,
            help="Samples whose sensitivities are held against the renderer's own.",
        ),
    ] = 20,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change the recipe of all models."),
    ] = None,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    device: options.DeviceName = options.Device.AUTO,
    precision: options.TrainingPrecisionName = options.TrainingPrecision.AUTO,
) -> None:
    """The paper's studies anew: baselines, latent-dim or l1-weight. Run again to go on."""
    from model.training.job import TrainingJob

    job = TrainingJob(
        out=out,
        volume=VolumeSource(volume, raw, component),
        preset=str(preset),
        architecture="paper",
        settings=tuple(settings or ()),
        minutes=options.minutes_of(minutes, samples, 10.0),
        samples=samples,
        seed=seed,
        workers=workers,
        device=str(device),
        precision=str(precision),
    )
    from app.cli.study import StudyOrder, study_models

    study_models(StudyOrder(str(study), job, images, count, sensitivities))


def _refuse_others(context: typer.Context, *names: str) -> None:
    """Refuse options that would have no effect beside the first of those named, and --out."""
    given = {
        n for n in context.params if str(context.get_parameter_source(n)).endswith("COMMANDLINE")
    }
    others = sorted(given - {"out", *names})
    if others:
        flags = ", ".join(f"--{name.replace('_', '-')}" for name in others)
        raise TfscopeError(f"Beside --{names[0]} these have no effect: {flags}; leave them out.")
