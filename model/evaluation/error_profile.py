"""Errors of a model by view and by scalar value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.samples.sample_store import SampleBatch
from model.scene.axes import upright_frame
from model.scene.scene import Scene
from model.scene.view import View

AZIMUTHS, ELEVATIONS, DISTANCES, SCALARS = 8, 5, 4, 16
"""Number of groups of equal width."""


@dataclass(frozen=True)
class Group:
    """Samples in one interval of azimuth, elevation, distance or scalar value.

    Attributes
    ----------
    low, high : float
        Limits of the interval, in degrees, units of distance or scalar values.
    count : float
        Number of samples; for scalar values, the sum of their mean opacities there.
    error : float
        Mean error; for scalar values, weighted by the samples' opacities there.
    """

    low: float
    high: float
    count: float
    error: float

    def to_json(self) -> dict[str, float]:
        """Return the group as plain data."""
        return dict(vars(self))


def error_profile(
    scene: Scene, samples: SampleBatch, errors: NDArray[np.float64]
) -> dict[str, list[Group]]:
    """Group errors by azimuth and elevation about the up axis, distance and scalar value.

    Parameters
    ----------
    errors : ndarray of float64, shape (N,)
        Error of each sample.

    Returns
    -------
    dict of list of Group
        "azimuth", "elevation", "distance" and "scalar", without empty groups.
    """
    view_range, frame = scene.view_range, upright_frame(scene.view_range.up)
    views = [View(*map(float, row)).in_frame(frame) for row in samples.inputs["view"]]
    view = np.array([[v.azimuth, v.elevation, v.distance] for v in views])
    limits = {
        "azimuth": (view[:, 0] % 360, 0.0, 360.0, AZIMUTHS),
        "elevation": (
            view[:, 1],
            -view_range.max_elevation,
            view_range.max_elevation,
            ELEVATIONS,
        ),
        "distance": (view[:, 2], view_range.nearest, view_range.farthest, DISTANCES),
    }
    profile = {
        name: _by_value(values, lo, hi, groups, errors)
        for name, (values, lo, hi, groups) in limits.items()
    }
    profile["scalar"] = _by_scalar(scene, samples.inputs["opacity_tf"], errors)
    return profile


def _by_value(
    values: NDArray[np.float64], lo: float, hi: float, groups: int, errors: NDArray[np.float64]
) -> list[Group]:
    edges = np.linspace(lo, hi, groups + 1)
    member = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, groups - 1)
    return [
        Group(float(edges[g]), float(edges[g + 1]), float(here.sum()), float(errors[here].mean()))
        for g in range(groups)
        if (here := member == g).any()
    ]


def _by_scalar(
    scene: Scene, opacity_tf: NDArray[np.float32], errors: NDArray[np.float64]
) -> list[Group]:
    lo, hi = scene.scalar_range
    edges = np.linspace(lo, hi, SCALARS + 1)
    shown = opacity_tf.reshape(len(errors), SCALARS, -1).mean(axis=2, dtype=np.float64)
    return [
        Group(
            float(edges[g]),
            float(edges[g + 1]),
            float(weight.sum()),
            float(weight @ errors / weight.sum()),
        )
        for g in range(SCALARS)
        if (weight := shown[:, g]).sum() > 1e-6
    ]


def to_json(profile: dict[str, list[Group]]) -> dict[str, Any]:
    """Return a profile as plain data."""
    return {name: [group.to_json() for group in groups] for name, groups in profile.items()}
