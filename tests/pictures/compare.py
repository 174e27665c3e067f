"""Comparison of what is drawn with stored pictures.

Colour stands at the left of a stored picture, opacity at its right, so that both can be looked at.
"""

from dataclasses import dataclass
from pathlib import Path

import imageio.v3 as iio
import numpy as np

STORED = Path(__file__).parent / "stored"
FAILED = Path(__file__).parents[2] / "build" / "pictures"

STRAYS = 0.001
"""Share of a picture's numbers that may differ by more: another rounding moves a sample over a
step of the TF, or a ray past an edge."""


@dataclass(frozen=True)
class Tolerance:
    """Largest differences of a picture: root mean square, and of all numbers but STRAYS."""

    rmse: float
    most: float


def side_by_side(image):
    """Colour beside opacity, of an image (rows, columns, 4) in [0, 1]."""
    opacity = np.repeat(image[..., 3:], 3, axis=-1)
    return np.rint(255 * np.concatenate([image[..., :3], opacity], axis=1)).astype(np.uint8)


def store(name, picture):
    STORED.mkdir(exist_ok=True)
    iio.imwrite(STORED / f"{name}.png", picture, optimize=True)


def stored(name):
    return np.asarray(iio.imread(STORED / f"{name}.png"))


def check(name, drawn, tolerance, label):
    """Compare a picture with the stored one; fail with both, and their difference, in a folder.

    The label, for the folder, says who drew it.
    """
    expected = stored(name)
    assert drawn.shape == expected.shape, f"{name}: {drawn.shape} instead of {expected.shape}"
    difference = abs(drawn.astype(np.float64) - expected) / 255
    rmse = float(np.sqrt(np.mean(difference**2)))
    most = float(np.quantile(difference, 1 - STRAYS, method="higher"))
    if rmse <= tolerance.rmse and most <= tolerance.most:
        return
    folder = FAILED / f"{name}-{label}"
    folder.mkdir(parents=True, exist_ok=True)
    # A difference of the tolerance is half as bright as can be.
    shown = np.clip(difference / tolerance.most / 2, 0, 1)
    pictures = {"stored": expected, "drawn": drawn, "difference": np.rint(255 * shown)}
    for kind, picture in pictures.items():
        iio.imwrite(folder / f"{kind}.png", picture.astype(np.uint8))
    raise AssertionError(
        f"{name} {label} differs from the stored picture by an RMSE of {rmse:.4f} (at most "
        f"{tolerance.rmse:g}), and by {most:.3f} (at most {tolerance.most:g}) in all but "
        f"{100 * STRAYS:g} % of its numbers; see the pictures in {folder}."
    )
