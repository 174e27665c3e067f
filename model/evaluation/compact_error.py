"""How far images of a compact volume are from those of the volume, and one as small as allowed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.volume_files.compact import ImageError
from model.volume_files.voxel_code import (
    LEAST_BITS,
    CodedVoxels,
    Ends,
    decode_voxels,
    encode_voxels,
)

Image = NDArray[np.float32]

IMAGES, SIZE = 200, 128
"""Random views and TFs that are drawn, and the images' width and height in pixels."""

FEW_IMAGES = 24
"""Those that lengths are tried by."""

SEED = 7
STEPS = 6
"""Lengths that are tried: the last two differ by 8 %."""


def restored(volume: Volume, coded: CodedVoxels) -> Volume:
    """Return a volume as it comes back from its code."""
    voxels = volume.voxels
    shape = voxels.shape[0], voxels.shape[1], voxels.shape[2]
    ends = Ends.of(voxels, volume.missing)
    return replace(volume, voxels=decode_voxels(coded, shape, voxels.dtype, ends))


class TrueImages:
    """Images of a volume from random views through TFs of all kinds, unlit, to compare copies by.

    They are drawn when they are first needed, and once, however many copies are compared.
    """

    def __init__(self, volume: Volume) -> None:
        self._volume = volume
        self._scene = Scene.of(volume, SIZE, renderer="raycast")
        self._drawn: list[Image] = []

    def error_of(
        self,
        copy: Volume,
        images: int = IMAGES,
        on_progress: Callable[[float], None] = lambda done: None,
    ) -> ImageError:
        """Measure how far images of a copy are from the first ones of the volume.

        Parameters
        ----------
        copy : Volume
            On the volume's grid, over its range.
        on_progress : callable
            Called with the fraction that is done; what it raises ends the measurement.
        """
        errors = []
        with self._drawing(self._volume) as draw_truth, self._drawing(copy) as draw_copy:
            for index in range(images):
                if index == len(self._drawn):
                    self._drawn.append(draw_truth(index))
                difference = self._drawn[index] - draw_copy(index)
                errors.append(math.sqrt(float(np.square(difference).mean())))
                on_progress((index + 1) / images)
        return ImageError(float(np.mean(errors)), max(errors), images)

    @contextmanager
    def _drawing(self, volume: Volume) -> Iterator[Callable[[int], Image]]:
        """Yield a function that draws the image of a number, float32 (S, S, 3)."""
        # The window knows this module from its start, and Numba takes a second.
        from model.rendering.raycast.renderer import RaycastRenderer

        renderer = RaycastRenderer(volume, "none", None, self._scene.sample_distance)
        try:
            yield lambda index: renderer.render(
                draw_sample(self._scene, SEED, "holdout", index), SIZE
            )[..., :3].astype(np.float32)
        finally:
            renderer.close()


def encode_within(
    volume: Volume,
    most_error: float,
    truth: TrueImages,
    on_progress: Callable[[float], None] = lambda done: None,
) -> CodedVoxels:
    """Compress a volume as far as an image error allows.

    Parameters
    ----------
    most_error : float
        Largest RMSE of images, in the mean over :data:`FEW_IMAGES` random views and TFs.
    truth : TrueImages
        The volume's.
    on_progress : callable
        Called with the fraction that is done.

    Raises
    ------
    VolumeError
        For an error that is not positive.
    """
    if not 0 < most_error < 1:
        raise VolumeError(f"An image error of {most_error:g} is none; give one such as 0.004.")
    voxels = volume.voxels
    low, high = math.log(LEAST_BITS / 8 * voxels.size + 1), math.log(voxels.nbytes)
    best = encode_voxels(voxels, 2 * voxels.nbytes, volume.missing)
    if best.is_exact:
        high = math.log(len(best.data))
    for step in range(STEPS):
        # The first lengths that are tried are far apart, and most volumes need few bytes.
        length = (low + high) / 2
        coded = encode_voxels(voxels, int(math.exp(length)), volume.missing)
        error = 0.0
        if not coded.is_exact:
            # Told image by image, so that whoever cancels need not wait for all of them.
            tell = partial(_tell_part, on_progress, step)
            error = truth.error_of(restored(volume, coded), FEW_IMAGES, tell).rmse
        if error <= most_error:
            best, high = coded, length
        else:
            low = length
        on_progress((step + 1) / STEPS)
    return best


def _tell_part(on_progress: Callable[[float], None], step: int, done: float) -> None:
    on_progress((step + done) / STEPS)
