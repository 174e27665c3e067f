"""The light of a scene, as the kernels of the ray caster take it."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.rendering.noise import LABEL_NOISE, noise_of
from model.rendering.raycast.classification import Classification
from model.rendering.raycast.illumination import Illumination, gradient_light
from model.rendering.raycast.shading import NO_GRID, NO_LIGHT, Light, LightGrid
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.view import View
from model.scene.volume import Volume

COARSE = 32
"""Nodes along the longest axis of a coarse grid of soft light."""


class Lit(NamedTuple):
    """A scene's light.

    Attributes
    ----------
    gradient : Light or None
        Of surfaces by their gradient; None where they reflect nothing.
    soft : LightGrid or None
        Soft light at the nodes of a grid; None under another one.
    """

    gradient: Light | None
    soft: LightGrid | None

    @property
    def filled(self) -> tuple[Light, LightGrid]:
        """The same for kernels that one version of serves all lights."""
        return self.gradient or NO_LIGHT, self.soft or NO_GRID


UNLIT = Lit(None, None)


class SceneLight:
    """Lights the scenes of one volume.

    Attributes
    ----------
    is_coarse : bool
        Whether soft light is that of a coarse grid now: what moves has no time for a finer one.
    """

    def __init__(
        self,
        volume: Volume,
        scalars: NDArray[np.generic],
        lighting: Lighting,
        default: LightDirection,
        light_grid: partial[Illumination],
    ) -> None:
        self._volume, self._lighting, self._default = volume, lighting, default
        self._noise = noise_of(scalars) if lighting == "direct" else 0.0
        self._grid = light_grid() if lighting == "soft" else None
        self.is_coarse = False
        self.coarse_grid = lru_cache(lambda: light_grid(longest=COARSE))

    @property
    def grid(self) -> Illumination | None:
        """The grid of soft light; None under another one."""
        return self.coarse_grid() if self._grid is not None and self.is_coarse else self._grid

    def of(self, inputs: SceneInputs, classification: Classification) -> Lit:
        """Return the light of a scene."""
        light = inputs.light or self._default
        gradient, soft = None, None
        if self._lighting == "direct":
            noise = LABEL_NOISE if inputs.is_nearest(self._volume) else self._noise
            gradient = gradient_light(
                inputs.view, light, self._volume, inputs.crop, noise, classification.brightest
            )
        if self.grid is not None:
            soft = self.grid.grid(*self.soft_inputs(inputs), inputs.crop, classification.brightest)
        return Lit(gradient, soft)

    def soft_inputs(self, inputs: SceneInputs) -> tuple[View, LightDirection, NDArray[np.float32]]:
        """Return what soft light depends on apart from the crop box: view, light and opacities."""
        opacities = inputs.opacity_tf.sample(self._volume.scalar_range)
        return inputs.view, inputs.light or self._default, opacities
