"""``bench prediction``: times and errors of settings as predicted, beside those measured."""

from __future__ import annotations

from dataclasses import asdict, dataclass
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
from model.rendering.resizing import quartered, resized
from model.rendering.setting import Setting, SettingRenderer, smooth_distance
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting, Scene
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

LEAST_ERROR = 1e-4
"""Error below which a factor says nothing: a fortieth of an 8-bit step."""

USUAL_DISTANCE = 0.5
"""Sample distance of scenes, in voxels; the ray caster's images at rest have a fifth of it."""

WINDOW_PIXELS = (1 / 2, 1 / 4, 1 / 16)
"""Pixels of a window's images while something moves, as parts of those at rest."""

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


@dataclass(frozen=True)
class _Moving:
    """One scene as a window measures it: seconds and errors, at rest and of each part of pixels."""

    rest: tuple[float, float]
    moving: tuple[tuple[float, float], ...]


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
    by_others: tuple[list[float], list[float]] = [], []
    cells = []
    for path in paths or shipped_volumes():
        volume = read_volume(path)
        for lighting in lightings:
            rows, moving = _of_volume(volume, lighting, count, size, seed, vtk)
            found += rows
            if len(moving) > 1:
                for kept, more in zip(by_others, _by_others(moving), strict=True):
                    kept += more
            cells.append((volume.name, lighting, *_factors(rows)))
    cells.append(("all", "", *_factors(found)))
    if by_others[0]:
        cells.append(("all, as a window does", "", *_quantiles(*by_others)))
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
) -> tuple[list[_Compared], list[_Moving]]:
    scene, shown = Scene.of(volume, size, lighting), Raster(size, size)
    cleaning, release = cleaning_of(volume, scene.light, lighting == "path")
    settings = settings_of(lighting, vtk, cleaning is not None)
    renderer = SettingRenderer(volume, lighting, scene.light, cleaning=cleaning)
    found: list[_Compared] = []
    moving: list[_Moving] = []
    try:
        for number in range(count):
            inputs = draw_sample(scene, seed, "holdout", number)
            predictor = (
                PathPredictor(renderer, inputs, shown)
                if lighting == "path"
                else Predictor(renderer, lighting, inputs, shown)
            )
            if lighting != "path":
                moving.append(_as_in_window(renderer, lighting, inputs, shown))
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
    return found, moving


def _as_in_window(
    renderer: SettingRenderer, lighting: Lighting, inputs: SceneInputs, shown: Raster
) -> _Moving:
    """Measure what a window does: images of fewer pixels against the one at rest."""
    distance = smooth_distance(USUAL_DISTANCE, lighting)
    found = []
    for pixels in (1.0, *WINDOW_PIXELS):
        setting = Setting(sample_distance=distance, pixels=pixels)
        drawn = [renderer.draw(setting, inputs, shown) for _ in range(2)]
        found.append((drawn[0][0][..., :3], min(seconds for _image, seconds in drawn)))
    rest, rest_seconds = found[0]
    return _Moving(
        (rest_seconds, metrics.rmse(resized(quartered(rest), shown.shape), rest)),
        tuple((seconds, metrics.rmse(image, rest)) for image, seconds in found[1:]),
    )


def _by_others(scenes: list[_Moving]) -> tuple[list[float], list[float]]:
    """Predict each scene by the other ones; return factors of errors and of times."""
    errors, times = [], []
    for scene in scenes:
        others = [np.array(other.moving) / other.rest for other in scenes if other is not scene]
        expected = np.mean(others, axis=0) * scene.rest
        for (seconds, error), (right_seconds, right_error) in zip(
            expected, scene.moving, strict=True
        ):
            times.append(_factor(seconds, right_seconds))
            errors.append(_factor(max(error, LEAST_ERROR), max(right_error, LEAST_ERROR)))
    return errors, times


def _errors(compared: _Compared) -> tuple[float, float]:
    return max(compared.predicted[1], LEAST_ERROR), max(compared.measured[1], LEAST_ERROR)


def _factor(one: float, other: float) -> float:
    return max(one / other, other / one)


def _factors(rows: list[_Compared]) -> tuple[str, ...]:
    return _quantiles(
        [_factor(*_errors(row)) for row in rows],
        [_factor(row.predicted[0], row.measured[0]) for row in rows],
    )


def _quantiles(errors: list[float], times: list[float]) -> tuple[str, ...]:
    quantiles = [np.quantile(each, share) for each in (errors, times) for share in (0.5, 0.9)]
    return (str(len(errors)), *(f"{each:.2f}" for each in quantiles))
