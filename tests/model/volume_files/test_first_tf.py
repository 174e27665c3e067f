"""The TF under which a volume is seen first."""

import numpy as np
import pytest

from model.scene.default_tf import default_transfer_function
from model.scene.transfer_function import TransferFunction
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.first_tf import first_transfer_function
from model.volume_files.shipped import SAMPLES, sample_of, shipped_volumes


@pytest.mark.parametrize("path", shipped_volumes(), ids=lambda path: path.name)
def test_shipped_volumes_are_shown_under_the_tf_beside_them(path):
    volume = read_volume(path)
    assert sample_of(volume) == SAMPLES[path.name]
    assert first_transfer_function(volume) == TransferFunction.load(path.with_suffix(".tf.json"))


def test_scans_in_hounsfield_units_show_bone_before_soft_tissue_before_air():
    values = np.linspace(-1024, 3071, 4096).astype(np.int16).reshape(16, 16, 16)
    volume = Volume(values, name="scan", units="HU")
    opacity = first_transfer_function(volume).opacity
    assert opacity.scalar_range == volume.scalar_range
    air, tissue, contrast, bone = opacity(np.array([-1000.0, 80.0, 280.0, 700.0]))
    assert air == 0 < tissue < 0.05 < contrast < 0.3 < 0.8 < bone


def test_other_volumes_are_shown_by_their_histogram():
    values = np.linspace(-1024, 3071, 4096).astype(np.int16).reshape(16, 16, 16)
    # Without a unit; in HU, without anything that is dense enough.
    for volume in (Volume(values), Volume(values // 30, units="HU")):
        assert first_transfer_function(volume) == default_transfer_function(volume)
