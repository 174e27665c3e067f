"""Time against error of settings."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.evaluation.tradeoff import Measured, measure_tradeoff, pareto_front, settings_of
from model.rendering.setting import Setting
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.volume import Volume

NUMBERS = st.sampled_from([0.001, 0.002, 0.01, 0.3])


@given(st.lists(st.tuples(NUMBERS, NUMBERS), max_size=8))
def test_the_front_is_what_no_other_point_beats(numbers: list[tuple[float, float]]) -> None:
    points = [
        Measured(Setting(samples=number), seconds, error, 0.0, error, 0.0)
        for number, (seconds, error) in enumerate(numbers)
    ]
    front = {(p.seconds, p.rmse) for p in pareto_front(points)}
    unbeaten = {
        (a.seconds, a.rmse)
        for a in points
        if not any(
            b.seconds <= a.seconds
            and b.rmse <= a.rmse
            and (b.seconds, b.rmse) != (a.seconds, a.rmse)
            for b in points
        )
    }
    assert front == unbeaten


def test_errors_fall_with_what_is_spent_and_the_exact_setting_has_none(
    volume: Volume, scene: Scene
) -> None:
    scenes = [draw_sample(scene, 0, "holdout", number) for number in range(2)]
    exact = Setting.exact("none")
    settings = [Setting(sample_distance=4), Setting(), Setting(pixels=1 / 4), exact]
    result = measure_tradeoff(volume, "none", None, scenes, 32, settings)
    by = {point.setting: point for point in result.points}
    far, usual, few, best = (by[setting] for setting in settings)
    assert best.rmse == best.flip == best.largest == 0 and exact in result.front
    assert far.rmse > usual.rmse > 0 and few.rmse > usual.rmse and far.flip > usual.flip
    assert all(point.rmse <= point.largest <= 1 and point.seconds > 0 for point in result.points)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft", "path"])
def test_no_setting_is_the_exact_one_itself(lighting: str) -> None:
    settings = settings_of(lighting)  # type: ignore[arg-type]
    assert len(set(settings)) == len(settings) > 3
    assert Setting.exact(lighting) not in settings  # type: ignore[arg-type]


def test_nothing_slower_than_the_exact_picture_is_worth_it(volume: Volume) -> None:
    scene = Scene.of(volume, 32)
    inputs = [draw_sample(scene, 0, "holdout", 0)]
    slow = Setting(sample_distance=0.012)
    result = measure_tradeoff(volume, "none", None, inputs, 32, [slow])
    (point,) = result.points
    assert (slow in result.front) == (point.seconds < result.exact_seconds)
