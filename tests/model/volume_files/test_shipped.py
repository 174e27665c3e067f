import numpy as np
import pytest

from model.scene.default_tf import default_transfer_function
from model.scene.volume import Volume
from model.volume_files.shipped import (
    first_transfer_function,
    picture_of,
    shipped_volumes,
)


def test_each_volume_in_resources_is_offered_with_a_picture():
    folder = shipped_volumes()[0].parent
    assert set(shipped_volumes()) == set(folder.glob("*.nrrd"))
    assert all(picture_of(path).is_file() for path in shipped_volumes())


def scan(scale=1.0, shift=0.0, noise=20.0):
    """A body of fat about soft tissue about bone in air: HU of known tissues, on another scale."""
    random = np.random.default_rng(0)
    radius = np.linalg.norm(np.indices((64, 64, 64)) - 31.5, axis=0)
    hu = np.select([radius < 9, radius < 20, radius < 26], [800.0, 50.0, -100.0], -1000.0)
    hu += random.normal(0.0, noise, hu.shape) * np.where(radius < 9, 8.0, 1.0)
    return np.clip((hu - shift) * scale, 0 if scale < 1 else -1024, 255 if scale < 1 else 3071)


@pytest.mark.parametrize("units", ["HU", ""])
def test_scans_in_hounsfield_units_show_bone_before_soft_tissue_before_air(units):
    values = np.linspace(-1024, 3071, 4096).astype(np.int16).reshape(16, 16, 16)
    volume = Volume(values, name="scan", units=units)
    opacity = first_transfer_function(volume).opacity
    assert opacity.scalar_range == volume.scalar_range
    air, tissue, contrast, bone = opacity(np.array([-1000.0, 80.0, 280.0, 700.0]))
    assert air == 0 < tissue < 0.05 < contrast < 0.3 < 0.8 < bone


@pytest.mark.parametrize(("scale", "shift"), [(0.1, -1000.0), (0.08, -1100.0), (0.14, -1050.0)])
def test_scans_of_bytes_are_shown_by_the_peaks_of_air_fat_and_soft_tissue(scale, shift):
    volume = Volume(np.rint(scan(scale, shift)).astype(np.uint8))
    opacity = first_transfer_function(volume).opacity
    designed = first_transfer_function(Volume(np.rint(scan()).astype(np.int16), units="HU")).opacity
    for hu in (-1000.0, -500.0, 0.0, 600.0):
        # Peaks are found to about two steps.
        near = designed(np.linspace(hu - 40, hu + 40, 81))
        assert near.min() <= opacity((hu - shift) * scale) <= near.max()


def test_other_volumes_are_shown_by_their_histogram():
    values = np.linspace(-1024, 3071, 4096).astype(np.int16).reshape(16, 16, 16)
    hollow = np.linalg.norm(np.indices((32, 32, 32)) - 15.5, axis=0)
    wall = np.where(np.abs(hollow - 10) < 3, 150.0, 20.0)
    wall += np.random.default_rng(0).normal(0, 5, wall.shape)
    # Of another unit, of fractions, of two materials; in HU, without anything that is dense enough.
    others = (Volume(values, units="K"), Volume(values / 1.5), Volume(wall))
    for volume in (*others, Volume(values // 30, units="HU")):
        assert first_transfer_function(volume) == default_transfer_function(volume)
