"""The TFs whose tiny pictures differ most."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from model.rendering.brightness import brighten

if TYPE_CHECKING:
    # Late, as it compiles kernels.
    from model.latent.tiny_pictures import Overview

DIFFERING = 16  # number of TFs that differ most
TYPICAL = 1000  # number of random TFs; rarer kinds are shown only where these are alike
CANDIDATES = 32  # number of TFs, each far from the others, that the 16 are chosen from

DIFFERENT = 0.06
"""Root mean square difference, in [0, 1], of two coarse pictures that look different."""

NEARNESS = 10  # weight of the logarithm by which pairs are nearer; other differences are below 1


def most_different(overview: Overview, wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the numbers of the wanted TFs (n,) that show the most different things.

    Empty ones are left out, and faint ones and solid blocks where others suffice. They are
    :data:`DIFFERING` or fewer, row by row of a square on which like pictures are near. If some look
    alike, they are up to :data:`CANDIDATES`, for :func:`chosen_by`.
    """
    found = np.flatnonzero(wanted & overview.shows_something & ~overview.is_faint)
    if len(found) < DIFFERING:
        found = np.flatnonzero(wanted & ~overview.is_empty)
    if len(found) <= DIFFERING:
        return found
    # The map's TFs are random, in no order.
    for some in (found[:TYPICAL], found):
        pictures = _coarse(overview.pictures[some])
        far = _far_apart(pictures.reshape(len(some), -1))
        if len(far) > DIFFERING:
            chosen, all_differ = _spread(pictures[far])
            if all_differ:
                return some[far[chosen]]
    return some[far]


def chosen_by(
    images: NDArray[np.float32], usual: float, numbers: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Choose 16 of some numbers (n,) by images (n, S, S, 4), given their usual brightness."""
    from model.latent.tiny_pictures import exposures

    pictures = images[..., :3].reshape(len(images), -1, 3).copy()
    for picture, factor in zip(pictures, exposures(pictures, usual), strict=True):
        brighten(picture, float(factor))
    return numbers[_spread(pictures)[0]]


def _coarse(pictures: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Means of 2 x 2 pixels of square pictures (n, pixels, 3): less noise, and faster."""
    half = int(np.sqrt(pictures.shape[1])) // 2
    squares = pictures.reshape(-1, half, 2, half, 2, 3)
    coarse = squares[:, :, 0, :, 0].astype(np.float32)
    for y, x in ((0, 1), (1, 0), (1, 1)):
        coarse += squares[:, :, y, :, x]
    coarse /= 4 * 255
    return coarse.reshape(len(pictures), half**2, 3)


def _far_apart(places: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the place nearest to the mean, and others, each the farthest from all before."""
    squares = np.square(places).sum(axis=1)
    chosen = [(squares - 2 * places @ places.mean(axis=0)).argmin()]
    apart = np.full(len(places), np.inf, np.float32)
    while True:
        last = chosen[-1]
        apart = np.minimum(apart, squares + squares[last] - 2 * places @ places[last])
        # Pictures that differ by less than one of 255 levels are the same.
        if len(chosen) == CANDIDATES or apart.max() < places.shape[1] / 255**2:
            return np.array(chosen)
        chosen.append(apart.argmax())


def _spread(pictures: NDArray[np.float32]) -> tuple[NDArray[np.int64], bool]:
    """Choose 16 pictures (n, pixels, 3) of which all pairs look different, as much as can be.

    The first 16 are exchanged for others while the sum of differences grows. Of the difference of
    two pixels the square root counts: to the eye, few that differ much are less than many that
    differ. Returns them row by row of a square, and whether all pairs look different.
    """
    apart = np.array([np.linalg.norm(pictures - each, axis=2) for each in pictures])
    apart[np.diag_indices(len(apart))] = 1
    shares = np.sqrt(np.square(apart).mean(axis=2) / 3) / DIFFERENT
    near = np.log(np.clip(shares, 1e-3, 1))  # the same pictures differ by 0
    values = np.sqrt(apart).mean(axis=2) + NEARNESS * near
    np.fill_diagonal(values, 0)
    now = np.arange(DIFFERING)
    while True:
        sums = values[:, now].sum(axis=1)
        gains = sums[:, None] - values[:, now] - sums[now]
        gains[now] = 0
        new, old = np.unravel_index(gains.argmax(), gains.shape)
        if gains[new, old] <= 1e-4:
            break
        now[old] = new
    return now[_on_a_square(pictures[now])], not near[np.ix_(now, now)].any()


def _on_a_square(pictures: NDArray[np.float32]) -> NDArray[np.int64]:
    """Order 16 pictures row by row: columns by their first principal component, then up."""
    rows = pictures.reshape(DIFFERING, -1)
    first, second = np.linalg.svd(rows - rows.mean(axis=0), full_matrices=False)[0].T[:2]
    columns = first.argsort(kind="stable").reshape(4, 4)
    return np.array([column[second[column].argsort()] for column in columns]).T.ravel()
