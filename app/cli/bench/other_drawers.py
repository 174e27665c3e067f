"""Others that ``bench tradeoff`` measures: the paper's networks, and compact volumes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import numpy as np
from numpy.typing import NDArray

from model.evaluation.compact_error import restored
from model.generator.catalog import model_for
from model.generator.generator import Generator
from model.networks.card import load_card
from model.rendering.raster import Raster
from model.rendering.renderer import Renderer, open_renderer
from model.rendering.setting import Others, smooth_distance
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.volume_files.voxel_code import encode_voxels

BYTES_PER_VOXEL = (1 / 3, 1 / 16)
"""Of compact volumes."""


@contextmanager
def other_drawers(volume: Volume, scene: Scene) -> Iterator[Others]:
    """Give who else draws a volume as a scene has it, and release it afterwards.

    The networks are the shipped ones of this volume, where they were trained under the scene's
    lighting and over its range. Compact volumes are drawn as the window draws them at rest.
    """
    found: dict[str, _ByNetwork | _ByCopy] = {}
    with ExitStack() as stack:
        folder = model_for(volume.fingerprint)
        if folder is not None:
            own = load_card(folder).scene
            wanted = scene.lighting, scene.scalar_range, scene.scale
            if (own.lighting, own.scalar_range, own.scale) == wanted:
                found["the paper's networks"] = _ByNetwork(
                    Generator.load(folder, backend="auto", precision="auto")
                )
        if scene.lighting != "path" and volume.scale == "linear":
            for share in BYTES_PER_VOXEL:
                nbytes = int(share * volume.voxels.size)
                coded = encode_voxels(volume.voxels, nbytes, volume.missing)
                copy = _ByCopy(restored(volume, coded), scene)
                stack.callback(copy.renderer.close)
                found[f"compact volume of {len(coded.data) / 1e6:.2g} MB"] = copy
        yield found


class _ByNetwork:
    def __init__(self, generator: Generator) -> None:
        self._generator = generator

    def __call__(self, inputs: SceneInputs, shown: Raster) -> NDArray[np.float32]:
        return self._generator.render(inputs)


class _ByCopy:
    def __init__(self, copy: Volume, scene: Scene) -> None:
        self.renderer: Renderer = open_renderer("raycast", copy, scene.lighting, scene.light)
        self._distance = smooth_distance(scene.sample_distance, scene.lighting)

    def __call__(self, inputs: SceneInputs, shown: Raster) -> NDArray[np.float32]:
        return self.renderer.render(inputs, shown, self._distance)
