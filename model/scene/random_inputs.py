"""Random views, drawn as in the paper (section 4.3.1), and light directions.

Every draw takes an explicit :class:`numpy.random.Generator` and is a function
of its arguments only.
"""

from __future__ import annotations

import numpy as np

from model.scene.axes import upright_frame
from model.scene.light import LightDirection, LightRange
from model.scene.view import View, ViewRange


def draw_view(rng: np.random.Generator, view_range: ViewRange) -> View:
    """Draw a view uniformly over the range; azimuths cover the whole circle."""
    view = View(
        azimuth=rng.uniform(0.0, 360.0),
        elevation=rng.uniform(-view_range.max_elevation, view_range.max_elevation),
        roll=rng.uniform(-view_range.max_roll, view_range.max_roll),
        distance=rng.uniform(view_range.nearest, view_range.farthest),
    )
    return view.in_frame(upright_frame(view_range.up).T)


def draw_light(rng: np.random.Generator, light_range: LightRange) -> LightDirection:
    """Draw a light direction with both angles uniform over the range."""
    return LightDirection(
        azimuth=rng.uniform(-light_range.max_azimuth, light_range.max_azimuth),
        elevation=rng.uniform(-light_range.max_elevation, light_range.max_elevation),
    )
