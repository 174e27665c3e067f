"""Errors by view and by scalar value, on samples whose errors follow a known rule."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from model.evaluation.error_profile import error_profile, to_json
from model.samples.sample_store import SampleBatch
from model.scene.orientation import view_in
from model.scene.scene import Scene
from model.scene.view import ViewRange

SCENE = Scene("a", "b", (0.0, 256.0), (20.0, 200.0), 64)


def samples(views: np.ndarray, opacity: np.ndarray) -> SampleBatch:
    n = len(views)
    return SampleBatch(
        {
            "view": views,
            "opacity_tf": opacity.astype(np.float32),
            "color_tf": np.zeros((n, 256, 3), np.float32),
        },
        np.zeros((n, 4, 4, 4), np.uint8),
    )


def test_errors_go_to_the_groups_of_their_views() -> None:
    rng = np.random.default_rng(0)
    views = np.column_stack(
        [
            rng.uniform(-360, 720, 400),
            rng.uniform(-80, 80, 400),
            np.zeros(400),
            rng.uniform(0.4, 1, 400),
        ]
    )
    errors = views[:, 3].copy()  # the farther, the worse
    profile = error_profile(SCENE, samples(views, np.ones((400, 256))), errors)
    for name in ("azimuth", "elevation", "distance"):
        assert sum(group.count for group in profile[name]) == 400
    for group in profile["distance"]:
        assert group.low <= group.error <= group.high
    assert profile["elevation"][0].low == -80
    assert profile["elevation"][-1].high == 80
    json.dumps(to_json(profile), allow_nan=False)


def test_a_scalar_value_has_the_errors_of_the_tfs_that_show_it() -> None:
    views = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
    opacity = np.zeros((3, 256))
    opacity[0, :16] = 0.5
    opacity[1, :16] = 0.25
    opacity[1, 32:48] = 1.0
    profile = error_profile(SCENE, samples(views, opacity), np.array([0.1, 0.4, 9.0]))["scalar"]
    # What no TF shows has no error.
    assert [(group.low, group.high) for group in profile] == [(0, 16), (32, 48)]
    assert profile[0].error == pytest.approx((0.5 * 0.1 + 0.25 * 0.4) / 0.75)
    assert profile[1].error == pytest.approx(0.4)


def test_limits_belong_to_a_group() -> None:
    views = np.array([[0.0, -80, 0, 0.4], [360.0, 80, 0, 1.0]])
    profile = error_profile(SCENE, samples(views, np.ones((2, 256))), np.array([1.0, 2.0]))
    assert [group.count for group in profile["azimuth"]] == [2]
    assert [group.error for group in profile["elevation"]] == [1, 2]
    assert [group.error for group in profile["distance"]] == [1, 2]


def test_elevations_are_about_the_up_axis() -> None:
    scene = replace(SCENE, view_range=ViewRange(up="-x"))
    seen = [view_in("-x", 40.0, elevation) for elevation in (-75.0, 0.0, 75.0)]
    views = np.array([[v.azimuth, v.elevation, v.roll, v.distance] for v in seen])
    profile = error_profile(scene, samples(views, np.ones((3, 256))), np.array([1.0, 2.0, 3.0]))
    assert [group.error for group in profile["elevation"]] == [1, 2, 3]
    assert [group.count for group in profile["azimuth"]] == [3]
