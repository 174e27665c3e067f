"""The same small images on the CPU and on a GPU; run as a program, in Numba's CUDA simulator."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from model.rendering.raycast.renderer import Device, RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

RANGE = (0.0, 255.0)
OPACITY = OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.4), GaussianMode(220.0, 30.0, 0.9)))
COLOR = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (100.0, 0.9, 0.8, 0.1), (255.0, 1.0, 0.3, 0.2)))
VIEW = View(35.0, 25.0, 7.0, 0.6)


def volume() -> Volume:
    """A bright ball in one corner of 12 x 9 x 11 voxels, nothing in the others."""
    z, y, x = np.mgrid[0:11, 0:9, 0:12]
    distance = np.sqrt((x - 3.5) ** 2 + (y - 4) ** 2 + (z - 7) ** 2)
    return Volume(np.clip(300 - 60 * distance, 0, 255).astype(np.uint8), (1.0, 1.2, 0.9))


def images(device: Device, size: int) -> dict[str, NDArray[np.float32]]:
    """Images of all kinds that there are on both devices."""
    drawn = {}
    for lighting in ("none", "direct", "soft", "shadows"):
        light = None if lighting == "none" else LightDirection()
        renderer = RaycastRenderer(volume(), lighting, light, device=device)
        drawn[lighting] = renderer.render(SceneInputs(VIEW, OPACITY, COLOR), size)
        if lighting == "none":
            frame = renderer.frame(SceneInputs(VIEW, OPACITY, COLOR), size)
            drawn["frame"], drawn["depth"] = frame.rgba, frame.depth
            drawn["opacity"] = renderer.opacity_image(SceneInputs(VIEW, OPACITY, COLOR), size)
            drawn["empty"] = renderer.render(SceneInputs(VIEW, OpacityTF(RANGE), COLOR), size)
            drawn["floats"] = RaycastRenderer(
                Volume(volume().scalars.astype(np.float32), volume().spacing), device=device
            ).render(SceneInputs(VIEW, OPACITY, COLOR), size)
        renderer.close()
    return drawn


if __name__ == "__main__":
    np.savez(sys.argv[1], **images("cuda", int(sys.argv[2])))
