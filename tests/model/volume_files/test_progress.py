"""Progress of reading, told slice by slice, and its end."""

import numpy as np
import pytest
import tifffile
from volume_writers import voxels, write_dicom

from model.volume_files import read_volume
from model.volume_files.progress import ReadingCancelledError, watched


@pytest.fixture
def folders(tmp_path):
    write_dicom(tmp_path / "dicom", voxels())
    (tmp_path / "tiff").mkdir()
    for z, plane in enumerate(voxels()):
        tifffile.imwrite(tmp_path / "tiff" / f"{z}.tif", plane)
    return tmp_path


@pytest.mark.parametrize("kind", ["dicom", "tiff"])
def test_every_slice_is_told(folders, kind):
    told = []
    with watched(lambda *progress: told.append(progress)):
        volume = read_volume(folders / kind)
    np.testing.assert_array_equal(volume.voxels, voxels())
    count = len(voxels())
    assert [p for p in told if p[0] == "slices read" and p[2] == count] == [
        ("slices read", done, count) for done in range(count)
    ]
    assert ("files listed", 0, count) in told or kind == "tiff"
    before = len(told)
    read_volume(folders / kind)
    assert len(told) == before


@pytest.mark.parametrize("kind", ["dicom", "tiff"])
def test_a_listener_ends_it(folders, kind):
    def stop(what, done, count):
        if done == 2:
            raise ReadingCancelledError("enough")

    with watched(stop), pytest.raises(ReadingCancelledError):
        read_volume(folders / kind)
