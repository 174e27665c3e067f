from pathlib import Path

import numpy as np
import pytest
from volume_writers import voxels, write_itk, write_legacy, write_vti

from model.volume_files import read_volume
from model.volume_files.finish import suspected_fills

CASES = Path(__file__).parent / "cases" / "missing"


def test_a_fill_value_that_the_file_does_not_declare_is_told_and_kept():
    volume = read_volume(CASES / "air_and_minus9999.vti")
    assert volume.missing is None and volume.data_range == (-9999, 240)
    assert "-9999 lies far from all other values, and many voxels have it" in volume.notes[0]


@pytest.mark.parametrize("bad", [[np.nan], [np.nan, np.inf, -np.inf, np.nan]])
@pytest.mark.parametrize(
    ("suffix", "write"),
    [(".nrrd", write_itk), (".nii", write_itk), (".vti", write_vti), (".vtk", write_legacy)],
)
def test_bad_voxels_are_counted(tmp_path, suffix, write, bad):
    array = voxels("float32")
    array.ravel()[3 : 3 + len(bad)] = bad
    volume = read_volume(write(tmp_path / f"a{suffix}", array))
    good = np.isfinite(array)
    np.testing.assert_array_equal(volume.voxels[good], array[good])
    assert volume.data_range == (array[good].min(), array[good].max())
    (note,) = volume.notes
    assert note.startswith(f"{len(bad)} NaN or infinite voxel")


def body(dtype, low=0.0, high=240.0, size=24):
    axis = np.linspace(-1, 1, size)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    ball = np.clip(1.2 - np.sqrt(x * x + y * y + z * z), 0, 1)
    noise = np.random.default_rng(5).normal(0, 0.02, ball.shape)
    return (low + (high - low) * np.clip(ball + noise, 0, 1)).astype(dtype)


@pytest.mark.parametrize(
    ("dtype", "fills"),
    [
        ("float32", [-9999]), ("float32", [-9999, 1e5]), ("float32", [9.96921e36]),
        ("int16", [-32768]), ("uint16", [65535]),
    ],
)  # fmt: skip
def test_values_far_away(dtype, fills):
    array = body(dtype)
    for number, fill in enumerate(fills):
        array[number:12:4] = fill
    assert suspected_fills(array, None)[-1:] == pytest.approx(fills[-1:], rel=1e-6)


@pytest.mark.parametrize(
    "make",
    [
        lambda: body("float32"),
        lambda: body("int16", -1000, 3000),
        # Metal that the scanner's range cuts off.
        lambda: np.where(np.arange(24) > 21, np.int16(3071), body("int16", -1000, 1500)),
        # A long tail that is cut off, as where metal saturates a detector.
        lambda: np.minimum(
            np.exp(np.random.default_rng(2).normal(0, 3.5, (24, 24, 24))), 60000
        ).astype(np.uint16),
        # Labels, and two phases.
        lambda: np.random.default_rng(1).integers(0, 5, (24, 24, 24)).astype(np.int16) * 1000,
        lambda: np.where(body("float32") > 100, 1000.0, 0.0),
        # Bytes have no room for fill values.
        lambda: np.where(body("uint8") > 200, 255, body("uint8", 0, 20)).astype(np.uint8),
        # Air around, and a few hot pixels.
        lambda: np.where(body("float32") < 100, 0.0, body("float32")),
        lambda: np.where(np.arange(24**3).reshape(24, 24, 24) == 7, 1e6, body("float32")),
    ],
)
def test_values_that_are_not_far_away(make):
    assert suspected_fills(make(), None) == []
