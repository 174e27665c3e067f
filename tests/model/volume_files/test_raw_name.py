from pathlib import Path

import numpy as np
import pytest

from model.volume_files.raw import RawLayout
from model.volume_files.raw_name import guess_layout
from model.volume_files.raw_preview import fit_sentence, preview


@pytest.mark.parametrize(
    ("name", "size", "layout"),
    [
        ("noise_64x16_16bit", 2**16, RawLayout((64, 16, 32), "uint16")),
        ("noise_16-64-32", 2**16, RawLayout((16, 64, 32), "uint16")),
        ("noise_8x64x64_u16_be", 2**16, RawLayout((8, 64, 64), "uint16", "big")),
        ("noise_float", 4 * 30**3, RawLayout((30, 30, 30), "float32")),
        ("noise", 31**3, RawLayout((31, 31, 31), "uint8")),
        ("noise_20", 2 * 20**3, RawLayout((20, 20, 20), "uint16")),
        # Bytes, or doubles.
        ("noise", 32**3, None),
        ("noise_32", 32**3, RawLayout((32, 32, 32), "uint8")),
        ("data_20x24x16_ushort_big", 2 * 20 * 24 * 16, RawLayout((20, 24, 16), "ushort", "big")),
        ("scan_28x20x12_u16", 512 + 2 * 6720, RawLayout((28, 20, 12), "uint16", offset=512)),
        ("scan_28x20x12_u16", 9, RawLayout((28, 20, 12), "uint16")),
        ("scan_28x20x12", 9, None),
        ("scan_00x10", 900, None),
        ("prime", 1009, None),
        ("prime", 0, None),
    ],
)
def test_name_and_size_give_the_layout(name, size, layout):
    assert guess_layout(Path(f"{name}.raw"), size) == layout


def test_previews_are_the_middle_slices_with_z_upwards(tmp_path):
    voxels = np.arange(6 * 7 * 8, dtype=">i4").reshape(6, 7, 8)
    path = tmp_path / "data.raw"
    path.write_bytes(voxels.tobytes())
    layout = RawLayout((8, 7, 6), "int32", "big")
    for axis, expected in enumerate((voxels[::-1, :, 4], voxels[::-1, 3], voxels[3])):
        low, high = np.percentile(expected, (1, 99))
        unit = np.clip((expected - low) / (high - low), 0, 1)
        np.testing.assert_allclose(preview(path, layout, axis), 255 * unit, atol=0.51)


def test_a_preview_leaves_out_voxels_and_shows_what_the_file_lacks_black(tmp_path):
    rows = np.linspace(1, 2, 200, dtype=np.float32)
    voxels = np.broadcast_to(rows[:, None, None], (200, 4, 600))
    path = tmp_path / "data.raw"
    path.write_bytes(voxels.tobytes())
    assert preview(path, RawLayout((600, 4, 200), "float32"), 1).shape == (200, 200)
    longer = preview(path, RawLayout((600, 4, 250), "float32"), 1)
    assert longer.shape == (250, 200)
    assert not longer[:50].any() and longer[50].min() == 255


def test_the_sentence_says_what_would_fit():
    layout = RawLayout((256, 256, 110), "uint8")
    assert fit_sentence(layout, 7_208_960).endswith("which is what the file has.")
    wider = fit_sentence(layout, 2 * 7_208_960)
    assert "14,417,920 bytes" in wider and "too many" in wider
    assert "uint16, or 220 voxels along z" in wider
    assert "too few" in fit_sentence(layout, 256 * 256 * 100)
    assert "100 voxels along z" in fit_sentence(layout, 256 * 256 * 100)
    assert "header" in fit_sentence(layout, 7_208_960 + 352)
