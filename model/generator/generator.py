"""The trained generator: renders a scene from view and transfer functions."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.ndimage import shift
from torch import Tensor
from torch.nn.functional import interpolate

from model.errors import LatentError
from model.generator.backends import EAGER, Backend, candidates, library_version, make_decode
from model.measurements import keep, kept
from model.networks.blocks import choose_device, place
from model.networks.card import ModelCard
from model.networks.checkpoint import load_model
from model.networks.generator_network import EncodedInputs, GeneratorNetwork, decode_unit
from model.scene.inputs import SceneInputs, condition_numbers
from model.scene.region import Mask
from model.scene.scene import Scene
from model.scene.transfer_function import TF_SAMPLES
from model.scene.view import View

logger = logging.getLogger(__name__)

NAME = "inference"
TIMED_IMAGES = 4


class Generator:
    """Generates images of the scene that its model was trained on; not thread-safe.

    Images are float32 RGBA like the reference renderer's, with the opacity image enlarged.
    """

    def __init__(
        self,
        card: ModelCard,
        network: GeneratorNetwork,
        device: torch.device,
        backend: Backend = EAGER,
    ) -> None:
        self.card = card
        self.device = device
        self.network = place(network, device).eval()
        self.backend = backend
        self._decode = make_decode(self.network, backend, device)

    @classmethod
    def load(cls, folder: Path, device: str = "auto", fastest: bool = False) -> Generator:
        """Load a model folder on "auto", "cpu" or "cuda".

        With `fastest`, use the fastest backend on this machine, measured when a network of this
        size is first loaded, and cached; else torch.
        """
        chosen = choose_device(device)
        card, network = load_model(folder)
        by = candidates(chosen) if fastest else [EAGER]
        about = {
            "size": asdict(card.size),
            "device": chosen.type,
            "candidates": [(candidate.text, library_version(candidate)) for candidate in by],
        }
        remembered = kept(NAME, about) if len(by) > 1 else None
        by.sort(key=lambda candidate: candidate.text != remembered)
        seconds: dict[Generator, float] = {}
        for candidate in by:
            generator = cls(card, network, chosen, candidate)
            if candidate.name == EAGER.name and not seconds:
                generator._draw_once()
                return generator
            try:
                seconds[generator] = generator._time_drawing()
            except Exception:
                logger.warning("%s: %s cannot draw it.", folder, candidate.name, exc_info=True)
                continue
            if candidate.text == remembered:
                return generator
        quickest = min(seconds, key=seconds.__getitem__)
        keep(NAME, about, quickest.backend.text)
        return quickest

    @torch.inference_mode()
    def _draw_once(self) -> tuple[Tensor, ...]:
        """Draw an image, so that the first one does not wait for kernels; return features."""
        numbers = (condition_numbers(self.scene),), (TF_SAMPLES,), (3, TF_SAMPLES)
        zeros = (torch.zeros(1, *shape, device=self.device) for shape in numbers)
        features = self.network.features(EncodedInputs(*zeros))
        self._decode(*features)
        return features

    @torch.inference_mode()
    def _time_drawing(self) -> float:
        """Return the least time of a few images in seconds, after a first one to warm up."""
        features = self._draw_once()
        durations = []
        for _ in range(TIMED_IMAGES):
            start = time.perf_counter()
            self._decode(*features)[0].cpu()
            durations.append(time.perf_counter() - start)
        return min(durations[1:])

    @property
    def scene(self) -> Scene:
        """Scene of the model's training."""
        return self.card.scene

    def render(self, inputs: SceneInputs) -> NDArray[np.float32]:
        """Generate one image of shape (S, S, 4)."""
        return self.render_batch([inputs])[0]

    @torch.inference_mode()
    def render_batch(self, inputs: Sequence[SceneInputs]) -> NDArray[np.float32]:
        """Generate N images (N, S, S, 4) in one pass."""
        images = self._render(self.network.features(self.encoded(inputs)))
        for image, shown in zip(images, inputs, strict=True):
            image[...] = panned(image, shown.view)
        return images

    @torch.inference_mode()
    def image_pairs(self, inputs: EncodedInputs) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Render colour images (N, S, S, 3) and opacity images (N, So, So) apart, in [0, 1]."""
        image, opacity = self._decode(*self.network.features(inputs))
        colors = decode_unit(image).permute(0, 2, 3, 1).cpu().numpy()
        return colors, decode_unit(opacity)[:, 0].cpu().numpy()

    @torch.inference_mode()
    def render_latent(self, codes: NDArray[np.float32], inputs: SceneInputs) -> NDArray[np.float32]:
        """Generate images (N, S, S, 4) of codes (N, d) instead of the inputs' opacity TF."""
        count, given = codes.shape
        if given != (wanted := self.card.size.latent_dim):
            raise LatentError(f"A latent code of this model has {wanted} numbers, not {given}.")
        if not np.isfinite(codes).all():
            raise LatentError("Latent codes are not finite; use another model.")
        conditions, _, color_tf = self.encoded([inputs])
        of_codes = torch.from_numpy(codes).to(self.device)
        same = conditions.expand(count, -1), of_codes, color_tf.expand(count, -1, -1)
        return panned(self._render(self.network.latent_features(*same)), inputs.view)

    def encoded(self, inputs: Sequence[SceneInputs]) -> EncodedInputs:
        """Encode the inputs of N images for the network, on the generator's device."""
        return EncodedInputs.of(inputs, self.scene).map(lambda tensor: tensor.to(self.device))

    def _render(self, features: tuple[Tensor, ...]) -> NDArray[np.float32]:
        image, opacity = self._decode(*features)
        opacity = interpolate(
            opacity, size=image.shape[-2:], mode="bilinear", align_corners=False, antialias=False
        )
        # In place: for many images, each copy takes as long as drawing some.
        rgba = torch.empty((len(image), *image.shape[-2:], 4), device=image.device)
        rgba[..., :3] = image.permute(0, 2, 3, 1)
        rgba[..., 3] = opacity[:, 0]
        rgba.mul_(0.5).add_(0.5)
        return np.asarray(rgba.cpu().numpy())


def panned(pictures: NDArray[np.float32], view: View) -> NDArray[np.float32]:
    """Shift pictures (..., S, S, C) by a view's pan."""
    if view.pan_x == view.pan_y == 0.0:
        return pictures
    size = pictures.shape[-2]
    down, right = -view.pan_y * size / 2, view.pan_x * size / 2
    still = (0.0,) * (pictures.ndim - 3)
    return shift(pictures, (*still, down, right, 0.0), order=1, mode="constant")


def unpanned(mask: Mask, view: View) -> Mask:
    """Return the pixels of a picture before panning for a mask (S, S) of the panned one."""
    back = replace(view, pan_x=-view.pan_x, pan_y=-view.pan_y)
    return panned(mask[..., None].astype(np.float32), back)[..., 0] > 0.5
