"""Files of climate, microscopy, simulation by program; voxels are 1 + i + 30 j + 600 k."""

import gzip
import json

import h5py
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
import volume_writers as files
import xarray
import zarr
from scipy.io import netcdf_file
from volume_writers import check, named, refused, said, voxels

from model.errors import VolumeError
from model.volume_files import Choice, read_volume
from model.volume_files.source import VolumeSource

FLOATS = voxels("float32")
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
    "npy": named(files.write_npy, ".npy"),
    "npz": named(files.write_npz, ".npz"),
    "hdf5": hdf5,
    "netcdf": netcdf,
    "zarr 2": named(files.write_zarr, ".zarr", 2),
    "zarr 3": named(files.write_zarr, ".zarr", 3),
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "float64"])
def test_one_array(tmp_path, name, dtype):
    if (name, dtype) == ("netcdf", "uint8"):
        dtype = "int8"
    array = voxels(dtype)
    volume = read_volume(WRITERS[name](tmp_path / "a", array))
    check(volume, array, "no voxel spacing", spacing=(1, 1, 1))


@pytest.mark.parametrize("time", [0, 3])
@pytest.mark.parametrize("name", WRITERS)
def test_one_of_several_times(tmp_path, name, time):
    volume = read_volume(WRITERS[name](tmp_path / "a", TIMES), choice=Choice(time=str(time)))
    check(volume, TIMES[time])
    assert [content.kind for content in volume.file.contents] == ["time"] * 4


def test_the_largest_of_several_arrays_that_is_no_mask(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["small"] = FLOATS[:3]
        file["values"] = FLOATS
        file["mask"] = np.ones((8, 9, 10), np.uint8)
        file["curve"] = np.arange(10000)
    volume = read_volume(path)
    check(volume, FLOATS)
    names = [content.name for content in volume.file.contents]
    assert names == ["values", "small", "mask"]
    check(read_volume(path, choice=Choice(array="small")), FLOATS[:3])
    said = "no array 'nothing'; there are values, small, mask"
    refused(path, said, choice=Choice(array="nothing"))


def test_voxel_sizes_in_attributes_of_hdf5(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["values"] = FLOATS
        file["values"].attrs["element_size_um"] = [3.0, 2.0, 0.5]
    check(read_volume(tmp_path / "a.h5"), FLOATS, spacing=(0.5, 2, 3), spacing_unit="um")


def test_nothing_outside_an_hdf5_file_is_read(tmp_path):
    (tmp_path / "secret.raw").write_bytes(FLOATS.tobytes())
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        external = [(str(tmp_path / "secret.raw"), 0, FLOATS.nbytes)]
        file.create_dataset("a", FLOATS.shape, "f4", external=external)
        layout = h5py.VirtualLayout(FLOATS.shape, "f4")
        layout[...] = h5py.VirtualSource(str(tmp_path / "b.h5"), "x", FLOATS.shape)
        file.create_virtual_dataset("b", layout)
        file["c"] = h5py.ExternalLink(str(tmp_path / "b.h5"), "x")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["x"] = FLOATS
    refused(path, "holds no array")


def test_ome_zarr_has_levels_times_channels_and_sizes(tmp_path):
    array = voxels("uint16", (2, 3, 6, 5, 7))
    levels = {"0": array, "1": np.ascontiguousarray(array[..., ::2, ::2, ::2])}
    scales = [files.scaled(1, 1, 3, 2, 0.5), files.scaled(1, 1, 6, 4, 1)]
    omero = {"channels": [{"label": name} for name in ("DAPI", "GFP", "RFP")]}
    place = files.write_ome_zarr(tmp_path / "a.zarr", levels, "tczyx", scales, omero=omero)
    volume = read_volume(place, choice=Choice(time="1", channel="RFP"))
    check(volume, array[1, 2], spacing=(0.5, 2, 3), spacing_unit="um")
    coarse = read_volume(place, choice=Choice(array="1"))
    check(coarse, array[0, 0, ::2, ::2, ::2], spacing=(1, 4, 6))


@pytest.mark.parametrize("dtype", ["int8", "int16", "uint16", "float32", "float16"])
def test_mrc(tmp_path, dtype):
    array = voxels("float32").astype(dtype) if dtype == "float16" else voxels(dtype)
    path = files.write_mrc(tmp_path / "a.mrc", array)
    check(read_volume(path), array, spacing=(0.5, 2, 3), spacing_unit="angstrom")
    (tmp_path / "b.map.gz").write_bytes(gzip.compress(path.read_bytes()))
    check(read_volume(tmp_path / "b.map.gz"), array)


def test_mrc_axes_in_another_order(tmp_path):
    path = files.write_mrc(tmp_path / "a.map", FLOATS, mapc=3, mapr=1, maps=2)
    # The fastest axis of the file is z, then x, then y.
    check(read_volume(path), FLOATS.transpose(2, 0, 1))


def test_mrc_stacks_of_volumes(tmp_path):
    path = files.write_mrc(tmp_path / "a.mrc", FLOATS, ispg=401, mz=3)
    for number in range(2):
        part = FLOATS[3 * number : 3 * number + 3]
        check(read_volume(path, choice=Choice(series=str(number))), part)
    path = files.write_mrc(tmp_path / "b.mrc", FLOATS, ispg=0)
    assert "stack of images" in said(read_volume(path))


def test_arrays_of_objects_and_flat_ones(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}, {}]), allow_pickle=True)
    refused(tmp_path / "a.npy", "Python objects")
    np.save(tmp_path / "b.npy", np.zeros((5, 7)))
    refused(tmp_path / "b.npy", r"none of its arrays is a volume.*b \(7 x 5, float64\)")


@pytest.mark.parametrize(("make", "word"), [
    (lambda f: f.create_dataset("d", data=np.zeros((3, 3, 3), "f4,i4")), "records"),
    (lambda f: f.create_dataset("d", data="text"), "no numbers"),
    (lambda f: f.__setitem__("d", h5py.ExternalLink("other.h5", "x")), "link to another file"),
])  # fmt: skip
def test_hdf5_says_what_it_holds_instead_of_an_array(tmp_path, make, word):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        make(file)
    refused(tmp_path / "a.h5", rf"only d \(.*{word}")


NX, NY, NZ = 28, 20, 12
z, y, x = np.meshgrid(np.arange(NZ), np.arange(NY), np.arange(NX), indexing="ij")
CODED = (1 + x + 30 * y + 600 * z).astype(np.uint16)
SIZE = {"spacing": (0.5, 0.5, 2.0), "spacing_unit": "um"}


# --- climate ------------------------------------------------------------------------------

LON = {"units": "degrees_east", "axis": "X", "standard_name": "longitude"}
LAT = {"units": "degrees_north", "axis": "Y", "standard_name": "latitude"}
LEVEL = {"units": "1", "axis": "Z", "positive": "up"}
METRES = {"units": "m"}
PRESSURE = {"units": "hPa", "axis": "Z", "standard_name": "air_pressure"}
DEPTH = {"units": "m", "axis": "Z", "positive": "down"}


PLAIN = CODED.astype("f4")


def climate(values=PLAIN, dims=("lev", "lat", "lon"), attrs=None, **coordinates):
    """A data set with coordinates, given as (numbers, attributes), along each axis."""
    usual = {
        "lev": (np.arange(NZ), LEVEL),
        "lat": (np.arange(NY), LAT),
        "lon": (np.arange(NX), LON),
    }
    usual |= coordinates
    coords = {name: (name, np.asarray(n, float), a) for name, (n, a) in usual.items()
              if name in dims}  # fmt: skip
    return xarray.Dataset({"t": (dims, values, attrs or {})}, coords)


def encoded(**of_variables):
    return {name: {"_FillValue": None} | encoding for name, encoding in of_variables.items()}


UNEVEN = [1000, 925, 850, 700, 600, 500, 400, 300, 250, 200, 150, 100]
THERE = np.arange(CODED.size).reshape(CODED.shape) % 7 > 0
BARS = np.linspace(1000, 175, NZ)
WRAPPED = (345 + 2.5 * np.arange(NX)) % 360
SQUARE = {"lon": (2.0 * np.arange(NX), METRES), "lat": (2.0 * np.arange(NY), METRES)}
METRIC = SQUARE | {"lev": (4.0 * np.arange(NZ), METRES)}
BYTES = (CODED % 256).astype("u1")
HOLES = np.where(THERE, CODED, np.nan).astype("f4")

CLIMATE = {
    # Data set, encoding, expected values, words of the notes, facts.
    "depth down": (climate(depth=(np.arange(NZ), DEPTH), dims=("depth", "lat", "lon")), {},
        PLAIN[::-1], "'depth' grow downwards; z is read in reverse", {"up": "+z"}),
    "pressure upwards": (climate(lev=(BARS, PRESSURE)), {}, PLAIN, "units of the axes differ", {}),
    "pressure downwards": (climate(lev=(BARS[::-1], PRESSURE)), {}, PLAIN[::-1],
        "'lev' grow downwards", {}),
    "latitude downwards": (climate(**METRIC | {"lat": (-2.0 * np.arange(NY), METRES)}), {},
        PLAIN[:, ::-1], "y is read in reverse", {"spacing": (2, 2, 4), "origin": (0, -38, 0)}),
    "order of dimensions": (climate(PLAIN.transpose(1, 2, 0), ("lat", "lon", "lev")), {},
        PLAIN, "", {}),
    "over the meridian": (climate(lon=(WRAPPED, LON)), {}, PLAIN, "",
        {"spacing": (2.5, 1, pytest.approx(0.2 * 67.5 / 11))}),
    "degrees and metres": (climate(lev=(500.0 * np.arange(NZ), METRES | {"positive": "up"})), {},
        PLAIN, "height is 100% of its width", {"spacing": (1, 1, pytest.approx(27 / 11))}),
    "packed coordinates": (climate(**METRIC),
        encoded(lon={"dtype": "i2", "scale_factor": 0.002, "_FillValue": -1}),
        PLAIN, None, {"spacing": (2, 2, 4), "spacing_unit": "m"}),
    "unsigned bytes": (climate(BYTES.view("i1"), attrs={"_Unsigned": "true"}), {}, BYTES, "", {}),
    "axes c, b, a": (climate(dims=("c", "b", "a")), {}, PLAIN, "no voxel spacing", {}),
    "valid range": (climate(attrs={"valid_min": 9000.0}), {}, PLAIN, "holds none of its values",
        {"missing": None}),
    "packed": (climate(HOLES, **METRIC), encoded(t={"dtype": "i2", "_FillValue": -5,
        "scale_factor": 0.5, "add_offset": 100.0}), HOLES, "The file marks 960 voxels", {}),
    "a valid maximum of packed values": (climate(attrs={"valid_max": np.int16(10000)}, **METRIC),
        encoded(t={"dtype": "i2", "_FillValue": -5, "scale_factor": 0.5, "add_offset": 100.0}),
        np.where(PLAIN <= 5100, PLAIN, np.nan), "as missing", {}),
    "lengths in unlike units": (climate(lev=(3.0 * np.arange(NZ) + 30, {"units": "mm"}),
        lat=(20 - 2.0 * np.arange(NY), {"units": "mm"}),
        lon=(500.0 * np.arange(NX), {"units": "um"})), {}, PLAIN[:, ::-1], "y is read in reverse",
        {"spacing": (500, 2000, 3000), "origin": (0, -18000, 30000), "spacing_unit": "um"}),
    "a fill value of floats": (climate(HOLES, **METRIC), encoded(t={"_FillValue": -999.0}), HOLES,
        "The file marks 960 voxels", {}),
    "a missing value": (climate(PLAIN, attrs={"missing_value": np.float32(1)}, **METRIC), {},
        np.where(PLAIN == 1, np.nan, PLAIN), "The file marks 1 voxels", {}),
    "images over time": (climate(dims=("time", "lat", "lon"), time=(np.arange(NZ), {})), {},
        PLAIN, "calls its images time steps", {}),
    "two components": (climate(np.stack([HOLES, HOLES], -1), ("lev", "lat", "lon", "uv")),
        encoded(t={"dtype": "i2", "_FillValue": -99}), np.hypot(HOLES, HOLES),
        "The file marks 960 voxels", {}),
}  # fmt: skip


def same(volume, array, said, **facts):
    """Compare a volume; NaN are the voxels that must be missing."""
    there = np.isfinite(array)
    assert (volume.missing is None) == there.all()
    if not there.all():
        np.testing.assert_array_equal(volume.missing, ~there)
        array = np.where(there, array, volume.voxels)
    check(volume, array, said, rtol=1e-6, **facts)


@pytest.mark.parametrize("form", ["netcdf4", "netcdf3", "zarr2", "zarr3"])
@pytest.mark.parametrize("case", CLIMATE)
def test_climate(tmp_path, case, form):
    data, encoding, array, said, facts = CLIMATE[case]
    path = tmp_path / ("a.zarr" if form.startswith("zarr") else "a.nc")
    if form.startswith("zarr"):
        data.to_zarr(path, encoding=encoding, zarr_format=int(form[-1]), consolidated=False)
    else:
        engine = {"netcdf4": "h5netcdf", "netcdf3": "scipy"}[form]
        data = data.astype("f4" if data.t.dtype == "u2" else data.t.dtype)
        data.to_netcdf(path, engine=engine, encoding=encoding)
    same(read_volume(path), array, said, **facts)


def test_uneven_levels_are_evened_out(tmp_path):
    data = climate(lev=(UNEVEN, PRESSURE))
    data.to_netcdf(tmp_path / "a.nc", engine="scipy")
    volume = read_volume(tmp_path / "a.nc")
    levels = np.linspace(1000, 100, volume.dimensions[2])
    same(volume, data.t.interp(lev=levels).values, "50 to 150 hPa apart|up to 50 hPa", up="+z")
    climate(lev=(np.arange(NZ) ** 3, METRES)).to_netcdf(tmp_path / "b.nc", engine="scipy")
    refused(tmp_path / "b.nc", "'lev' are 1 to 331 apart, too unlike")


@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "f4", "f8"])
def test_voxels_that_were_never_written(tmp_path, dtype):
    fills = {"i2": -32767, "i4": -2147483647, "f4": 9.969209968386869e36}
    fill = fills.get(dtype, fills["f4"] if dtype == "f8" else -127)
    array = np.where(THERE, CODED % 100.0, fill).astype(dtype)
    climate(array, **METRIC).to_netcdf(tmp_path / "a.nc", engine="scipy", encoding=encoded(t={}))
    expected = array if dtype == "i1" else np.where(THERE, CODED % 100, np.nan)
    same(read_volume(tmp_path / "a.nc"), expected, "")


# --- HDF5 by programs ---------------------------------------------------------------------


def letters(text):
    return np.frombuffer(text.encode(), "S1")


def imaris(file):
    """As Imaris writes it: blocks are padded, and each has a histogram."""
    for channel in range(2):
        group = file.create_group(f"DataSet/ResolutionLevel 0/TimePoint 0/Channel {channel}")
        padded = np.zeros((16, 32, 32), "u2")
        padded[:NZ, :NY, :NX] = CODED + channel
        group.create_dataset("Data", data=padded, chunks=(8, 16, 16), compression="gzip")
        group["Histogram"] = np.arange(256, dtype="u8")
        for axis, n in zip("XYZ", (NX, NY, NZ), strict=True):
            group.attrs[f"ImageSize{axis}"] = letters(str(n))
        info = file.create_group(f"DataSetInfo/Channel {channel}")
        info.attrs["Name"] = letters(("DAPI", "GFP")[channel])
    said = file.create_group("DataSetInfo/Image").attrs
    for axis, extent in enumerate((14, 10, 24)):
        said[f"ExtMin{axis}"], said[f"ExtMax{axis}"] = letters("0.000"), letters(f"{extent:.3f}")
    said["Unit"] = letters("um")


def big_data_viewer(file):
    file["t00000/s00/0/cells"] = (CODED * 8).view("i2")
    file["s00/resolutions"] = np.ones((1, 3))


def ilastik(file):
    file["exported_data"] = np.stack([CODED.T + k for k in range(6)], -1)
    keys = [{"key": key, "resolution": 0} for key in "xyzc"]
    file["exported_data"].attrs["axistags"] = json.dumps({"axes": keys})


def open_pmd(file):
    file.attrs["openPMD"] = np.bytes_("1.1.0")
    file["data/100/fields/rho"] = CODED
    said = file["data/100/fields/rho"].attrs
    said["axisLabels"] = np.array(["z", "y", "x"], "S1")
    said["gridSpacing"], said["gridUnitSI"] = [2.0, 0.5, 0.5], 1e-6


def vtkhdf(kind, direction=(1, 0, 0, 0, 1, 0, 0, 0, 1)):
    def write(file):
        group = file.create_group("VTKHDF")
        group.attrs["Type"] = np.bytes_("ImageData")
        group.attrs["Spacing"], group.attrs["Origin"] = [0.5, 0.5, 2.0], [1.0, 2.0, 3.0]
        group.attrs["WholeExtent"], group.attrs["Direction"] = [0, 0, 0, 0, 0, 0], direction
        group[f"{kind}/density"] = CODED

    return write


def matlab(file):
    file["A"] = CODED.transpose(0, 2, 1)
    file["A"].attrs["MATLAB_class"] = np.bytes_("uint16")


def sparse(file):
    data = file.create_dataset("labels", (NZ, 256, 256), "u2", chunks=(4, 32, 32), fillvalue=7)
    data[:4, :20, :28] = CODED[:4]


SPARSE = np.full((NZ, 256, 256), 7)
SPARSE[:4, :NY, :NX] = CODED[:4]
XML = """<SpimData><ViewSetup><id>0</id><voxelSize><unit>micron</unit><size>0.5 0.5 2.0</size>
</voxelSize></ViewSetup></SpimData>"""
CELLS = {"spacing": (0.5, 0.5, 2), "origin": (1.25, 2.25, 4)}
HDF5 = {
    "imaris.ims": (imaris, CODED, "'DAPI' is read; also there: GFP",
        SIZE | {"origin": (0.25, 0.25, 1)}),
    "bdv.h5": (big_data_viewer, CODED * 8, None, SIZE),
    "ilastik.h5": (ilastik, CODED, "Of 6 channels '0' is read", {}),
    "openpmd.h5": (open_pmd, CODED, None, SIZE),
    "cells.vtkhdf": (vtkhdf("CellData"), CODED, "belong to cells", CELLS),
    "turned.vtkhdf": (vtkhdf("PointData", (0, -1, 0, 1, 0, 0, 0, 0, 1)), CODED, "is turned",
        {"spacing": (0.5, 0.5, 2), "directions": ((0, 1, 0), (-1, 0, 0), (0, 0, 1))}),
    "matlab.mat": (matlab, CODED, "no voxel spacing", {}),
    "sparse.h5": (sparse, SPARSE, "", {}),
}  # fmt: skip


@pytest.mark.parametrize("name", HDF5)
def test_hdf5_of_programs(tmp_path, name):
    write, array, said, facts = HDF5[name]
    path = tmp_path / name
    with h5py.File(path, "w", userblock_size=512 if name.endswith(".mat") else 0) as file:
        write(file)
    (tmp_path / "bdv.xml").write_text(XML)
    check(read_volume(path), array, said, **facts)


def test_texts_of_no_length_are_damage(tmp_path):
    climate(**METRIC).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    data = bytearray((tmp_path / "a.nc").read_bytes())
    place = data.index(b"GCOL\1") + 16
    data[place : place + 16] = bytes(16)
    (tmp_path / "a.nc").write_bytes(data)
    refused(tmp_path / "a.nc", "a text in it has no length")


def test_an_array_that_was_never_written_does_not_spoil_the_others(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["values"] = CODED
        file.create_dataset("later", (NZ, NY, NX), "f4")
    check(read_volume(tmp_path / "a.h5", choice=Choice(array="values")), CODED)
    refused(tmp_path / "a.h5", "every voxel has the value 0", choice=Choice(array="later"))


@pytest.mark.parametrize("name", ["VTKHDF", "DataSetInfo", "ITKImage"])
def test_no_layout_is_taken_from_another_file(tmp_path, name):
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        for write in (imaris, vtkhdf("PointData")):
            write(file)
        file["ITKImage/0/VoxelData"] = CODED
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["values"], file[name] = CODED, h5py.ExternalLink("secret.h5", name)
    volume = read_volume(tmp_path / "a.h5", choice=Choice(array="values"))
    check(volume, CODED, "no voxel spacing", contents=())


def test_hdf5_by_itk_is_where_itk_has_it(tmp_path):
    image = sitk.GetImageFromArray(CODED)
    image.SetSpacing((0.5, 0.5, 2))
    image.SetOrigin((10, 20, 30))
    image.SetDirection((0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1))
    sitk.WriteImage(image, str(tmp_path / "a.h5"))
    volume = read_volume(tmp_path / "a.h5")
    check(volume, CODED, "oblique", spacing=(0.5, 0.5, 2), origin=(10, 20, 30))
    directions = np.array(volume.file.directions).T.ravel()
    np.testing.assert_allclose(directions, image.GetDirection(), atol=1e-12)


@pytest.mark.parametrize("kind", ["OverlappingAMR", "UnstructuredGrid", "FLASH"])
def test_grids_that_are_none_are_named(tmp_path, kind):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        if kind == "FLASH":
            file["dens"], file["refine level"] = np.ones((9, 8, 8, 8)), np.ones(9)
            file["node type"] = np.ones(9)
        else:
            file.create_group("VTKHDF").attrs["Type"] = np.bytes_(kind)
    words = "an unstructured grid" if kind == "UnstructuredGrid" else "an adaptive grid"
    refused(tmp_path / "a.h5", f"{words}.*ParaView")


# --- Zarr, MRC and others -----------------------------------------------------------------


def test_ome_zarr_has_images_before_labels_and_paths_within_groups(tmp_path):
    root = zarr.open_group(str(tmp_path / "a.zarr"), mode="w", zarr_format=2)
    scales = [files.scaled(2, 0.5, 0.5, translation=(30, 20, 10))]
    files.write_ome_zarr(root, {"scale0/image": CODED}, scales=scales)
    nuclei = root.create_group("labels/nuclei")
    files.write_ome_zarr(nuclei, {"s0": CODED // 600}, scales=scales, **{"image-label": {}})
    place = {"origin": (10, 20, 30)}
    check(read_volume(tmp_path / "a.zarr"), CODED, "", **SIZE, **place, is_labels=False)
    labels = read_volume(tmp_path / "a.zarr", choice=Choice(array="labels/nuclei/s0"))
    check(labels, CODED // 600, "", **SIZE, is_labels=True)


@pytest.mark.parametrize("how", ["stamp", "signed stamp", "extremes"])
def test_unsigned_bytes_of_an_mrc(tmp_path, how):
    path = files.write_mrc(tmp_path / "a.mrc", BYTES.view("i1"))
    data = bytearray(path.read_bytes())
    if how == "extremes":
        data[76:84] = np.array([0, 255], "<f4").tobytes()
    else:
        data[152:160] = np.array([1146047817, how == "signed stamp"], "<i4").tobytes()
    path.write_bytes(data)
    check(read_volume(path), BYTES.view("i1") if how == "signed stamp" else BYTES)


@pytest.mark.parametrize(("typed", "z", "stretch", "said"), [
    ({}, 27 / 11, 27 / 5500, "100% of its width"),
    ({"stretch": "0.01"}, 5, 0.01, "0.01 times as long as its spacing says, as you typed"),
    ({"stretch": "1"}, 500, 1, "214 times as long as it is wide"),
    ({"spacing": "1,1,3"}, 3, 1, "the file has 1 x 1 x 500"),
    ({"spacing": "1,1,3", "stretch": "2"}, 6, 2, "2 times as long"),
])  # fmt: skip
def test_z_is_stretched_as_is_typed(tmp_path, typed, z, stretch, said):
    heights = 500.0 * np.arange(NZ), METRES | {"positive": "up"}
    climate(lev=heights).to_netcdf(tmp_path / "a.nc", engine="scipy")
    volume = read_volume(tmp_path / "a.nc", choice=Choice.parse(Choice(**typed).text))
    check(volume, PLAIN, said, spacing=(1, 1, pytest.approx(z)), stretch=pytest.approx(stretch))


@pytest.mark.parametrize("text", ["", "0", "-1", "inf", "1e300", "x"])
def test_a_stretch_that_is_none_is_refused(text):
    with pytest.raises(VolumeError, match="is not a stretch of z"):
        VolumeSource(stretch=text).check()
