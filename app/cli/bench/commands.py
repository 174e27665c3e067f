"""The ``bench`` commands and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, cast, get_args

import typer

from app.cli import options, values
from app.cli.volume_options import takes_volume
from model.networks.names import PresetName
from model.scene.scene import Lighting
from model.scene.view import View
from model.volume_files.source import VolumeSource

bench = typer.Typer(help="Measure speed and accuracy on this machine.", no_args_is_help=True)


def _repeated(option: str, names: tuple[str, ...], help_text: str) -> Any:
    """Return an option that takes one of some names, and may be repeated."""
    parser = values.one_of(option, names)
    return typer.Option(option, help=help_text, metavar="|".join(names), parser=parser)


Lightings = Annotated[
    list[str] | None,
    _repeated("--lighting", get_args(Lighting), "May be repeated. (default: none)"),
]
SceneCount = Annotated[int, typer.Option("--count", min=1, help="Random views and TFs per volume.")]
WithVtk = Annotated[
    bool, typer.Option("--vtk/--no-vtk", help="VTK, too, where it draws that light.")
]


@bench.command()
def compact(
    volume: options.VolumeFiles = None,
    rate: Annotated[
        list[float] | None,
        typer.Option(
            "--rate",
            metavar="BYTES",
            min=0.003,
            help="Bytes a voxel; may be repeated. (default: 0.33, 1/16 and 1/64)",
        ),
    ] = None,
    images: Annotated[
        int, typer.Option("--images", min=1, help="Random views and TFs per volume.")
    ] = 48,
    rivals: Annotated[
        bool, typer.Option("--rivals/--no-rivals", help="Also ZFP and SZ3 at as many bytes.")
    ] = True,
    json: options.JsonFile = None,
) -> None:
    """Compact volumes: image error and time over size, beside other compressors."""
    from app.cli.bench.compact import bench_compact

    bench_compact(volume, rate or [0.33, 1 / 16, 1 / 64], images, rivals, json)


@bench.command()
def renderers(
    volume: options.VolumeFiles = None,
    count: Annotated[
        int, typer.Option("--count", min=1, help="Random views and TFs per volume.")
    ] = 20,
    size: options.PictureSize = 256,
    lighting: options.LightingName = "none",
    seed: options.Seed = 0,
    distance: Annotated[
        list[float] | None,
        typer.Option(
            "--distance",
            min=0.01,
            max=10,
            help="Sample distance in voxels; may be repeated. (default: 0.25 to 4)",
        ),
    ] = None,
    reference: Annotated[
        float | None,
        typer.Option(
            "--reference",
            min=0.01,
            max=10,
            help="Sample distance of VTK's images that errors are measured against. "
            "(default: 1/16, 1/4 in shadows)",
        ),
    ] = None,
    preintegrated: Annotated[
        bool,
        typer.Option("--preintegrated", help="Pre-integrate the ray caster's TFs; only unlit."),
    ] = False,
    json: options.JsonFile = None,
    plot: options.PlotFile = None,
) -> None:
    """VTK and the ray caster: images per second and errors over sample distances."""
    from app.cli.bench.renderers import bench_renderers

    bench_renderers(
        volume,
        count,
        size,
        lighting,
        seed,
        distance,
        reference,
        preintegrated,
        json,
        plot,
    )


@bench.command()
def tradeoff(
    volume: options.VolumeFiles = None,
    lighting: Lightings = None,
    count: SceneCount = 4,
    size: options.PictureSize = 256,
    view: Annotated[
        View | None,
        typer.Option(
            "--view",
            metavar="AZ,EL,ROLL,DIST[,X,Y]",
            help="In place of random views.",
            parser=values.view,
        ),
    ] = None,
    tf: Annotated[
        Path | None,
        typer.Option("--tf", metavar="TF.json", help="In place of random TFs.", callback=values.tf),
    ] = None,
    seed: options.Seed = 0,
    vtk: WithVtk = True,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            min=1,
            max=1024,
            help="Of the ray caster and the path tracer. (default: one per processor)",
        ),
    ] = None,
    json: options.JsonFile = None,
    plot: options.PlotFile = None,
) -> None:
    """Settings of a picture: time against error, and those worth having."""
    from app.cli.bench.tradeoff import bench_tradeoff

    lightings = cast("list[Lighting]", lighting or ["none"])
    bench_tradeoff(volume, lightings, count, size, view, tf, seed, vtk, threads, json, plot)


@bench.command()
def prediction(
    volume: options.VolumeFiles = None,
    lighting: Lightings = None,
    count: SceneCount = 2,
    size: Annotated[
        int, typer.Option("--size", min=64, max=4096, help="Width and height in pixels.")
    ] = 256,
    seed: options.Seed = 0,
    vtk: WithVtk = False,
    json: options.JsonFile = None,
) -> None:
    """Times and errors of settings as `render` predicts them, beside those measured."""
    from app.cli.bench.prediction import bench_prediction

    lightings = cast("list[Lighting]", lighting or ["none"])
    bench_prediction(volume, lightings, count, size, seed, vtk, json)


@bench.command()
def path(
    volume: options.VolumeFiles = None,
    size: options.PictureSize = 256,
    samples: Annotated[
        int, typer.Option("--samples", min=2, max=1 << 14, help="Most that are measured.")
    ] = 32,
    truth: Annotated[
        int, typer.Option("--truth", min=4, max=1 << 16, help="Samples to compare with.")
    ] = 512,
    frames: Annotated[
        int,
        typer.Option("--frames", min=0, max=100, help="Of a movement whose flicker is measured."),
    ] = 0,
    other_lights: Annotated[
        bool,
        typer.Option("--other-lights", help="The ray caster's lights, too, against the same."),
    ] = False,
    json: options.JsonFile = None,
) -> None:
    """Path-traced pictures over the number of samples: time, error, and the error that is told."""
    from app.cli.bench.path import bench_path

    bench_path(volume, size, samples, truth, frames, other_lights, json)


@bench.command()
def path_costs(
    volume: options.VolumeFiles = None,
    size: options.PictureSize = 1024,
    json: options.JsonFile = None,
) -> None:
    """Time of one path-traced sample over opacity, bounces and processors."""
    from app.cli.bench.path_costs import bench_path_costs

    bench_path_costs(volume, size, json)


@bench.command()
def path_sensitivity(
    volume: options.VolumeFiles = None,
    size: Annotated[
        int, typer.Option("--size", min=16, max=1024, help="Width and height in pixels.")
    ] = 64,
    truth: Annotated[
        int, typer.Option("--truth", min=4, max=1 << 14, help="Samples to compare with.")
    ] = 256,
    json: options.JsonFile = None,
) -> None:
    """Sensitivities that may stand in for path-traced light's: agreement with it, and time."""
    from app.cli.bench.path_sensitivity import bench_path_sensitivity

    bench_path_sensitivity(volume, size, truth, json)


@bench.command()
def jumps(
    volume: options.VolumeFiles = None,
    size: Annotated[
        int, typer.Option("--size", min=16, max=1024, help="Width and height in pixels.")
    ] = 128,
    steps: Annotated[
        int, typer.Option("--steps", min=4, max=10_000, help="That move a mode by one bin.")
    ] = 200,
    json: options.JsonFile = None,
) -> None:
    """Whether the ray caster's pictures change evenly while a TF is edited, in all lights."""
    from app.cli.bench.jumps import bench_jumps

    bench_jumps(volume, size, steps, json)


@bench.command()
def extremes(
    vtk: Annotated[bool, typer.Option("--vtk/--no-vtk", help="VTK, too.")] = True,
    json: options.JsonFile = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="PAGE.md", help="Write the page of the documentation."),
    ] = None,
) -> None:
    """Pictures, sensitivities and codes at the extremes: errors against 64-bit arithmetic."""
    from app.cli.bench.extremes import bench_extremes

    bench_extremes(vtk, json, out)


@bench.command()
def sensitivity(
    volume: options.VolumeFiles = None,
    size: options.PictureSize = 256,
    count: Annotated[int, typer.Option("--count", min=1, help="Random views and TFs.")] = 10,
    lighting: options.LightingName = "none",
    seed: options.Seed = 0,
    window: Annotated[
        bool, typer.Option("--window", help="Also drag and hover in the real window, off screen.")
    ] = False,
    json: options.JsonFile = None,
) -> None:
    """Sensitivities of the ray caster and the shipped models: their time in images."""
    from app.cli.bench.sensitivity import bench_sensitivity

    bench_sensitivity(volume, size, count, lighting, seed, window, json)


@bench.command()
def start(
    volume: options.VolumeFiles = None,
    model: options.ModelFolder = None,
    repeats: Annotated[
        int, typer.Option("--repeats", min=1, help="Starts of which the median is told.")
    ] = 3,
    json: options.JsonFile = None,
) -> None:
    """The window: seconds from the program's start to its first pictures, and its memory."""
    from app.cli.bench.start import bench_start

    bench_start(volume, model, repeats, json)


@bench.command()
def required(
    volume: options.VolumeFile = None,
    used: Annotated[
        bool, typer.Option("--used/--unused", help="Also the first use of each: minutes.")
    ] = True,
    json: options.JsonFile = None,
) -> None:
    """Inputs and features: their cost in a picture that does without them, and when first used."""
    from app.cli.bench.required import bench_required

    bench_required(volume, used, json)


@bench.command()
@takes_volume(placed=False)
def sizes(
    source: VolumeSource,
    edge: Annotated[
        list[int] | None,
        typer.Option(
            "--edge",
            min=8,
            max=2048,
            help="Voxels along the longest axis; may be repeated. (default: 64, 128, 256, 512)",
        ),
    ] = None,
    size: options.PictureSize = 256,
    count: Annotated[
        int, typer.Option("--count", min=1, help="Random views and TFs per size.")
    ] = 5,
    slowest: Annotated[
        float,
        typer.Option(
            "--slowest",
            min=0.01,
            help="Seconds per image from which a renderer is left out for larger volumes.",
        ),
    ] = 10.0,
    json: options.JsonFile = None,
    plot: options.PlotFile = None,
) -> None:
    """Ray caster, VTK and model: time of an image over the size of the volume, and by light."""
    from app.cli.bench.sizes import bench_sizes

    bench_sizes(
        source,
        edge or [64, 128, 256, 512],
        size,
        count,
        slowest,
        json,
        plot,
    )


@bench.command()
def generator(
    preset: Annotated[
        list[str] | None,
        _repeated(
            "--preset",
            get_args(PresetName),
            "Of untrained networks; may be repeated. (default: all)",
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option("--model", help="A trained model, instead of presets.", callback=values.model),
    ] = None,
    seconds: Annotated[
        float, typer.Option("--seconds", min=0.1, help="Least time of each measurement.")
    ] = 2.0,
    json: options.JsonFile = None,
    device: options.DeviceName = "auto",
) -> None:
    """Latency of the generator by backend and precision, and its distance from torch."""
    from app.cli.bench.generator import bench_generator

    bench_generator(preset or [], model, device, seconds, json)


@bench.command()
def training(
    preset: Annotated[
        list[str] | None,
        _repeated(
            "--preset",
            get_args(PresetName),
            "May be repeated. (default: draft and compact)",
        ),
    ] = None,
    steps: Annotated[int, typer.Option("--steps", min=1, help="That are timed each way.")] = 10,
    batch: Annotated[
        list[int] | None,
        typer.Option(
            "--batch",
            min=2,
            help="Compare batches of so many samples, alone and with rendering beside, by the "
            "fastest way; may be repeated.",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change the recipe, as in 'train'."),
    ] = None,
    json: options.JsonFile = None,
    device: options.DeviceName = "auto",
) -> None:
    """Speed of training by precision, order of channels, optimizer, compilation, batch size."""
    from app.cli.bench.training import bench_training

    bench_training(
        preset or [],
        device,
        steps,
        batch or [],
        settings or [],
        json,
    )


@bench.command()
def latent(
    volume: options.VolumeFiles = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="Draws the pictures, and the codes of its own codec if it can. (default: the "
            "volume's shipped model)",
            callback=values.model,
        ),
    ] = None,
    size: Annotated[
        int, typer.Option("--size", min=16, max=1024, help="Pixels of the ray caster's pictures.")
    ] = 128,
    view: options.ViewNumbers = values.HOME_VIEW,
    tsne: Annotated[
        bool, typer.Option("--map", help="Also time the map's computation: a minute.")
    ] = False,
    window: Annotated[
        bool, typer.Option("--window", help="Also browse in the real window, off screen.")
    ] = False,
    seed: options.Seed = 0,
    json: options.JsonFile = None,
) -> None:
    """The latent browser: grid, hovering, map and search, in images."""
    from app.cli.bench.latent import bench_latent

    bench_latent(volume, size, view, tsne, window, seed, json, model)


@bench.command()
def codecs(
    steps: Annotated[int, typer.Option("--steps", min=1, help="To train each codec for.")] = 3000,
    seed: options.Seed = 0,
    json: options.JsonFile = None,
) -> None:
    """Codecs for browsing, of several kinds and lengths: true, smooth, well spread."""
    from app.cli.bench.codecs import bench_codecs

    bench_codecs(steps, seed, json)


@bench.command()
def codec(
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="Measure this model's codec, instead of training one.",
            callback=values.model,
        ),
    ] = None,
    volume: options.VolumeFile = None,
    preset: Annotated[
        PresetName | None,
        typer.Option("--preset", help="Whose codec is trained. (default: compact)"),
    ] = None,
    steps: Annotated[
        int | None, typer.Option("--steps", min=4, help="To train for. (default: 3000)")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change the recipe, as for 'train'."),
    ] = None,
    seed: options.Seed = 0,
    json: options.JsonFile = None,
) -> None:
    """Errors of a latent codec: of decoded TFs, and of its response to edits; without images."""
    values.source(volume)
    from app.cli.bench.codec import measure_model, train_alone

    trial = {"--volume": volume, "--preset": preset, "--steps": steps, "--set": settings}
    if model is not None:
        measure_model(model, [name for name, value in trial.items() if value], json)
    else:
        train_alone(volume, preset or "compact", steps or 3000, tuple(settings or ()), seed, json)
