"""``bench prediction``: times and errors of settings as predicted, beside those measured."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from app.cli.bench.machine import print_machine
from app.cli.console import console, counting, print_table
from app.cli.outputs import write_json
from model import metrics
from model.evaluation.path_prediction import PathPredictor
from model.evaluation.prediction import Predictor
from model.evaluation.tradeoff import settings_of
from model.generator.path_light_generator import cleaning_of
from model.rendering.raster import Raster
from model.rendering.setting import Setting, SettingRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Lighting, Scene
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

LEAST_ERROR = 1e-4
"""Error below which a factor says nothing: a fortieth of an 8-bit step."""

LONG_S = 1.0
"""Time of a picture below which it is drawn twice; the faster one counts, as in predictions."""


@dataclass(frozen=True)
class _Compared:
    """One picture: seconds and RMSE, predicted and measured."""

    volume: str
    lighting: Lighting
    scene: int
    setting: Setting
    predicted: tuple[float, float]
    measured: tuple[float, float]


def bench_prediction(
    paths: list[Path] | None,
    lightings: list[Lighting],
    count: int,
    size: int,
    seed: int,
    vtk: bool,
    json_path: Path | None,
) -> None:
    """Compare each setting of random scenes; print a table, write JSON if requested."""
    machine = print_machine()
    found: list[_Compared] = []
    by_others: list[_Compared] = []
    cells = []
    for path in paths or shipped_volumes():
        volume = read_volume(path)
        for lighting in lightings:
            rows = _of_volume(volume, lighting, count, size, seed, vtk)
            found += rows
            by_others += _by_others(rows)
            cells.append((volume.name, lighting, *_factors(rows)))
    cells.append(("all", "", *_factors(found)))
    if by_others:
        cells.append(("all, by other scenes", "", *_factors(by_others)))
    print_table(
        f"factors between what was predicted and what was measured, {size} x {size}: median, and "
        "the largest of nine in ten",
        ("volume", "light", "pictures", "error", "nine in ten", "time", "nine in ten"),
        cells,
        left=2,
    )
    if json_path is not None:
        plain = [asdict(each) for each in found]
        write_json(json_path, {"machine": machine, "size": size, "pictures": plain})


def _of_volume(
    volume: Volume, lighting: Lighting, count: int, size: int, seed: int, vtk: bool
) -> list[_Compared]:
    scene, shown = Scene.of(volume, size, lighting), Raster(size, size)
    cleaning, release = cleaning_of(volume, scene.light, lighting == "path")
    settings = settings_of(lighting, vtk, cleaning is not None)
    renderer = SettingRenderer(volume, lighting, scene.light, cleaning=cleaning)
    found = []
    try:
        for number in range(count):
            inputs = draw_sample(scene, seed, "holdout", number)
            predictor = (
                PathPredictor(renderer, inputs, shown)
                if lighting == "path"
                else Predictor(renderer, lighting, inputs, shown)
            )
            truth, _seconds = renderer.draw(Setting.exact(lighting), inputs, shown)
            with counting(f"{volume.name}, {lighting}", len(settings)) as (progress, task):
                for setting in settings:
                    expected = predictor.predict(setting)
                    images = [renderer.draw(setting, inputs, shown)]
                    if images[0][1] < LONG_S:
                        images.append(renderer.draw(setting, inputs, shown))
                    error = metrics.rmse(images[0][0][..., :3], truth[..., :3])
                    seconds = min(each for _rgba, each in images)
                    found.append(
                        _Compared(
                            volume.name,
                            lighting,
                            number,
                            setting,
                            (expected.seconds, expected.rmse),
                            (seconds, error),
                        )
                    )
                    progress.advance(task)
    finally:
        renderer.close()
        release()
    worst = max(found, key=lambda each: _factor(*_errors(each)))
    predicted, measured = _errors(worst)
    console.print(
        f"{volume.name}, {lighting}: farthest off at {worst.setting.text(lighting)}, "
        f"error {predicted:.4f} predicted and {measured:.4f} measured"
    )
    return found


def _by_others(rows: list[_Compared]) -> list[_Compared]:
    """Predict each picture by the mean of the same setting's in the other scenes of its volume."""
    found = []
    for row in rows:
        others = [r.measured for r in rows if r.setting == row.setting and r.scene != row.scene]
        if others:
            seconds, rmse = np.mean(others, axis=0)
            found.append(replace(row, predicted=(float(seconds), float(rmse))))
    return found


def _errors(compared: _Compared) -> tuple[float, float]:
    return max(compared.predicted[1], LEAST_ERROR), max(compared.measured[1], LEAST_ERROR)


def _factor(one: float, other: float) -> float:
    return max(one / other, other / one)


def _factors(rows: list[_Compared]) -> tuple[str, ...]:
    errors = [_factor(*_errors(row)) for row in rows]
    times = [_factor(row.predicted[0], row.measured[0]) for row in rows]
    quantiles = [np.quantile(each, share) for each in (errors, times) for share in (0.5, 0.9)]
    return (str(len(rows)), *(f"{each:.2f}" for each in quantiles))
