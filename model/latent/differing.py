"""The TFs whose tiny pictures differ most."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    # Late, as it compiles kernels.
    from model.latent.tiny_pictures import Overview

DIFFERING = 16  # number of TFs that differ most

COMPONENTS, CLUSTERS = 20, 40
"""Principal components by which pictures are compared, and number of groups (k-means)."""

SETTLED = 1.0
"""Change of the pictures' mean distance from their groups' centers that ends the search."""

LEAST_GROUP = 0.006  # least share of the pictures in a group; smaller groups are left out

NEARNESS = 1.5
"""Power of squared distances by which pictures repel each other: near pairs count far more."""

DIFFERENT = 0.065
"""Root mean square difference of two tiny pictures whose larger ones look different."""

_SAMPLED = 300
"""Pictures that span the components: on a busy machine, twice as many take ten times as long."""

_PART = 500  # pictures whose components are computed at a time


def most_different(overview: Overview, wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the numbers of the wanted TFs (n,) that show the most different things.

    Empty ones are left out, and faint ones and solid blocks where others suffice. They are
    :data:`DIFFERING` or fewer, row by row of a square on which like pictures are near.
    """
    found = np.flatnonzero(wanted & overview.shows_something & ~overview.is_faint)
    if len(found) < DIFFERING:
        found = np.flatnonzero(wanted & ~overview.is_empty)
    if len(found) <= DIFFERING:
        return found
    places = _principal_components(overview.pictures[found].reshape(len(found), -1))
    typical = _medoids(places)
    least = (255 * DIFFERENT) ** 2 * overview.pictures[0].size
    chosen = _far_apart(places, typical[:1], typical, least)
    # If too few typical ones differ, rare ones are added; if all are alike, one more than once.
    chosen = np.unique(_far_apart(places, chosen, np.arange(len(places)), 0))
    # The farthest ones alone are not far from the next ones.
    chosen = _spread(places, chosen, typical)
    return found[chosen[_on_a_square(places[chosen])]]


def _principal_components(pictures: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Places (n, 20) of pictures (n, numbers) along the axes on which they differ most."""
    from scipy.sparse.linalg import eigsh

    known = pictures[:: max(len(pictures) // _SAMPLED, 1)].astype(np.float32)
    known -= known.mean(axis=0)
    # By their products, of which there are fewer than of all pixels.
    count, begin = min(COMPONENTS, len(known) - 1), np.random.default_rng(0).random(len(known))
    # A little more, as it fails without any differences.
    products = known @ known.T + np.eye(len(known), dtype=np.float32)
    lengths, turns = eigsh(products, count, v0=begin.astype(np.float32))
    axes = (known.T @ (turns / np.sqrt(np.maximum(lengths, 1e-3))))[:, ::-1]
    parts = np.array_split(pictures, len(pictures) // _PART + 1)
    return np.concatenate([part.astype(np.float32) @ axes for part in parts])


def _medoids(places: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the most typical members of groups of near places (k-means), largest groups first.

    Small groups are left out.
    """
    from scipy.cluster.vq import kmeans, vq

    first = places[np.random.default_rng(0).permutation(len(places))[:CLUSTERS]]
    centers, _error = kmeans(places, first, thresh=SETTLED)
    group, distances = vq(places, centers)
    sizes = np.bincount(group, minlength=len(centers))
    large = max((sizes >= LEAST_GROUP * len(places)).sum(), DIFFERING)
    members = [np.flatnonzero(group == number) for number in np.argsort(-sizes)[:large]]
    return np.array([m[distances[m].argmin()] for m in members if len(m)])


def _distances(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared distances (n, m) of places (n, d) and (m, d)."""
    return (a * a).sum(axis=1)[:, None] + (b * b).sum(axis=1) - 2 * a @ b.T


def _far_apart(
    places: NDArray[np.float32], first: NDArray[np.int64], among: NDArray[np.int64], least: float
) -> NDArray[np.int64]:
    """Add other places that are farthest from all, and so far at least, to :data:`DIFFERING`."""
    chosen = first
    while len(chosen) < DIFFERING:
        apart = _distances(places[among], places[chosen]).min(axis=1)
        if apart.max() < least:
            break
        chosen = np.append(chosen, among[apart.argmax()])
    return chosen


def _spread(
    places: NDArray[np.float32], chosen: NDArray[np.int64], among: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Exchange chosen places, one by one, for others at which all repel each other less."""
    known, now = np.append(chosen, among), np.arange(len(chosen))
    apart = np.maximum(_distances(places[known], places[known]), 1).astype(np.float64)
    forces = apart**-NEARNESS
    np.fill_diagonal(forces, 0)
    while True:
        sums = forces[:, now].sum(axis=1)
        gains = sums[now] - sums[:, None] + forces[:, now]
        gains[now] = 0
        new, old = np.unravel_index(gains.argmax(), gains.shape)
        if gains[new, old] <= 1e-6 * sums[now].sum():
            return known[now]
        now[old] = new


def _on_a_square(places: NDArray[np.float32]) -> NDArray[np.int64]:
    """Order places on a square, row by row from the top: columns by the first axis, then up."""
    side = int(np.sqrt(DIFFERING))
    columns = np.array_split(np.argsort(places[:, 0], kind="stable"), side)
    lines = [column[np.argsort(-places[column, 1], kind="stable")] for column in columns]
    longest = max(map(len, lines))
    return np.array([line[row] for row in range(longest) for line in lines if row < len(line)])
