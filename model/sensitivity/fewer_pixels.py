"""Sensitivities of images of few pixels, then of more, until they are near or time is up."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from model.rendering.resizing import resized
from model.sensitivity.cosine import cosine

LEAST_SIZE = 32
"""Width and height of the smallest image, in pixels, unless fewer are asked for."""

WARM_SIZE = 8
"""Width and height of an image that nobody sees, in pixels."""

T = TypeVar("T")


@dataclass(frozen=True)
class Approximation(Generic[T]):
    """An answer of an image of fewer pixels than were asked for, or of as many.

    Attributes
    ----------
    answer : T
    size : int
        Width and height of the image in pixels.
    seconds : float
        That all images up to this took.
    cosine : float or None
        To the answer of half as many columns, which is less near than this one; 1 for the image
        that was asked for, None where it is the first of several.
    """

    answer: T
    size: int
    seconds: float
    cosine: float | None


def approximated(
    ask: Callable[[int], T],
    numbers: Callable[[T], NDArray[np.floating]],
    size: int,
    seconds: float | None,
    error: float | None,
) -> Approximation[T]:
    """Ask for images of twice as many columns each time.

    Parameters
    ----------
    ask : callable
        Answers for an image of a width and height in pixels.
    numbers : callable
        An answer's sensitivities: the curve of a region, shape (256,), which hardly depends on
        the number of pixels but for its length, or the field of a value, shape (S, S, 3).
    size : int
        Width and height of the image that is asked for.
    seconds : float or None
        That all may take: the next is asked for if it is expected to be ready by then.
    error : float or None
        1 - cosine to the answer of half as many columns from which no more are asked for.
    """
    sizes = [size]
    while sizes[0] // 2 >= LEAST_SIZE:
        sizes.insert(0, sizes[0] // 2)
    # Not counted: what is loaded or compiled for the first.
    ask(WARM_SIZE)
    begun = time.perf_counter()
    last: T | None = None
    for number, one in enumerate(sizes):
        start = time.perf_counter()
        found = ask(one)
        now = time.perf_counter()
        agreement = None if last is None else _agreement(numbers(last), numbers(found))
        if number == len(sizes) - 1:
            return Approximation(found, one, now - begun, 1.0)
        near = error is not None and agreement is not None and 1 - agreement <= error
        # Four times as many pixels.
        late = seconds is not None and now - begun + 4 * (now - start) > seconds
        if near or late:
            break
        last = found
    return Approximation(found, one, now - begun, agreement)


def _agreement(coarse: NDArray[np.floating], fine: NDArray[np.floating]) -> float:
    if coarse.ndim == 1:
        return cosine(coarse, fine)
    return cosine(resized(coarse, fine.shape[:2]).ravel(), fine.ravel())
