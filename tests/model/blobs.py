import numpy as np

from model.scene.volume import Volume


def blobs():
    """A small anisotropic volume without symmetries: three Gaussian blobs."""
    z, y, x = np.mgrid[0:20, 0:24, 0:16].astype(np.float64)
    field = np.zeros_like(x)
    for cx, cy, cz, size, height in ((5, 8, 6, 4, 1.0), (11, 17, 13, 3, 0.7), (6, 18, 15, 2, 0.9)):
        square = (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2
        field += height * np.exp(-square / size**2)
    voxels = np.rint(255 * field / field.max()).astype(np.uint8)
    return Volume(voxels, (1.5, 1.0, 1.2), name="blobs")
