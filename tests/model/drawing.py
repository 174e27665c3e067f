"""What tests of renderers draw: TFs over bytes, a view, and pictures."""

import numpy as np

from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

RANGE = (0.0, 255.0)
WHITE = ColorTF(RANGE, ((0.0, 1.0, 1.0, 1.0),))
RAINBOW = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (100.0, 0.9, 0.8, 0.1), (255.0, 1.0, 0.3, 0.2)))
MODES = OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.2), GaussianMode(220.0, 30.0, 0.5)))
VIEW = View(35.0, 25.0, 7.0, 0.9)


def constant(opacity):
    return OpacityTF(RANGE, points=((0.0, opacity),))


def slab(shape=(33, 9, 33)):
    """A nearly constant volume: two corners differ, since constant volumes are refused."""
    scalars = np.full(shape, 128, np.uint8)
    scalars[0, 0, 0], scalars[-1, -1, -1] = 0, 255
    return Volume(scalars)


def drawn(kind, volume, inputs, size, *options, **more):
    """Draw one picture by a renderer of a kind."""
    return kind(volume, *options, **more).render(inputs, size)


def image_of(kind, volume, view=VIEW, opacity_tf=MODES, color_tf=RAINBOW, size=64, **options):
    """Draw TFs from a view."""
    return drawn(kind, volume, SceneInputs(view, opacity_tf, color_tf), size, **options)


def rms(difference):
    return float(np.sqrt(np.mean(np.square(difference, dtype=np.float64))))
