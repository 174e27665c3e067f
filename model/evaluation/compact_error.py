"""How far images of a compact volume are from those of the volume, and one as small as allowed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

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


def image_error(
    volume: Volume,
    copy: Volume,
    images: int = IMAGES,
    on_progress: Callable[[float], None] = lambda done: None,
) -> ImageError:
    """Measure how far images of a copy are from those of a volume.

    Parameters
    ----------
    volume, copy : Volume
        On the same grid, over the same range.
    images : int
        Number of random views and TFs of all kinds, unlit.
    on_progress : callable
        Called with the fraction that is done.
    """
    scene = Scene.of(volume, SIZE, renderer="raycast")
    # The window knows this module from its start, and Numba takes a second.
    from model.rendering.raycast.renderer import RaycastRenderer

    renderers = [RaycastRenderer(v, "none", None, scene.sample_distance) for v in (volume, copy)]
    errors = []
    try:
        for index in range(images):
            inputs = draw_sample(scene, SEED, "holdout", index)
            one, other = (r.render(inputs, SIZE)[..., :3].astype(np.float32) for r in renderers)
            errors.append(math.sqrt(float(np.square(one - other).mean())))
            on_progress((index + 1) / images)
    finally:
        for renderer in renderers:
            renderer.close()
    return ImageError(float(np.mean(errors)), max(errors), images)


def encode_within(
    volume: Volume,
    most_error: float,
    on_progress: Callable[[float], None] = lambda done: None,
) -> CodedVoxels:
    """Compress a volume as far as an image error allows.

    Parameters
    ----------
    volume : Volume
    most_error : float
        Largest RMSE of images, in the mean over :data:`FEW_IMAGES` random views and TFs.
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
    best = encode_voxels(voxels, 2 * voxels.nbytes)
    if best.is_exact:
        high = math.log(len(best.data))
    for step in range(STEPS):
        # The first lengths that are tried are far apart, and most volumes need few bytes.
        length = (low + high) / 2
        coded = encode_voxels(voxels, int(math.exp(length)))
        error = 0.0
        if not coded.is_exact:
            error = image_error(volume, restored(volume, coded), FEW_IMAGES).rmse
        if error <= most_error:
            best, high = coded, length
        else:
            low = length
        on_progress((step + 1) / STEPS)
    return best
