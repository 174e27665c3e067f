import gzip

import h5py
import numpy as np
import pytest
from scipy.io import netcdf_file
from volume_writers import (
    check,
    named,
    refused,
    said,
    scaled,
    voxels,
    write_mrc,
    write_npy,
    write_npz,
    write_ome_zarr,
    write_zarr,
)

from model.errors import VolumeError
from model.volume_files import Choice, read_volume

ARRAY = voxels("float32")
TIMES = voxels("int16", (4, 6, 5, 7))


def hdf5(path, array):
    with h5py.File(path.with_suffix(".h5"), "w") as file:
        file.create_dataset("group/values", data=array, compression="gzip")
    return path.with_suffix(".h5")


def netcdf(path, array):
    with netcdf_file(path.with_suffix(".nc"), "w") as file:
        names = "tzyx"[-array.ndim :]
        for name, n in zip(names, array.shape, strict=True):
            file.createDimension(name, n)
        file.createVariable("values", array.dtype, tuple(names))[:] = array
    return path.with_suffix(".nc")


WRITERS = {
    "npy": named(write_npy, ".npy"),
    "npz": named(write_npz, ".npz"),
    "hdf5": hdf5,
    "netcdf": netcdf,
    "zarr 2": named(write_zarr, ".zarr", 2),
    "zarr 3": named(write_zarr, ".zarr", 3),
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "float64"])
def test_one_array(tmp_path, name, dtype):
    if (name, dtype) == ("netcdf", "uint8"):
        dtype = "int8"
    array = voxels(dtype)
    volume = read_volume(WRITERS[name](tmp_path / "a", array))
    check(volume, array)
    assert volume.spacing == (1, 1, 1)
    assert "no voxel spacing" in said(volume)


@pytest.mark.parametrize("time", [0, 3])
@pytest.mark.parametrize("name", WRITERS)
def test_one_of_several_times(tmp_path, name, time):
    volume = read_volume(WRITERS[name](tmp_path / "a", TIMES), choice=Choice(time=str(time)))
    check(volume, TIMES[time])
    assert [content.kind for content in volume.file.contents] == ["time"] * 4


def test_the_largest_of_several_arrays_that_is_no_mask(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["small"] = ARRAY[:3]
        file["values"] = ARRAY
        file["mask"] = np.ones((8, 9, 10), np.uint8)
        file["curve"] = np.arange(10000)
    volume = read_volume(path)
    check(volume, ARRAY)
    names = [content.name for content in volume.file.contents]
    assert names == ["values", "small", "mask"]
    check(read_volume(path, choice=Choice(array="small")), ARRAY[:3])
    refused(
        path, "no array 'nothing'; there are values, small, mask", choice=Choice(array="nothing")
    )


def test_voxel_sizes_in_attributes_of_hdf5(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["values"] = ARRAY
        file["values"].attrs["element_size_um"] = [3.0, 2.0, 0.5]
    volume = read_volume(tmp_path / "a.h5")
    assert (volume.spacing, volume.file.spacing_unit) == ((0.5, 2, 3), "um")


def test_nothing_outside_an_hdf5_file_is_read(tmp_path):
    (tmp_path / "secret.raw").write_bytes(ARRAY.tobytes())
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        external = [(str(tmp_path / "secret.raw"), 0, ARRAY.nbytes)]
        file.create_dataset("a", ARRAY.shape, "f4", external=external)
        layout = h5py.VirtualLayout(ARRAY.shape, "f4")
        layout[...] = h5py.VirtualSource(str(tmp_path / "b.h5"), "x", ARRAY.shape)
        file.create_virtual_dataset("b", layout)
        file["c"] = h5py.ExternalLink(str(tmp_path / "b.h5"), "x")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["x"] = ARRAY
    refused(path, "holds no array")


def test_ome_zarr_has_levels_times_channels_and_sizes(tmp_path):
    array = voxels("uint16", (2, 3, 6, 5, 7))
    levels = {"0": array, "1": np.ascontiguousarray(array[..., ::2, ::2, ::2])}
    scales = [scaled(1, 1, 3, 2, 0.5), scaled(1, 1, 6, 4, 1)]
    place = write_ome_zarr(tmp_path / "a.zarr", levels, "tczyx", scales)
    volume = read_volume(place, choice=Choice(time="1", channel="2"))
    check(volume, array[1, 2], spacing=(0.5, 2, 3), spacing_unit="um")
    coarse = read_volume(place, choice=Choice(array="1"))
    check(coarse, array[0, 0, ::2, ::2, ::2], spacing=(1, 4, 6))


def test_channels_have_the_names_of_ome_zarr(tmp_path):
    array = np.stack([voxels(), voxels() + 1])
    omero = {"channels": [{"label": "DAPI"}, {"label": "GFP"}]}
    place = write_ome_zarr(tmp_path / "a.zarr", {"0": array}, "czyx", omero=omero)
    check(read_volume(place, choice=Choice(channel="GFP")), array[1])


@pytest.mark.parametrize("dtype", ["int8", "int16", "uint16", "float32", "float16"])
def test_mrc(tmp_path, dtype):
    array = voxels("float32").astype(dtype) if dtype == "float16" else voxels(dtype)
    path = write_mrc(tmp_path / "a.mrc", array)
    volume = read_volume(path)
    check(volume, array)
    assert volume.spacing == pytest.approx((0.5, 2, 3))
    assert volume.file.spacing_unit == "angstrom"
    (tmp_path / "b.map.gz").write_bytes(gzip.compress(path.read_bytes()))
    check(read_volume(tmp_path / "b.map.gz"), array)


def test_mrc_axes_in_another_order(tmp_path):
    path = write_mrc(tmp_path / "a.map", ARRAY, mapc=3, mapr=1, maps=2)
    volume = read_volume(path)
    # The fastest axis of the file is z, then x, then y.
    check(volume, ARRAY.transpose(2, 0, 1))


def test_mrc_stacks_of_volumes(tmp_path):
    path = write_mrc(tmp_path / "a.mrc", ARRAY, ispg=401, mz=3)
    for number in range(2):
        volume = read_volume(path, choice=Choice(series=str(number)))
        check(volume, ARRAY[3 * number : 3 * number + 3])
    path = write_mrc(tmp_path / "b.mrc", ARRAY, ispg=0)
    assert "stack of images" in said(read_volume(path))


def test_arrays_of_objects_and_flat_ones(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}, {}]), allow_pickle=True)
    refused(tmp_path / "a.npy", "Python objects")
    np.save(tmp_path / "b.npy", np.zeros((5, 7)))
    refused(tmp_path / "b.npy", r"none of its arrays is a volume.*b \(7 x 5, float64\)")


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_is_cut_is_refused(tmp_path, name):
    path = WRITERS[name](tmp_path / "a", ARRAY)
    files = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file())
    for file in files:
        whole = file.read_bytes()
        for share in (0.1, 0.5, 0.9, 0.99):
            file.write_bytes(whole[: int(share * len(whole))])
            with pytest.raises(VolumeError):
                check(read_volume(path), ARRAY)
        file.write_bytes(whole)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda f: f.create_dataset("d", data=np.zeros((3, 3, 3), "f4,i4")), "records"),
        (lambda f: f.create_dataset("d", data="text"), "no numbers"),
        (lambda f: f.__setitem__("d", h5py.ExternalLink("other.h5", "x")), "link to another file"),
    ],
)
def test_hdf5_says_what_it_holds_instead_of_an_array(tmp_path, make, word):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        make(file)
    refused(tmp_path / "a.h5", rf"only d \(.*{word}")


def test_numbers_wider_than_64_bits_become_64(tmp_path):
    np.save(tmp_path / "a.npy", voxels("float32").astype(np.longdouble))
    volume = read_volume(tmp_path / "a.npy")
    assert volume.voxels.dtype == np.float64
    check(volume, voxels("float32"))
