"""Errors at the extremes, held to bounds; the reference itself, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from model.benchmarks import reference_light
from model.benchmarks.extreme_errors import CODES, PICTURES, SENSITIVITIES, Row, measure_extremes
from model.benchmarks.extremes import VIEW, extremes, field, posed, refused
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

PAGE = Path(__file__).parents[3] / "docs" / "numerics.md"

BOUNDS = {
    "unlit": 0.002,
    "pre-integrated": 0.002,
    "direct": 0.006,
    "soft": 0.005,
    "shadows": 0.025,
    "VTK unlit": 0.01,
    "VTK direct": 0.05,
    "VTK shadows": 0.05,
    "path-traced opacity": 0.002,
    "path-traced light": 0.0011,
    "plot, unlit": 0.01,
    "plot, direct": 0.03,
    "plot, soft": 0.02,
    "plot, shadows": 0.05,
    "field, unlit": 0.025,
    "field, direct": 0.025,
    "field, shadows": 0.25,
    "field, soft": 0.025,
    "without loss": 0.0,
    "1 byte a voxel": 0.003,
    "TF codec": 1e-5,
}
"""Largest error of each column."""

SINGLE_BIN = {
    "plot, unlit": 0.08,
    "field, unlit": 0.2,
    "field, direct": 0.2,
    "field, soft": 0.2,
}
"""The same for TFs of a single bin, of which pictures may be .04 off, and VTK's .15."""

KINDS = ("ordinary", "opacity", "values", "grid", "view", "raster", "part")


@pytest.fixture(scope="module", params=KINDS)
def rows(request: pytest.FixtureRequest) -> list[Row]:
    return [row for _, _, row in measure_extremes(frozenset([request.param]))]


@pytest.mark.slow
def test_errors_at_the_extremes_are_bounded_and_finite(rows: list[Row]) -> None:
    assert rows
    for row in rows:
        found = {**row.pictures, **row.sensitivities, **row.codes}
        for name, error in found.items():
            bound = BOUNDS[name]
            if " bin" in row.name:
                least = 0.15 if "VTK" in name else 0.04 if name in PICTURES else 0.0
                bound = max(bound, least, SINGLE_BIN.get(name, 0.0))
            assert not isinstance(error, str), (row.name, name, error)
            # Not finite compares as neither.
            assert error <= bound, (row.name, name, error)


def test_every_kind_and_column_is_bounded() -> None:
    assert {extreme.kind for extreme in extremes()} == set(KINDS)
    assert set(BOUNDS) == {*PICTURES, *SENSITIVITIES, *CODES}


def test_the_page_has_every_extreme_and_what_is_said_of_what_is_refused() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for extreme in extremes():
        assert f"| {extreme.name} |" in page, extreme.name
    for name, message in refused().items():
        # Not to the last digit of a number.
        assert f"| {name} | {message[:25]}" in page, name
    assert "| not finite |" not in page


def constant(opacity: float) -> OpacityTF:
    return OpacityTF((0.0, 1.0), points=((0.0, opacity),))


WHITE = ColorTF((0.0, 1.0), ((0.0, 1.0, 1.0, 1.0),))


@pytest.mark.parametrize("opacity", [1e-12, 1e-3, 0.4, 1 - 1e-7])
def test_the_reference_has_the_opacity_of_a_slab(opacity: float) -> None:
    """Along an axis a ray crosses 19 voxels: 1 - (1 - a)^19, whatever the step is."""
    inputs = SceneInputs(View(), constant(opacity), WHITE)
    for distance in (0.3, 0.5, 1.0):
        image = reference_light.picture(Volume(field()), inputs, 1, distance)
        exact = -math.expm1(19 * math.log1p(-float(np.float32(opacity))))
        assert image[0, 0, 3] == pytest.approx(exact, rel=1e-12)


def test_the_references_derivative_is_that_of_a_slab() -> None:
    """All bins together, by the opacity a: 19 (1 - a)^18."""
    inputs = SceneInputs(View(), constant(0.1), WHITE)
    volume, edit = Volume(field()), np.ones(256)
    _, change = reference_light.derivative(volume, inputs, 1, 0.5, "none", edit)
    assert change[0, 0, 3] == pytest.approx(19 * (1 - float(np.float32(0.1))) ** 18, rel=1e-9)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft", "shadows"])
def test_the_references_derivative_is_the_difference_of_its_pictures(lighting) -> None:
    scene = posed()
    edit = np.exp(-0.5 * ((np.arange(256) - 150) / 15) ** 2)
    opacity = scene.inputs.opacity_tf.sample().astype(np.float64)
    more, less = (
        reference_light.picture(
            scene.volume, scene.inputs, 12, 0.5, lighting, opacity=opacity + step * edit
        )
        for step in (1e-6, -1e-6)
    )
    _, change = reference_light.derivative(scene.volume, scene.inputs, 12, 0.5, lighting, edit)
    np.testing.assert_allclose(change, (more - less) / 2e-6, atol=1e-5 * abs(change).max())


def test_what_is_homogeneous_is_half_lit_inside_and_by_its_faces_outside() -> None:
    """A headlight on an opaque slab: the face in front has all of the diffuse light and gloss."""
    scalars = np.full((9, 9, 9), 0.5, np.float32)
    scalars[0, 0, 0], scalars[-1, -1, -1] = 0, 1
    inputs = SceneInputs(View(), constant(1.0), WHITE, LightDirection(0.0, 0.0))
    image = reference_light.picture(Volume(scalars), inputs, 1, 0.25, "direct")
    assert image[0, 0, 0] == pytest.approx(1.0)
    dim = SceneInputs(View(), constant(1.0), WHITE, LightDirection(60.0, 0.0))
    image = reference_light.picture(Volume(scalars), dim, 1, 0.25, "direct")
    assert image[0, 0, 0] == pytest.approx(0.45, abs=0.01)


@pytest.mark.parametrize("lighting", ["direct", "soft", "shadows"])
@pytest.mark.parametrize("opacity", [1e-12, 1e-7, 1e-3])
def test_a_faint_picture_is_lit_as_a_bright_one(lighting, opacity: float) -> None:
    assert PICTURES[lighting](posed(curve=((0.0, opacity),), view=VIEW)) < 0.003
