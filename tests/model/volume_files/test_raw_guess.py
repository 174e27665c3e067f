from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from model.scene.volume import Volume
from model.volume_files.raw import RawLayout
from model.volume_files.raw_guess import guess_layouts
from model.volume_files.raw_name import NameFacts, facts_of
from model.volume_files.raw_preview import fit_sentence, preview


def body(dimensions: tuple[int, int, int]) -> NDArray[np.float64]:
    """A noisy ellipsoid with waves in it, shape (nz, ny, nx), about 0..1."""
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in dimensions[::-1]), indexing="ij")
    inside = (x / 0.8) ** 2 + (y / 0.6) ** 2 + (z / 0.9) ** 2 < 1
    waves = 0.6 + 0.2 * np.sin(7 * x + 3 * y) + 0.1 * np.cos(9 * z - 4 * y)
    return inside * waves + np.random.default_rng(3).uniform(0, 0.03, inside.shape)


def write(path: Path, voxels: NDArray[np.generic]) -> Path:
    path.write_bytes(voxels.tobytes())
    return path


@pytest.mark.parametrize(
    ("dimensions", "dtype", "offset"),
    [
        ((64, 64, 40), "u1", 0),
        ((40, 64, 64), ">u2", 0),
        ((60, 48, 32), "<i2", -1000),
        ((50, 40, 33), ">f4", -0.4),
        ((32, 32, 64), "<f8", 300),
    ],
)
def test_the_values_tell_dimensions_type_and_byte_order(
    tmp_path: Path, dimensions: tuple[int, int, int], dtype: str, offset: float
) -> None:
    scale = {"u1": 200, ">f4": 1}.get(dtype, 3000)
    voxels = (body(dimensions) * scale + offset).astype(dtype)
    best = guess_layouts(write(tmp_path / "data.raw", voxels))[0]
    assert (best.dimensions, best.dtype) == (dimensions, np.dtype(dtype))


def test_every_guess_needs_exactly_the_files_bytes(tmp_path: Path) -> None:
    path = write(tmp_path / "data.raw", np.zeros(2 * 3 * 5 * 7 * 2**9, np.uint8))
    guesses = guess_layouts(path)
    assert 1 < len(guesses) == len(set(guesses))
    for layout in guesses:
        assert np.prod(layout.dimensions) * layout.dtype.itemsize == path.stat().st_size


@pytest.mark.parametrize(
    ("name", "dimensions", "dtype"),
    [
        ("noise_32.raw", (32, 32, 32), "u2"),
        ("noise_64x16_16bit.raw", (64, 16, 32), "u2"),
        ("noise_16-64-32.raw", (16, 64, 32), "u2"),
        ("noise_f32.raw", None, "f4"),
        ("noise_8x64x64_u16_be.raw", (8, 64, 64), ">u2"),
    ],
)
def test_the_name_counts_more_than_the_values(
    tmp_path: Path, name: str, dimensions: tuple[int, int, int] | None, dtype: str
) -> None:
    values = np.random.default_rng(0).uniform(1, 2, 2**14).astype("f4")
    best = guess_layouts(write(tmp_path / name, values))[0]
    assert dimensions is None or best.dimensions == dimensions
    # Without its name the file is one of float32.
    assert best.dtype.itemsize == np.dtype(dtype).itemsize
    if ">" in dtype:
        assert best.byte_order == "big"


def test_a_name_that_does_not_fit_is_the_last_guess(tmp_path: Path) -> None:
    path = write(tmp_path / "head_64x64x64_uint8.raw", np.zeros((63, 64, 64), np.uint8))
    guesses = guess_layouts(path)
    assert guesses[-1] == RawLayout((64, 64, 64), "uint8")
    assert guesses[0].dimensions == (64, 64, 63)


@pytest.mark.parametrize("size", [1, 63, 1009, 16381])
def test_sizes_of_no_volume_have_no_guess(tmp_path: Path, size: int) -> None:
    assert guess_layouts(write(tmp_path / "prime.raw", np.ones(size, np.uint8))) == []


def test_a_volume_guessed_is_the_volume_written(tmp_path: Path) -> None:
    from model.volume_files import read_volume

    voxels = (body((48, 32, 40)) * 4000).astype(">u2")
    path = write(tmp_path / "data.raw", voxels)
    volume: Volume = read_volume(path, raw=guess_layouts(path)[0])
    np.testing.assert_array_equal(volume.scalars, voxels)


def test_words_of_names() -> None:
    assert facts_of(Path("CT_128_256_256_ushort_be.raw")) == NameFacts(
        (128, 256, 256), (), "uint16", 0, "big"
    )
    assert facts_of(Path("big_foot256.raw")) == NameFacts((), (256,))
    assert facts_of(Path("head-512×512-16bit.raw")) == NameFacts((512, 512), (), "", 16)


def test_previews_are_the_middle_slices_with_z_upwards(tmp_path: Path) -> None:
    voxels = np.arange(6 * 7 * 8, dtype=">i4").reshape(6, 7, 8)
    path = write(tmp_path / "data.raw", voxels)
    layout = RawLayout((8, 7, 6), "int32", "big")
    for axis, expected in enumerate((voxels[::-1, :, 4], voxels[::-1, 3], voxels[3])):
        low, high = np.percentile(expected, (1, 99))
        unit = np.clip((expected - low) / (high - low), 0, 1)
        np.testing.assert_allclose(preview(path, layout, axis), 255 * unit, atol=0.51)


def test_a_preview_leaves_out_voxels_and_shows_what_the_file_lacks_black(tmp_path: Path) -> None:
    rows = np.linspace(1, 2, 200, dtype=np.float32)
    voxels = np.broadcast_to(rows[:, None, None], (200, 4, 600))
    path = write(tmp_path / "data.raw", voxels)
    assert preview(path, RawLayout((600, 4, 200), "float32"), 1).shape == (200, 200)
    longer = preview(path, RawLayout((600, 4, 250), "float32"), 1)
    assert longer.shape == (250, 200)
    assert not longer[:50].any() and longer[50].min() == 255


def test_the_sentence_says_what_would_fit() -> None:
    layout = RawLayout((256, 256, 110), "uint8")
    assert fit_sentence(layout, 7_208_960).endswith("which is what the file has.")
    wider = fit_sentence(layout, 2 * 7_208_960)
    assert "14,417,920 bytes" in wider and "too many" in wider
    assert "uint16, or 220 voxels along z" in wider
    assert "too few" in fit_sentence(layout, 256 * 256 * 100)
    assert "100 voxels along z" in fit_sentence(layout, 256 * 256 * 100)
    assert "header" in fit_sentence(layout, 7_208_960 + 352)
