"""A small volume and a TF, as files."""

import numpy as np
import pytest

from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction

RANGE = (0.0, 255.0)


@pytest.fixture(scope="module")
def raw_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("volumes") / "ball_20x18x16_uint8.raw"
    z, y, x = np.mgrid[0:16, 0:18, 0:20]
    distance = np.sqrt((x - 9) ** 2 + (y - 8) ** 2 + (z - 9) ** 2)
    path.write_bytes(np.clip(255 - 25 * distance, 0, 255).astype(np.uint8).tobytes())
    return path


@pytest.fixture(scope="module")
def tf_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("tfs") / "tf.json"
    color = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (255.0, 1.0, 0.3, 0.2)))
    TransferFunction(OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.2),)), color).save(path)
    return path
