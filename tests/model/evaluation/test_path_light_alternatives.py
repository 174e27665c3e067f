"""What could be shown in place of finished pictures, on pairs whose errors are known."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from model.evaluation.path_light_alternatives import path_light_alternatives
from model.networks.path_light_network import PathLightNetwork, PathLightSize
from model.samples.path_light_pairs import FEW, Pairs

NOISE = 0.02


def pairs(seed: int, count: int = 4) -> Pairs:
    """Unlit pictures are half as bright; what is traced has noise, and ever less of it."""
    rng = np.random.default_rng(seed)
    exact = rng.uniform(0.2, 0.6, (count, 3, 16, 16))
    traced = np.stack([exact + rng.normal(0, 0.1 / np.sqrt(n), exact.shape) for n in FEW], axis=1)
    soft = exact + rng.normal(0, 0.05, exact.shape)
    denoised = np.stack([exact + 0.03] * len(FEW), axis=1)
    noisy = exact + rng.normal(0, NOISE, exact.shape)
    direct = exact / 3 + rng.normal(0, 0.03, exact.shape)
    arrays = (exact / 2, direct, soft, np.ones((count, 1, 16, 16)), denoised, traced, noisy)
    halves = (each.astype(np.float16) for each in arrays)
    return Pairs(*halves, error=np.full(count, NOISE))


def test_errors_of_all_ways_are_those_that_were_put_in() -> None:
    held, trained = {"a": pairs(1), "b": pairs(2)}, {"c": pairs(3, count=8)}
    network = PathLightNetwork(PathLightSize(8)).eval()
    found = path_light_alternatives({"finished": network}, held, trained, torch.device("cpu"))
    errors = {each.name: each.errors for each in found}
    # Times two they are the truth.
    assert errors["unlit"] == pytest.approx((0.0,) * 3, abs=2e-3)
    assert errors["soft light"] == pytest.approx((0.05,) * 3, rel=0.05)
    assert errors["direct light"] == pytest.approx((0.09,) * 3, rel=0.1)
    assert errors["as traced"] == pytest.approx([0.1 / np.sqrt(n) for n in FEW], rel=0.05)
    assert errors["denoised"] == pytest.approx((0.03,) * 3, rel=0.05)
    # Untrained, it changes nothing.
    assert errors["finished"] == pytest.approx(errors["denoised"], rel=1e-2)
    # Two independent pictures of even numbers from .2 to .6.
    assert errors["nearest training picture"] == pytest.approx((0.16,) * 3, rel=0.1)


def test_what_was_learned_is_found_again() -> None:
    known = pairs(1)
    network = PathLightNetwork(PathLightSize(8)).eval()
    networks, device = {"finished": network}, torch.device("cpu")
    first, *_ = path_light_alternatives(networks, {"a": known}, {"a": known}, device)
    # The noise of both is the same; none is left once it is taken off.
    assert first.errors == (0.0,) * 3
    without = path_light_alternatives(networks, {"a": known}, {}, device)
    assert "nearest training picture" not in [each.name for each in without]
