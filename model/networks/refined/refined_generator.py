"""The generator that draws a coarse volume under the true TFs, and refines what is amiss.

Where the coarse volume can be drawn under the scene's own light, its images are unbiased:
what they lack is detail, which no network can guess from them. For unlit scenes and direct
light, with up to 130,000 weights, a quarter of an hour, and coarse volumes down to a 60th of
the voxels, a network lowered the error by at most 2 %. It therefore belongs to scenes in
VTK's global light only, which is scattering, and which the ray caster lacks.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import adaptive_avg_pool2d

from model.errors import TfscopeError
from model.networks.codec import LatentCodec
from model.networks.encoding import EncodedInputs, decode_colors, decode_unit
from model.networks.generator_network import GeneratorNetwork
from model.networks.refined.coarse_images import CoarseImages, CoarseRenderer, Shot
from model.networks.refined.coarse_tables import entry_table
from model.networks.refined.coarse_volume import CoarseVolume, coarse_shape
from model.networks.refined.refiner import Refiner
from model.networks.size import NetworkSize
from model.scene.inputs import decode_conditions
from model.scene.scene import Scene


class RefinedGenerator(GeneratorNetwork):
    """Draws a coarse volume for view and TFs; a small network corrects its light if need be.

    TFs and view enter exactly. The latent codec is not needed for that, and is trained
    without images: a code is decoded, and its TF is drawn.

    Parameters
    ----------
    size : NetworkSize
    scene : Scene
    coarse : CoarseVolume, optional
        Of the scene's volume; without it, one that is empty until weights are loaded.

    Raises
    ------
    TfscopeError
        For a scene of an earlier version, which does not know the volume's dimensions.
    """

    takes_code = False
    means: Tensor
    spreads: Tensor

    def __init__(self, size: NetworkSize, scene: Scene, coarse: CoarseVolume | None = None) -> None:
        super().__init__()
        if scene.dimensions is None:
            raise TfscopeError(
                "The scene is of an earlier version and lacks the volume's dimensions; "
                "render the samples anew, or train the paper's networks.",
                architecture="paper",
            )
        self._dimensions, self._scene, self._size = scene.dimensions, scene, size
        if coarse is None:
            shape = coarse_shape(scene.dimensions, size.nodes)
            means = spreads = np.zeros(shape[::-1], dtype=np.uint8)
        else:
            means, spreads = coarse.means, coarse.spreads
        self.register_buffer("means", torch.from_numpy(means))
        # A volume that is kept whole has no spread.
        whole = means.shape[::-1] == scene.dimensions
        self.register_buffer("spreads", torch.from_numpy(_packed(spreads[: 0 if whole else None])))
        # Decoded TFs are drawn; a codec of less than half the paper's width loses too much.
        self._codec = LatentCodec(replace(size, width=max(0.5, size.width)))
        self.refiner = Refiner(8, size.channels(128)) if scene.is_scattering else None
        self._renderer: CoarseRenderer | None = None
        self.register_load_state_dict_post_hook(  # type: ignore[no-untyped-call]
            RefinedGenerator._forget_renderer
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return what copies share; a renderer has threads, and each copy its own renderer."""
        return {**self.__dict__, "_renderer": None}

    @property
    def codec(self) -> LatentCodec:
        """Encoder and decoder of opacity TFs, independent of the images."""
        return self._codec

    @property
    def renderer(self) -> CoarseRenderer:
        """The renderer of the coarse volume."""
        if self._renderer is None:
            means = self.means.cpu().numpy()
            spreads = _unpacked(self.spreads.cpu().numpy(), means.shape)
            coarse = CoarseVolume.over(self._dimensions, self._scene.proportions, means, spreads)
            scene = self._scene
            self._renderer = CoarseRenderer(coarse, scene.lighting, scene.sample_distance)
        return self._renderer

    def leave_features_uncompiled(self) -> None:
        """Let a ``torch.compile`` of whoever calls :meth:`features` leave it as it is.

        It is no decorator, as that would load torch's compiler, for seconds, in every program.
        """
        self.features = torch.compiler.disable(self.features)  # type: ignore

    def features(self, inputs: EncodedInputs) -> tuple[Tensor, ...]:
        """Images (N, 4 or 8, S, S) of the coarse volume, in [0, 1]: unlit RGBA, then lit RGBA."""
        renderer = self.renderer
        with torch.autocast(inputs.opacity_tf.device.type, enabled=False):
            # What enters exactly must not be rounded on its way.
            opacity = decode_unit(inputs.opacity_tf)
            table = entry_table(opacity, decode_colors(inputs.color_tf), renderer.distance)
            shots = [
                Shot(found["view"], found.get("light", self._scene.light), tf)
                for found, tf in zip(
                    (
                        decode_conditions(row, self._scene)
                        for row in inputs.conditions.cpu().numpy()
                    ),
                    opacity.detach().cpu().numpy(),
                    strict=True,
                )
            ]
            images: Tensor = CoarseImages.apply(  # type: ignore[no-untyped-call]
                table, renderer, shots, self._size.image_size
            )
        return (images,)

    def latent_features(
        self, conditions: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, ...]:
        """Return the same for the TFs that latent codes stand for."""
        return self.features(EncodedInputs(conditions, self.codec.decode(latent), color_tf))

    def decode(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        """Colour and opacity of images of the coarse volume, refined if need be."""
        (images,) = features
        opacity = adaptive_avg_pool2d(images[:, 3:4], self._size.opacity_size)
        colors = images[:, -4:-1] if self.refiner is None else self.refiner(images)
        return 2 * colors - 1, 2 * opacity - 1

    @staticmethod
    def _forget_renderer(module: nn.Module, _keys: object) -> None:
        """Have the coarse volume read again after other nodes were loaded."""
        assert isinstance(module, RefinedGenerator)
        module._renderer = None


def _packed(levels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Pack numbers below 16, two in a byte, the first in the lower half."""
    flat = np.pad(levels.reshape(-1), (0, levels.size % 2))
    return np.asarray(flat[::2] | flat[1::2] << 4, dtype=np.uint8)


def _unpacked(packed: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Undo :func:`_packed` for an array of this shape; nothing stands for zeros."""
    if not packed.size:
        return np.zeros(shape, dtype=np.uint8)
    flat = np.stack([packed & 15, packed >> 4], axis=1).reshape(-1)
    return flat[: math.prod(shape)].reshape(shape)
