"""Random numbers of paths: functions of pixel, sample and seed alone.

So a picture does not depend on the number of threads, and an edit of the TF changes only what it
affects. The numbers with the largest effect, those of the first collision, are additive recurrences
with a shift per pixel, which spread a pixel's samples evenly. All others are hashes.
"""

from __future__ import annotations

import numpy as np

from model.compilation import inlined

SPREAD = 6  # numbers of a sample that are spread evenly over the samples of a pixel
_SCALE = np.float32(2.0**-24)


def _recurrences() -> tuple[np.uint32, ...]:
    """Steps of the additive recurrences: powers of the inverse root of x^(n + 1) = x + 1."""
    root = 1.5
    for _ in range(64):
        root = (1 + root) ** (1 / (SPREAD + 1))
    return tuple(np.uint32(int(root ** -(j + 1) * 2**32)) for j in range(SPREAD))


RECURRENCES = _recurrences()


@inlined
def hashed(number):
    """Mix the bits of a uint32, so that close numbers have unrelated hashes."""
    n = np.uint32(number)
    n = np.uint32(n ^ (n >> np.uint32(16)))
    n = np.uint32(n * np.uint32(0x7FEB352D))
    n = np.uint32(n ^ (n >> np.uint32(15)))
    n = np.uint32(n * np.uint32(0x846CA68B))
    return np.uint32(n ^ (n >> np.uint32(16)))


@inlined
def joined(first, second):
    """Hash two numbers into one uint32."""
    return hashed(np.uint32(np.uint32(first) * np.uint32(0x9E3779B1)) ^ hashed(np.uint32(second)))


@inlined
def number_of(bits):
    """Return the float32 in [0, 1) of 32 bits."""
    return np.float32(np.uint32(bits) >> np.uint32(8)) * _SCALE


@inlined
def following(state):
    """Return the next state of a stream of random numbers; :func:`hashed` gives its bits."""
    return np.uint32(state + np.uint32(0x9E3779B9))


@inlined
def spread(pixel, index, dimension):
    """Return a number in [0, 1) of the sample `index` of a pixel, spread over its samples.

    The pixel is a hash of itself, seed and half; there are :data:`SPREAD` dimensions.
    """
    shift = joined(pixel, dimension)
    return number_of(np.uint32(shift + np.uint32(np.uint32(index) * RECURRENCES[dimension])))
