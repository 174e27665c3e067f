"""Compact volumes: what comes back is what was written, nearly or exactly; damage is told."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.default_tf import default_transfer_function
from model.scene.file_facts import FileFacts
from model.scene.first_picture import first_picture
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.compact import HEAD, VOXELS, ImageError, write_compact
from model.volume_files.voxel_code import Ends, decode_voxels, encode_voxels

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "i8", "f4", "f8"]
ERROR = ImageError(0.004, 0.011, 200)


def smooth(dtype: str, shape: tuple[int, int, int] = (40, 33, 21)) -> NDArray[Any]:
    """A ball of soft shells, in most of a type's range."""
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    wave = np.cos(7 * np.sqrt(x**2 + y**2 + z**2))
    kind = np.dtype(dtype)
    if kind.kind == "f":
        return (1e3 * wave).astype(kind)
    limits = np.iinfo(kind)
    low, high = max(limits.min, -30_000), min(limits.max, 30_000)
    return np.rint(low + (wave + 1) / 2 * (high - low)).astype(kind)


def write(path: Path, voxels: NDArray[Any], bytes_a_voxel: float, **facts: Any) -> Volume:
    volume = Volume(voxels, **facts)
    coded = encode_voxels(voxels, int(bytes_a_voxel * voxels.size))
    write_compact(path, volume, coded, None if coded.is_exact else ERROR)
    return volume


@pytest.mark.parametrize("dtype", TYPES)
def test_voxels_come_back_nearly_and_their_range_exactly(dtype: str, tmp_path: Path) -> None:
    path = tmp_path / "a.tfvolume"
    volume = write(path, smooth(dtype), 0.6)
    copy = read_volume(path)
    lo, hi = volume.data_range
    assert copy.voxels.dtype == volume.voxels.dtype and copy.data_range == (lo, hi)
    errors = (copy.voxels.astype(float) - volume.voxels) / (hi - lo)
    assert np.sqrt(np.square(errors).mean()) < 0.01
    assert path.stat().st_size < 0.6 * volume.voxels.size + 3000


@pytest.mark.parametrize("dtype", TYPES)
def test_where_there_is_room_nothing_is_lost(dtype: str, tmp_path: Path) -> None:
    path = tmp_path / "a.tfvolume"
    volume = write(path, smooth(dtype), 9)
    copy = read_volume(path)
    np.testing.assert_array_equal(copy.voxels, volume.voxels)
    assert "without loss" in copy.notes[0]


@given(
    arrays.arrays(
        st.sampled_from(["u1", "i2", "u4", "i8"]),
        arrays.array_shapes(min_dims=3, max_dims=3, min_side=2, max_side=9),
    )
)
def test_any_whole_numbers_come_back_without_loss(voxels: NDArray[Any]) -> None:
    coded = encode_voxels(voxels, 10 * voxels.nbytes + 100)
    shape = voxels.shape[0], voxels.shape[1], voxels.shape[2]
    back = decode_voxels(coded, shape, voxels.dtype, Ends.of(voxels))
    np.testing.assert_array_equal(back, voxels)


@pytest.mark.parametrize("shape", [(2, 2, 2), (2, 300, 5), (65, 3, 3), (7, 2, 300)])
def test_odd_shapes_are_coded_too(shape: tuple[int, int, int]) -> None:
    voxels = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    coded = encode_voxels(voxels, 2 * voxels.size)
    back = decode_voxels(coded, shape, voxels.dtype, Ends.of(voxels))
    assert coded.method == "sperr" and back.shape == shape
    assert np.abs(back - voxels).max() < 0.3


def test_all_that_a_volume_has_comes_back(tmp_path: Path) -> None:
    voxels = smooth("i2")
    missing = voxels > 25_000
    voxels[missing] = voxels[~missing].min()
    directions = ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    path = tmp_path / "a.tfvolume"
    volume = write(
        path,
        voxels,
        0.7,
        spacing=(0.5, 0.5, 2.0),
        origin=(-10.0, 4.0, 7.5),
        name="head",
        units="HU",
        notes=("It was sheared.",),
        axis_labels=("L", "R", "P", "A", "S", "I"),
        file=FileFacts("DICOM", "mm", directions, "LPS"),
        missing=missing,
    )
    copy = read_volume(path)
    assert copy.missing is not None
    np.testing.assert_array_equal(copy.missing, missing)
    for name in ("spacing", "origin", "units", "axis_labels"):
        assert getattr(copy, name) == getattr(volume, name)
    assert copy.file.is_lossy
    facts = replace(copy.file, format="DICOM", is_lossy=False, up="", image_error=None)
    assert facts == volume.file and copy.up == "+z"
    assert copy.notes[1] == "It was sheared." and copy.data_range == volume.data_range
    assert "of head: " in copy.notes[0] and "image error 0.004, largest 0.011" in copy.notes[0]


def test_it_is_shown_at_first_as_it_was_saved(tmp_path: Path) -> None:
    voxels = smooth("u1")
    volume = Volume(voxels).over((20.0, 200.0))
    tf, view = default_transfer_function(volume), View(10.0, 20.0, 5.0, 0.7)
    path = tmp_path / "a.tfvolume"
    write_compact(path, volume, encode_voxels(voxels, voxels.size), tf=tf, view=view, up="-y")
    copy = read_volume(path)
    shown, first = first_picture(copy)
    assert shown.scalar_range == (20.0, 200.0) and first == tf
    assert copy.file.view == view and copy.up == "-y"


def test_what_would_leave_nothing_is_refused() -> None:
    voxels = np.random.default_rng(0).integers(0, 255, (64, 64, 64), dtype=np.uint8)
    with pytest.raises(VolumeError, match="give at least"):
        encode_voxels(voxels, 100)


def rewritten(path: Path, change: Any) -> Path:
    """The archive with its head, or its voxels, changed; its own checksums are right."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts = change(parts)
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in parts.items():
            archive.writestr(name, data)
    return path


def with_head(**changes: Any) -> Any:
    def change(parts: dict[str, bytes]) -> dict[str, bytes]:
        head = json.loads(parts[HEAD]) | changes
        return {**parts, HEAD: json.dumps(head).encode()}

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda parts: {**parts, VOXELS: parts[VOXELS][:-9]}, "'voxels' is not what was written"),
        (lambda parts: {VOXELS: parts[VOXELS]}, "it has no 'volume.json'"),
        (lambda parts: {HEAD: parts[HEAD]}, "'voxels' is not what was written"),
        (with_head(dimensions=[22, 33, 40]), "of other dimensions"),
        (with_head(dimensions=[2, 33, 0]), "malformed"),
        (with_head(dimensions=[1 << 20, 1 << 20, 1 << 20]), "memory"),
        (with_head(dimensions=[400, 330, 210]), "too few bytes"),
        (with_head(type="complex64"), "contradicts itself"),
        (with_head(type="no type"), "malformed"),
        (with_head(ends={"values": [0, 300], "places": [0, 1]}), "contradicts itself"),
        (with_head(ends={"values": [0, 200], "places": [0, 1 << 40]}), "contradicts itself"),
        (with_head(tf={"tfscope_tf": "x"}), "TF is malformed"),
        (with_head(view={"azimuth": 1, "elevation": 900, "roll": 0, "distance": 1}), "malformed"),
        (with_head(up="north"), "contradicts itself"),
        (with_head(tfscope_volume=9), "update tfscope"),
    ],
)
def test_what_is_not_as_it_was_written_is_refused(
    change: Any, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.tfvolume"
    write(path, smooth("u1"), 0.3)
    with pytest.raises(VolumeError, match=message) as caught:
        read_volume(rewritten(path, change))
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("stored", [1e30, -1e20, 0.0])
def test_what_is_stored_where_nothing_was_measured_spoils_nothing(
    stored: float, tmp_path: Path
) -> None:
    voxels = smooth("f4")
    missing = np.random.default_rng(0).random(voxels.shape) < 0.3
    volume = Volume(np.where(missing, np.float32(stored), voxels), missing=missing)
    path = tmp_path / "a.tfvolume"
    write_compact(path, volume, encode_voxels(volume.voxels, voxels.size, missing), ERROR)
    copy = read_volume(path)
    lo, hi = volume.data_range
    assert copy.missing is not None and (copy.missing == missing).all()
    errors = (copy.voxels.astype(float) - voxels)[~missing] / (hi - lo)
    assert np.abs(errors).max() < 0.01


def test_a_copy_knows_how_wrong_its_images_are(tmp_path: Path) -> None:
    write(tmp_path / "a.tfvolume", smooth("u1"), 0.3)
    write(tmp_path / "b.tfvolume", smooth("u1"), 9)
    assert read_volume(tmp_path / "a.tfvolume").file.image_error == ERROR.rmse
    assert read_volume(tmp_path / "b.tfvolume").file.image_error is None
