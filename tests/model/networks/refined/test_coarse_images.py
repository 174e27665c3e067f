"""Images of a coarse volume against a second ray caster in float64, and their derivatives."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from reference_raycaster import cast
from scipy.ndimage import gaussian_filter

from model.networks.refined.coarse_images import STEP, CoarseImages, CoarseRenderer, Shot
from model.networks.refined.coarse_kernels import ENTRIES, LEVELS, SUBLEVELS
from model.networks.refined.coarse_volume import SPREADS, CoarseVolume
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.view import View
from model.scene.volume import Volume

SIZE = 24
VIEWS = (View(30, 20, 5, 0.9), View(0, 0, 0, 1), View(200, -60, -4, 0.3))
LIGHT = LightDirection(30, 50)


def coarse_volume() -> CoarseVolume:
    """Smooth means from 0 to 255, and spreads of all levels."""
    rng = np.random.default_rng(3)
    means = gaussian_filter(rng.normal(size=(14, 17, 12)), 2)
    means = (means - means.min()) / (means.max() - means.min())
    spreads = gaussian_filter(rng.normal(size=means.shape), 2)
    spreads = (spreads - spreads.min()) / (spreads.max() - spreads.min())
    return CoarseVolume.over(
        (24, 34, 28),
        (0.5, 0.7, 0.51),
        np.rint(255 * means).astype(np.uint8),
        np.rint((SPREADS - 1) * spreads).astype(np.uint8),
    )


def table_of(seed: int, highest: float) -> NDArray[np.float32]:
    """Random entries that change smoothly, premultiplied, with opacities up to a highest."""
    rng = np.random.default_rng(seed)
    alpha = gaussian_filter(rng.uniform(size=(SPREADS, LEVELS)), (3, 40)).reshape(-1)
    alpha = ((alpha - alpha.min()) / (alpha.max() - alpha.min())) ** 2 * highest
    table = np.zeros((ENTRIES + 1, 4), dtype=np.float32)
    table[:ENTRIES, 3] = alpha
    table[:ENTRIES, :3] = alpha[:, None] * rng.uniform(0.2, 1, 3)
    return table


class Samples(NamedTuple):
    """Entry of each sample, the transparent one behind the exit, and its share of a step.

    Both have the shape (SIZE, SIZE, samples).
    """

    entries: NDArray[np.int64]
    shares: NDArray[np.float64]


def samples_of(coarse: CoarseVolume, view: View) -> Samples:
    rays = cast(Volume(coarse.means, coarse.spacing), view, SIZE, STEP)
    means = rays.bins
    # Squared levels, over the same range as the means.
    squares = coarse.spreads.astype(float) ** 2
    squares.flat[:2] = (squares.min(), squares.max())
    lo, hi = squares.min(), squares.max()
    spreads = cast(Volume(squares, coarse.spacing), view, SIZE, STEP).bins / 255 * (hi - lo) + lo
    there = np.isfinite(means)
    levels = np.floor(np.where(there, means, 0) * SUBLEVELS + 0.5).astype(int)
    deviations = np.floor(np.sqrt(np.where(there, spreads, 0)) + 0.5).astype(int)
    return Samples(np.where(there, deviations * LEVELS + levels, ENTRIES), rays.shares)


def composited(samples: Samples, table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pixels (..., 4) by the emission-absorption sum."""
    rows = samples.shares[..., None] * table[samples.entries]
    clear = np.cumprod(1 - rows[..., 3], axis=-1)
    before = np.concatenate([np.ones_like(clear[..., :1]), clear[..., :-1]], axis=-1)
    return (before[..., None] * rows).sum(axis=-2)


def shot(view: View) -> Shot:
    return Shot(view, LIGHT, np.full(256, 0.05, np.float32))


def draw(renderer: CoarseRenderer, table: NDArray[np.float32], view: View) -> NDArray[np.float32]:
    return renderer.draw(table[None], [shot(view)], SIZE)[0].transpose(1, 2, 0)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("highest", [0.02, 0.4, 1.0])
def test_images_are_those_of_the_sum(view: View, highest: float) -> None:
    coarse, table = coarse_volume(), table_of(0, highest)
    expected = composited(samples_of(coarse, view), table.astype(np.float64))
    found = draw(CoarseRenderer(coarse), table, view)
    # Rounding puts a few samples into the next entry.
    assert np.quantile(abs(found - expected), 0.99) < 0.002
    assert abs(found - expected).max() < 0.1 * highest
    assert expected[..., 3].max() > min(0.1, highest)


def test_nothing_that_shows_is_skipped() -> None:
    coarse = coarse_volume()
    table = np.zeros((ENTRIES + 1, 4), dtype=np.float32)
    # A thin shell of one range of means and spreads.
    for spread in range(4, 7):
        table[spread * LEVELS + 100 * SUBLEVELS : spread * LEVELS + 112 * SUBLEVELS] = 0.3
    for view in VIEWS:
        expected = composited(samples_of(coarse, view), table.astype(np.float64))
        found = draw(CoarseRenderer(coarse), table, view)
        assert np.sqrt(np.mean((found - expected) ** 2)) < 0.02
    assert expected.any()


@pytest.mark.parametrize("lighting", ["none", "direct", "global"])
def test_a_pull_back_is_the_adjoint_of_a_push_forward(lighting: Lighting) -> None:
    renderer = CoarseRenderer(coarse_volume(), lighting)
    rng = np.random.default_rng(1)
    tables = np.stack([table_of(seed, highest) for seed, highest in ((1, 0.1), (2, 1.0))])
    shots = [shot(view) for view in VIEWS[:2]]
    changes = rng.normal(size=tables.shape).astype(np.float32)
    gradients = rng.normal(size=(2, renderer.channels, SIZE, SIZE)).astype(np.float32)
    pushed = renderer.push_forward(tables, changes, shots, SIZE)
    pulled = renderer.pull_back(tables, shots, gradients)
    for n in range(2):
        one = float((pushed[n].astype(float) * gradients[n]).sum())
        other = float((changes[n].astype(float) * pulled[n]).sum())
        assert one == pytest.approx(other, rel=1e-4, abs=1e-5 * float(np.abs(pushed[n]).sum()))


@pytest.mark.parametrize("highest", [0.02, 1.0])
def test_the_unlit_derivative_against_differences_in_float64(highest: float) -> None:
    coarse, table = coarse_volume(), table_of(4, highest)
    samples = samples_of(coarse, VIEWS[0])
    rng = np.random.default_rng(0)
    change = gaussian_filter(rng.normal(size=(SPREADS, LEVELS, 4)), (3, 40, 0)).reshape(-1, 4)
    change = np.concatenate([change / abs(change).max(), np.zeros((1, 4))])
    h = 1e-6
    plus, minus = (composited(samples, table + sign * h * change) for sign in (1, -1))
    expected = (plus - minus) / (2 * h)
    pushed = CoarseRenderer(coarse).push_forward(
        table[None], change[None].astype(np.float32), [shot(VIEWS[0])], SIZE
    )
    found = pushed[0].transpose(1, 2, 0)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.01 * np.sqrt(np.mean(expected**2))


@pytest.mark.parametrize("lighting", ["direct", "global"])
def test_the_lit_derivative_against_differences_of_images(lighting: Lighting) -> None:
    renderer = CoarseRenderer(coarse_volume(), lighting)
    table = table_of(5, 0.1)
    change = table_of(6, 0.1)
    found = renderer.push_forward(table[None], change[None], [shot(VIEWS[0])], SIZE)[0]
    h = 0.05
    plus, minus = (
        draw(renderer, (table + sign * h * change).astype(np.float32), VIEWS[0]).transpose(2, 0, 1)
        for sign in (1, -1)
    )
    expected = (plus - minus) / (2 * h)
    # When drawn, faint samples share shading, and on so few nodes that shows.
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.1 * np.sqrt(np.mean(expected**2))
    assert abs(found[4:7]).max() > 0.05


def test_light_leaves_the_unlit_image_and_the_opacity_alone() -> None:
    coarse, table = coarse_volume(), table_of(7, 0.3)
    unlit = draw(CoarseRenderer(coarse), table, VIEWS[0])
    for lighting in ("direct", "global"):
        both = draw(CoarseRenderer(coarse, lighting), table, VIEWS[0])
        np.testing.assert_array_equal(both[..., :4], unlit)
        np.testing.assert_array_equal(both[..., 7], unlit[..., 3])
        assert abs(both[..., 4:7] - unlit[..., :3]).max() > 0.1


def test_autograd_goes_both_ways_through_it() -> None:
    renderer = CoarseRenderer(coarse_volume())
    table = torch.from_numpy(table_of(8, 0.3))[None].requires_grad_()
    change = torch.from_numpy(table_of(9, 0.3))[None]
    shots = [shot(VIEWS[0])]

    def draw_tables(tables: torch.Tensor) -> torch.Tensor:
        images: torch.Tensor = CoarseImages.apply(tables, renderer, shots, SIZE)
        return images

    weights = torch.rand(1, 4, SIZE, SIZE)
    (gradient,) = torch.autograd.grad((draw_tables(table) * weights).sum(), table)
    with torch.autograd.forward_ad.dual_level(), torch.no_grad():
        dual = torch.autograd.forward_ad.make_dual(table.detach(), change)
        tangent = torch.autograd.forward_ad.unpack_dual(draw_tables(dual)).tangent
    assert float((gradient * change).sum()) == pytest.approx(
        float((tangent * weights).sum()), rel=1e-4
    )


def test_an_opaque_and_an_empty_table_have_finite_derivatives() -> None:
    renderer = CoarseRenderer(coarse_volume())
    for level in (0.0, 1.0):
        table = np.full((1, ENTRIES + 1, 4), level, dtype=np.float32)
        table[:, ENTRIES] = 0
        gradients = np.ones((1, 4, SIZE, SIZE), dtype=np.float32)
        pulled = renderer.pull_back(table, [shot(VIEWS[0])], gradients)
        assert np.isfinite(pulled).all()
        assert pulled[0, :ENTRIES, 0].sum() > 0


def test_it_can_be_repeated_bit_for_bit() -> None:
    renderer, table = CoarseRenderer(coarse_volume()), table_of(10, 0.3)
    images = [draw(renderer, table, VIEWS[0]) for _ in range(3)]
    for one, other in pairwise(images):
        np.testing.assert_array_equal(one, other)
