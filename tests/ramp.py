"""A small ramp of a volume, and transfer functions over it."""

import numpy as np

from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.volume import Volume


def make_volume(name="ramp", top=200.0):
    """Every value from 100 to `top`, none twice."""
    scalars = np.linspace(100.0, top, 6 * 5 * 4, dtype=np.float32).reshape(6, 5, 4)
    return Volume(scalars, name=name, units="K")


def byte_volume():
    """A ramp whose kernels other tests have compiled: one type of voxels is as good as another."""
    return Volume(make_volume().voxels.astype(np.uint8))


def make_tf(*means):
    modes = tuple(GaussianMode(mean, 8.0, 0.5) for mean in means or (130.0, 170.0))
    stops = ((100.0, 0.0, 0.0, 0.0), (150.0, 0.2, 0.6, 0.4), (200.0, 1.0, 1.0, 1.0))
    return TransferFunction(OpacityTF((100.0, 200.0), modes), ColorTF((100.0, 200.0), stops))
