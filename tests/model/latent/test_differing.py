from dataclasses import replace
from itertools import combinations

import numpy as np

from model.latent import differing
from model.latent.differing import chosen_by, most_different
from model.latent.tiny_pictures import Overview


def shown(pictures):
    count = len(pictures)
    none, zeros = np.zeros(count, bool), np.zeros((count, 256), np.float32)
    return Overview(zeros[:, 0], none, none, none, zeros, zeros[:, 0].astype(int), pictures)


def test_the_most_different_are_one_of_each_kind():
    """Of 16 kinds of pictures, of which there are few or many, one of each is chosen."""
    rng = np.random.default_rng(0)
    kinds = np.repeat(rng.integers(20, 230, (16, 64, 3)), np.arange(1, 17) ** 2, axis=0)
    pictures = (kinds + rng.integers(-8, 9, kinds.shape)).astype(np.uint8)
    kind = np.repeat(np.arange(16), np.arange(1, 17) ** 2)
    overview, count = shown(pictures), len(pictures)
    none = np.zeros(count, bool)
    chosen = most_different(overview, ~none)
    assert sorted(kind[chosen]) == list(range(16))
    # What is empty, faint or solid is left out while others suffice.
    out = np.isin(np.arange(count), chosen)
    for flag in ("is_empty", "is_faint", "is_solid"):
        rest = most_different(replace(overview, **{flag: out}), ~none)
        # They are alike: there are more, for larger pictures to choose from.
        assert len(rest) == differing.CANDIDATES and not set(rest) & set(chosen)
    wanted = none.copy()
    wanted[[3, 50, 90]] = True
    assert sorted(most_different(overview, wanted)) == [3, 50, 90]
    assert len(most_different(overview, none)) == 0
    # Of pictures that are alike, there is one.
    for few in (1, 2):
        alike = np.repeat(pictures[:few], 50, axis=0)
        assert len(most_different(shown(alike), np.ones(len(alike), bool))) == few


def test_no_exchange_makes_the_most_different_differ_more():
    """Of 30 plain colours, by the sum of differences; those of near pairs count more."""
    colors = np.random.default_rng(0).random((30, 3), np.float32)
    colors[:, 0] = 0.8  # the brightest, which needs no exposure
    chosen = set(chosen_by(np.ones((30, 2, 2, 1)) * colors[:, None, None], 1, np.arange(30)))
    apart = np.linalg.norm(colors[:, None] - colors, axis=2)

    def total(kinds):
        pairs = np.array([apart[pair] for pair in combinations(sorted(kinds), 2)])
        nearer = np.minimum(pairs / 3**0.5 / differing.DIFFERENT, 1)
        return np.sum(pairs**0.5 + differing.NEARNESS * np.log(nearer))

    best = max(total(chosen - {old} | {new}) for old in chosen for new in {*range(30)} - chosen)
    assert len(chosen) == 16 and total(chosen) >= best - 1e-3
