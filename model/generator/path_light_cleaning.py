"""Improvement of path-traced pictures of few samples: the denoiser and the network behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model.errors import CheckpointError
from model.generator.catalog import PATH_LIGHT
from model.networks.blocks import choose_device, place
from model.networks.path_light_network import (
    MULTIPLE,
    PathLightNetwork,
    load_path_light,
    network_inputs,
)
from model.rendering.path_tracing import denoising
from model.rendering.path_tracing.denoising import Cleaning, Denoiser, denoise, denoiser
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.path_tracing.moving_light import SIDE, light_of, relit
from model.rendering.raster import Raster
from model.rendering.raycast.illumination import LEARNED_SHADOW
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.volume import Volume

MOST_SAMPLES = 8  # of a pixel, up to which the network's pictures are closer to the truth

MOST_PIXELS = 1 << 16
"""Pixels of a picture up to which the network improves each. In larger pictures it improves light
for blocks of 2 x 2: at full resolution, the denoiser takes the noise of one sample for creases."""


def cleaning_of(
    volume: Volume,
    light: LightDirection | None = None,
    cleans: bool = True,
    network: Path = PATH_LIGHT,
) -> tuple[Cleaning | None, Callable[[], None]]:
    """Return the best available denoising of a volume's path-traced pictures, and its release.

    The first is None if there is nothing to denoise, or no denoiser. With a missing or damaged
    network, the denoiser works alone.
    """
    if not (cleans and denoising.available()):
        return None, lambda: None
    try:
        _, loaded = load_path_light(network)
    except CheckpointError:
        return denoiser, lambda: None
    cleaning = NetworkCleaning(loaded, volume, light)
    return cleaning.cleaner, cleaning.close


class NetworkCleaning:
    """Improves one volume's path-traced pictures by the network behind the denoiser."""

    def __init__(
        self, network: PathLightNetwork, volume: Volume, light: LightDirection | None = None
    ) -> None:
        self._device = choose_device("auto")
        self._network = place(network, self._device)
        self._soft = RaycastRenderer(volume, "soft", light, shadow=LEARNED_SHADOW)

    def cleaner(self, inputs: SceneInputs, raster: Raster) -> FinishedPicture:
        """Return the denoising of a picture's estimates."""
        is_small = raster.width * raster.height <= MOST_PIXELS
        if not is_small:
            raster = Raster(*(-(-length // SIDE) for length in astuple(raster)[:6]))
        return FinishedPicture(self, lambda: self._soft.render(inputs, raster)[..., :3], is_small)

    @torch.inference_mode()
    def finish(
        self,
        traced: NDArray[np.float32],
        soft: NDArray[np.float32],
        unlit: NDArray[np.float32],
        samples: int,
    ) -> NDArray[np.float32]:
        """Estimate a picture of many samples; pictures (rows, columns, 3) are times opacity."""
        denoised = denoise(traced, unlit[..., :3], quick=True)
        colors = {"unlit": unlit[..., :3], "soft": soft, "denoised": denoised, "traced": traced}
        tensors = {name: self._tensor(image) for name, image in colors.items()}
        inputs = network_inputs(tensors, self._tensor(unlit[..., 3:]), samples)
        rows, columns = unlit.shape[:2]
        padding = 0, -columns % MULTIPLE, 0, -rows % MULTIPLE
        inputs = torch.nn.functional.pad(inputs, padding, mode="replicate")
        finished = self._network(inputs.contiguous(memory_format=torch.channels_last))
        result: NDArray[np.float32] = finished[0, :, :rows, :columns].permute(1, 2, 0).cpu().numpy()
        return result

    def close(self) -> None:
        """End the ray caster's threads."""
        self._soft.close()

    def _tensor(self, image: NDArray[np.float32]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(image)).permute(2, 0, 1)[None].to(self._device)


class FinishedPicture(Denoiser):
    """Denoises the estimates of one picture; the network improves those of few samples."""

    def __init__(
        self, cleaning: NetworkCleaning, draw_soft: Callable[[], NDArray[np.float32]], small: bool
    ) -> None:
        self._cleaning, self._draw_soft, self._is_small = cleaning, draw_soft, small

    @cached_property
    def _soft(self) -> NDArray[np.float32]:
        """Soft light of each pixel or, in a large picture, of each block."""
        return self._draw_soft()

    def clean(
        self, radiance: NDArray[np.float32], estimate: Estimate, samples: int
    ) -> NDArray[np.float32]:
        """Denoise; improve by the network if samples are few.

        A large picture of one sample has the network's light. Of more samples, it is the mean of
        that and the denoised picture, whose errors differ.
        """
        if estimate.samples > MOST_SAMPLES:
            return super().clean(radiance, estimate, samples)
        unlit = np.concatenate([estimate.albedo, estimate.rgba[..., 3:]], axis=2)
        if self._is_small:
            return self._cleaning.finish(radiance, self._soft, unlit, samples)
        lit = self._lit(radiance, unlit, samples)
        if samples > 1:
            lit += super().clean(radiance, estimate, samples)
            lit /= 2
        return lit

    def _lit(
        self, radiance: NDArray[np.float32], unlit: NDArray[np.float32], samples: int
    ) -> NDArray[np.float32]:
        """Return the unlit picture in the light of blocks of pixels."""
        rows, columns = unlit.shape[:2]
        padding = (0, -rows % SIDE), (0, -columns % SIDE), (0, 0)
        radiance, unlit = (np.pad(image, padding, "edge") for image in (radiance, unlit))
        few = _blocks(unlit)
        lit = self._cleaning.finish(_blocks(radiance), self._soft, few, samples * SIDE**2)
        picture = relit(unlit, light_of(lit, few[..., :3]), few[..., :3])
        return picture[:rows, :columns, :3]

    def method(self, samples: int) -> str:
        """Name the processing of a picture of this many samples."""
        return "denoised by the network" if samples <= MOST_SAMPLES else super().method(samples)


def _blocks(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the means of blocks of pixels, of which an image (rows, columns, channels) is full."""
    rows, columns, channels = image.shape
    shape = rows // SIDE, SIDE, columns // SIDE, SIDE, channels
    return np.asarray(image.reshape(shape).mean(axis=(1, 3)))
