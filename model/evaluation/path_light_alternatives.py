"""Alternatives to finished path-traced pictures, and how near each of them is."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from model.networks.path_light_network import PathLightNetwork
from model.samples.path_light_pairs import FEW, Pairs
from model.training.path_light_training import path_light_errors

Pictures = NDArray[np.float32]


@dataclass(frozen=True)
class Alternative:
    """One way to show a path-traced picture early.

    Attributes
    ----------
    errors : tuple of float
        RMSE to pictures of many samples, whose own noise is taken off, after each number of samples
        in :data:`model.samples.path_light_pairs.FEW`: the mean over volumes.
    """

    name: str
    errors: tuple[float, ...]


def path_light_alternatives(
    networks: dict[str, PathLightNetwork],
    held_out: dict[str, Pairs],
    trained: dict[str, Pairs],
    device: torch.device,
) -> list[Alternative]:
    """Measure networks, and what could be shown in their place, on held-out pairs.

    Unlit pictures and those in other light are taken times the factor that brings each of them
    nearest.

    Parameters
    ----------
    networks : dict of str to PathLightNetwork
        By the names of the alternatives that they are.
    held_out : dict of str to Pairs
        By volume.
    trained : dict of str to Pairs
        What the networks have learned from: the nearest picture among them is what a program would
        show that remembers instead. Empty to leave that out.
    """
    found = []
    if trained:
        known = np.concatenate([_clipped(each.exact) for each in trained.values()])
        found.append(_steady("nearest training picture", held_out, lambda p: _nearest(p, known)))
    found.append(_steady("unlit", held_out, lambda p: _scaled(p.unlit, p.exact)))
    found.append(_steady("direct light", held_out, lambda p: _scaled(p.direct, p.exact)))
    found.append(_steady("soft light", held_out, lambda p: _scaled(p.soft, p.exact)))
    found.append(_refined("as traced", held_out, lambda p: p.traced))
    found.append(_refined("denoised", held_out, lambda p: p.denoised))
    for name, network in networks.items():
        errors = path_light_errors(network, held_out, device)
        found.append(Alternative(name, tuple(each.means[1] for each in errors)))
    return found


def _steady(
    name: str, held_out: dict[str, Pairs], draw: Callable[[Pairs], Pictures]
) -> Alternative:
    """Return an alternative that does not depend on the number of samples."""
    return Alternative(name, (_mean_error(held_out, draw),) * len(FEW))


def _refined(
    name: str, held_out: dict[str, Pairs], pictures: Callable[[Pairs], NDArray[np.float16]]
) -> Alternative:
    """Return an alternative with pictures of its own for each number of samples."""
    errors = [
        _mean_error(held_out, lambda p, place=place: _clipped(pictures(p)[:, place]))  # type: ignore[misc]
        for place in range(len(FEW))
    ]
    return Alternative(name, tuple(errors))


def _mean_error(held_out: dict[str, Pairs], draw: Callable[[Pairs], Pictures]) -> float:
    """Mean RMSE of what is drawn in place of each volume's pictures, then over the volumes."""
    means = []
    for pairs in held_out.values():
        squares = np.mean((draw(pairs) - _clipped(pairs.exact)) ** 2, axis=(1, 2, 3))
        own = np.maximum(squares - pairs.error**2, 0)
        means.append(float(np.sqrt(own).mean()))
    return math.fsum(means) / len(means)


def _clipped(pictures: NDArray[np.float16]) -> Pictures:
    return pictures.astype(np.float32).clip(0, 1)


def _scaled(pictures: NDArray[np.float16], exact: NDArray[np.float16]) -> Pictures:
    found, right = pictures.astype(np.float32), _clipped(exact)
    axes = 1, 2, 3
    factors = (found * right).sum(axes) / np.maximum((found**2).sum(axes), 1e-9)
    scaled: Pictures = (found * factors[:, None, None, None]).clip(0, 1)
    return scaled


def _nearest(pairs: Pairs, known: Pictures) -> Pictures:
    right = _clipped(pairs.exact)
    a, b = right.reshape(len(right), -1), known.reshape(len(known), -1)
    distances = (b**2).sum(1)[None] - 2 * a @ b.T
    chosen: Pictures = known[distances.argmin(1)]
    return chosen
