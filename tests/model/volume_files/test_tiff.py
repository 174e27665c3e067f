"""TIFF files of many programs: axes, types, voxel sizes and calibrations, against tifffile."""

from pathlib import Path

import numpy as np
import pytest
import tifffile
from volume_writers import SPACING, check, refused, said, voxels, write_tiff

from model.scene.volume import Caution
from model.volume_files import Choice, read_volume

CASES = Path(__file__).parent / "cases"


def whole(path):
    """All that tifffile makes of a file."""
    return tifffile.imread(path)


def ome_text(path):
    with tifffile.TiffFile(path) as tiff:
        return tiff.ome_metadata


def test_calibrated_by_imagej(tmp_path):
    description = "ImageJ=1.54\nimages=6\nslices=6\nspacing=3.0\nunit=um\n"
    path = write_tiff(tmp_path / "a.tif", voxels(), description=description, resolution=(2, 0.5))
    check(read_volume(path), voxels(), spacing=SPACING, origin=(0, 0, 0))


def test_channels_have_the_names_of_ome(tmp_path):
    array = np.stack([voxels(), voxels() + 1])
    names = ["DAPI", "GFP"]
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, array, ome=True, metadata={"axes": "CZYX", "Channel": {"Name": names}})
    volume = read_volume(path, choice=Choice(channel="gfp"))
    check(volume, array[1])
    assert [content.name for content in volume.file.contents] == names
    refused(path, "there are DAPI, GFP", choice=Choice(channel="RFP"))


BYTES = voxels("uint8")
LINE = "ImageJ=1.54\nimages=6\nslices=6\ncf={}\nc0=-10.0\nc1=0.5\nvunit=K\n"
# The OME header has a unit for each axis.
SIZES = {
    "PhysicalSizeX": 500, "PhysicalSizeXUnit": "nm", "PhysicalSizeY": 0.5,
    "PhysicalSizeYUnit": "µm", "PhysicalSizeZ": 0.002, "PhysicalSizeZUnit": "mm",
}  # fmt: skip
WRITTEN = {
    "inches": ({"resolution": (72, 72), "resolutionunit": "INCH"}, "72 pixels per inch", {}),
    "line": ({"description": LINE.format(0), "metadata": None}, "", {"units": "K"}),
    "curve": ({"description": LINE.format(3), "metadata": None}, "calibration curve", {}),
    "times": ({"imagej": True, "metadata": {"axes": "TYX"}}, "calls its images time steps", {}, ),
    "unlike units": ({"ome": True, "metadata": {"axes": "ZYX", **SIZES}},
        "", {"spacing": (500, 500, 2000), "spacing_unit": "nm"},
    ),
    "another description": (
        {"description": "ImageJ=1.53t\nimages=90\nslices=90\n", "metadata": None},
        "does not fit", {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRITTEN)
def test_what_descriptions_and_tags_say(tmp_path, name):
    options, said, facts = WRITTEN[name]
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, BYTES, photometric="minisblack", **options)
    check(read_volume(path), BYTES * 0.5 - 10 if name == "line" else BYTES, said, **facts)


@pytest.mark.parametrize(("file", "spacing", "unit", "said"), [
    ("b_depth_1.tif", (0.25, 0.25, 1), "um", ""), ("f_ome.ome.tif", (0.25, 0.25, 2), "um", ""),
    ("one_ifd.tif", (0.5, 0.5, 2), "um", ""),
    ("lut_green.tif", (0.5, 0.5, 2), "um", "look-up table"),
    ("imagej_2channels.tif", (0.5, 0.5, 2), "um", ""),
    ("ome_xyczt.ome.tif", (0.5, 0.5, 2), "um", ""),
    ("numpy_4d.tif", (1, 1, 1), "", "no voxel spacing"), ("signed16.tif", (0.5, 0.5, 2), "", ""),
    ("miniswhite.tif", (1, 1, 1), "", "no voxel spacing|0 is white"),
])  # fmt: skip
def test_files_of_other_programs(file, spacing, unit, said):
    volume, array = read_volume(CASES / "tiff" / file), whole(CASES / "tiff" / file).astype(int)
    while array.ndim > 3:
        # The first channel, or time.
        array = array.take(0, axis=int(np.argmin(array.shape)))
    less = 32768 if file.startswith("signed") else 0
    check(volume, array - less, said, spacing=spacing, spacing_unit=unit)
    assert ("no voxel spacing" in " ".join(volume.notes)) == ("no voxel spacing" in said)


STORAGE = {
    "contiguous": {},
    "zlib": {"compression": "zlib"},
    "tiled": {"tile": (16, 16)},
    "bigtiff": {"bigtiff": True},
    "big endian": {"byteorder": ">"},
}
STORED = ["uint8", "int16", "float16", "float32", "float64", "int64", "uint64", "bool"]


@pytest.mark.parametrize("kind", STORAGE)
@pytest.mark.parametrize("dtype", STORED)
def test_types_and_storage(tmp_path, dtype, kind):
    small = np.abs(np.random.default_rng(3).normal(0, 9, (6, 32, 48)))
    few = {"bool": small > 9, "float16": small.astype("f2")}
    array = few[dtype] if dtype in few else voxels(dtype, small.shape)
    options = dict(STORAGE[kind])
    if kind == "zlib":
        options["predictor"] = dtype in ("uint8", "int16")
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, array, photometric="minisblack", **options)
    volume = read_volume(path)
    check(volume, array)
    assert volume.voxels.dtype.isnative


@pytest.mark.parametrize("time", [0, 2])
@pytest.mark.parametrize("channel", [0, 1])
def test_times_and_channels_by_imagej(tmp_path, time, channel):
    array = voxels("uint16", (3, 4, 2, 5, 7))
    path, metadata = tmp_path / "a.tif", {"axes": "TZCYX", "spacing": 3, "unit": "mm"}
    tifffile.imwrite(path, array, imagej=True, resolution=(2, 2), metadata=metadata)
    volume = read_volume(path, choice=Choice(time=str(time), channel=str(channel)))
    check(volume, array[time, :, channel], spacing=(0.5, 0.5, 3), spacing_unit="mm")
    kinds = [content.kind for content in volume.file.contents]
    assert kinds == ["time"] * 3 + ["channel"] * 2


def test_ome_images_are_series_and_thumbnails_are_left_out(tmp_path):
    path = tmp_path / "a.ome.tif"
    small, large = voxels("uint8", (4, 5, 7)), voxels("uint8", (6, 10, 14))
    with tifffile.TiffWriter(path, ome=True) as writer:
        writer.write(small, metadata={"axes": "ZYX", "Name": "overview", "PhysicalSizeX": 9.0})
        writer.write(large, metadata={"axes": "ZYX", "Name": "detail", "PhysicalSizeX": 3.0})
        writer.write(large[0], metadata={"axes": "YX", "Name": "label"})
    said = "Flat images were left out: 1"
    check(read_volume(path), large, said, spacing=(3, 3, 3))
    other = read_volume(path, choice=Choice(series="overview"))
    check(other, small, spacing=(9, 9, 9))


def test_a_declared_value_of_no_data_is_missing(tmp_path):
    array = voxels("float32")
    array[2, 3, 4] = -9999
    path = tmp_path / "a.tif"
    nodata = (42113, 2, 0, "-9999", True)
    tifffile.imwrite(path, array, extratags=[nodata], photometric="minisblack")
    volume = read_volume(path)
    assert "The file marks 1 voxels" in said(volume)
    assert volume.data_range[0] > -9999


def test_folders_of_slices():
    volume = read_volume(CASES / "folder" / "gap")
    [note] = (note for note in volume.notes if isinstance(note, Caution))
    assert note.startswith("Slices are missing: 7 and 8")
    assert volume.dimensions == (28, 20, 10)
    folder, names = CASES / "folder" / "two_channels", []
    for number in range(2):
        names.append(f"fused_ch0{number}_z*.tif")
        volume = read_volume(folder, choice=Choice(series=str(number)))
        check(volume, np.stack([whole(path) for path in sorted(folder.glob(names[-1]))]))
    assert [content.name for content in volume.file.contents] == names


@pytest.mark.parametrize(("names", "order"), [
    (["z-10", "z-5", "z0", "z5"], ["z-10", "z-5", "z0", "z5"]),
    (["s-10", "s-9", "s-8"], ["s-8", "s-9", "s-10"]),
    (["b10_123", "b9_456", "b1_789"], ["b1_789", "b9_456", "b10_123"]),
    (["top", "middle", "bottom"], ["bottom", "middle", "top"]),
    (["2024-01-02_7", "2024-01-02_12"], ["2024-01-02_7", "2024-01-02_12"]),
])  # fmt: skip
def test_the_order_of_names(tmp_path, names, order):
    for number, name in enumerate(order):
        tifffile.imwrite(tmp_path / f"{name}.tif", np.arange(20, dtype="u1").reshape(4, 5) + number)
    (tmp_path / f"._{names[0]}.tif").write_bytes(b"\0\5\x16\7 of Finder")
    volume = read_volume(tmp_path)
    assert volume.voxels[:, 0, 0].tolist() == list(range(len(names)))


def test_a_folder_of_stacks_is_several_volumes(tmp_path):
    stacks = {f"t{k}.tif": voxels("uint8", (4 + k, 5, 7)) for k in range(3)}
    for name, array in stacks.items():
        tifffile.imwrite(tmp_path / name, array, photometric="minisblack")
    volume = read_volume(tmp_path, choice=Choice(series="t2.tif"))
    check(volume, stacks["t2.tif"])
    assert len(volume.file.contents) == 3


def test_pages_outside_the_folder_are_not_read(tmp_path):
    inside, outside = tmp_path / "sub" / "a.ome.tif", tmp_path / "secret.ome.tif"
    inside.parent.mkdir()
    for path in (inside, outside):
        tifffile.imwrite(path, voxels("uint8"), metadata={"axes": "ZYX"})
    uuid = ome_text(outside).split('UUID="')[1].split('"')[0]
    text = ome_text(inside)
    assert uuid not in text
    planes = f'<TiffData IFD="0" PlaneCount="6"><UUID FileName="../secret.ome.tif">{uuid}</UUID>'
    text = text.replace("</Pixels>", f"{planes}</TiffData></Pixels>")
    start, _, rest = text.partition("<TiffData")
    tail = rest[rest.index("<TiffData") :]
    description = (start + tail).encode()
    tifffile.imwrite(inside, voxels("uint8"), description=description, metadata=None, ome=False)
    refused(inside, "lie outside its folder")
