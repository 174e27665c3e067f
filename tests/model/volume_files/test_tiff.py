"""TIFF files of many programs: axes, types, voxel sizes and calibrations, against tifffile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tifffile
from volume_writers import voxels

from model.errors import VolumeError
from model.volume_files import Choice, read_volume

CASES = Path(__file__).parent / "cases"


def whole(path):
    """All that tifffile makes of a file."""
    return tifffile.imread(path)


def ome_text(path):
    with tifffile.TiffFile(path) as tiff:
        return tiff.ome_metadata


def described(volume):
    return " ".join(volume.notes)


def imagej(path, array, axes, **metadata):
    resolution = metadata.pop("resolution", (2.0, 2.0))
    tifffile.imwrite(
        path, array, imagej=True, resolution=resolution, metadata={"axes": axes, **metadata}
    )
    return path


def test_channels_have_the_names_of_ome(tmp_path):
    array = np.stack([voxels(), voxels() + 1])
    names = ["DAPI", "GFP"]
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, array, ome=True, metadata={"axes": "CZYX", "Channel": {"Name": names}})
    volume = read_volume(path, choice=Choice(channel="gfp"))
    np.testing.assert_array_equal(volume.voxels, array[1])
    assert [content.name for content in volume.file.contents] == names
    with pytest.raises(VolumeError, match="there are DAPI, GFP"):
        read_volume(path, choice=Choice(channel="RFP"))


def test_descriptions_that_cannot_be_used_are_said(tmp_path):
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, np.stack([voxels(), voxels()]), ome=True, metadata={"axes": "CZYX"})
    path.write_bytes(path.read_bytes().replace(b"</OME>", b"</OMX>"))
    assert "OME header is damaged" in described(read_volume(path))
    text = "ImageJ=1.53t\nimages=90\nslices=90\n"
    tifffile.imwrite(path, voxels(), description=text, metadata=None)
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, voxels())
    assert "does not fit" in described(volume)


@pytest.mark.parametrize("part", [0.4, 0.6, 0.9])
def test_a_file_that_lost_its_end_says_so(tmp_path, part):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, voxels(), compression="lzw")
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(VolumeError, match="truncated"):
        read_volume(path)


def test_a_resolution_for_print_is_said_to_be_left_out(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, voxels(), resolution=(72, 72), resolutionunit="INCH")
    assert "72 pixels per inch" in described(read_volume(path))


@pytest.mark.parametrize(
    ("file", "dimensions", "spacing", "unit", "value_range"),
    [
        ("b_depth_1.tif", (28, 20, 12), (0.25, 0.25, 1), "um", (20, 240)),
        ("f_ome.ome.tif", (28, 20, 12), (0.25, 0.25, 2), "um", (20, 240)),
        ("one_ifd.tif", (28, 20, 12), (0.5, 0.5, 2), "um", (200, 2400)),
        ("lut_green.tif", (28, 20, 12), (0.5, 0.5, 2), "um", (20, 240)),
        ("imagej_2channels.tif", (28, 20, 12), (0.5, 0.5, 2), "um", (200, 2400)),
        ("ome_xyczt.ome.tif", (28, 20, 12), (0.5, 0.5, 2), "um", (200, 2400)),
        ("numpy_4d.tif", (28, 20, 12), (1, 1, 1), "", (200, 2400)),
        ("signed16.tif", (28, 20, 12), (0.5, 0.5, 2), "", (-800, 1400)),
        ("miniswhite.tif", (28, 20, 12), (1, 1, 1), "", (15, 235)),
    ],
)
def test_files_of_other_programs(file, dimensions, spacing, unit, value_range):
    volume = read_volume(CASES / "tiff" / file)
    assert volume.dimensions == dimensions
    assert volume.spacing == pytest.approx(spacing)
    assert volume.file.spacing_unit == unit
    assert volume.data_range == value_range
    assert ("no voxel spacing" in described(volume)) == (unit == "" and spacing == (1, 1, 1))


@pytest.mark.parametrize("channel", [None, "0", "1"])
@pytest.mark.parametrize("file", ["imagej_2channels.tif", "ome_xyczt.ome.tif"])
def test_a_channel_of_two(file, channel):
    path = CASES / "tiff" / file
    volume = read_volume(path, choice=Choice(channel=channel))
    np.testing.assert_array_equal(volume.voxels, whole(path)[:, int(channel or 0)])
    assert [(c.kind, c.dimensions, c.is_read) for c in volume.file.contents] == [
        ("channel", (28, 20, 12), channel != "1"),
        ("channel", (28, 20, 12), channel == "1"),
    ]
    assert "Of 2 channels" in described(volume)


def test_arrays_of_four_axes_are_several_volumes():
    path = CASES / "tiff" / "numpy_4d.tif"
    for number in range(2):
        volume = read_volume(path, choice=Choice(series=str(number)))
        np.testing.assert_array_equal(volume.voxels, whole(path)[number])
    with pytest.raises(VolumeError, match=r"no series '2'; there are 0, 1\."):
        read_volume(path, choice=Choice(series="2"))


def test_signs_and_white_are_said():
    signed = CASES / "tiff" / "signed16.tif"
    expected = whole(signed).astype(int) - 32768
    np.testing.assert_array_equal(read_volume(signed).voxels, expected)
    assert "0 is white" in described(read_volume(CASES / "tiff" / "miniswhite.tif"))
    lut = CASES / "tiff" / "lut_green.tif"
    np.testing.assert_array_equal(read_volume(lut).voxels, whole(lut))
    assert "look-up table" in described(read_volume(lut))


@pytest.mark.parametrize("kind", ["contiguous", "zlib", "tiled", "bigtiff", "big endian"])
@pytest.mark.parametrize(
    "dtype", ["uint8", "int16", "float16", "float32", "float64", "int64", "uint64", "bool"]
)
def test_types_and_storage(tmp_path, dtype, kind):
    shape = (6, 32, 48)
    small = np.abs(np.random.default_rng(3).normal(0, 9, shape))
    array = voxels(dtype, shape) if dtype not in ("bool", "float16") else small.astype(dtype)
    if dtype == "bool":
        array = small > 9
    options = {
        "contiguous": {},
        "zlib": {"compression": "zlib", "predictor": dtype in ("uint8", "int16")},
        "tiled": {"tile": (16, 16)},
        "bigtiff": {"bigtiff": True},
        "big endian": {"byteorder": ">"},
    }[kind]
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, array, photometric="minisblack", **options)
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, array)
    assert volume.voxels.dtype.isnative


@pytest.mark.parametrize("time", [0, 2])
@pytest.mark.parametrize("channel", [0, 1])
def test_times_and_channels_by_imagej(tmp_path, time, channel):
    array = voxels("uint16", (3, 4, 2, 5, 7))
    path = imagej(tmp_path / "a.tif", array, "TZCYX", spacing=3, unit="mm")
    volume = read_volume(path, choice=Choice(time=str(time), channel=str(channel)))
    np.testing.assert_array_equal(volume.voxels, array[time, :, channel])
    assert (volume.spacing, volume.file.spacing_unit) == ((0.5, 0.5, 3.0), "mm")
    kinds = [content.kind for content in volume.file.contents]
    assert kinds == ["time"] * 3 + ["channel"] * 2


def test_slices_that_are_called_time_steps(tmp_path):
    array = voxels("uint8", (6, 5, 7))
    volume = read_volume(imagej(tmp_path / "a.tif", array, "TYX"))
    np.testing.assert_array_equal(volume.voxels, array)
    assert "calls its images time steps" in described(volume)


def test_units_that_differ_are_converted(tmp_path):
    # By the OME header, which has a unit for each axis.
    ome = tmp_path / "b.ome.tif"
    sizes = {"PhysicalSizeX": 500, "PhysicalSizeXUnit": "nm", "PhysicalSizeY": 0.5}
    sizes |= {"PhysicalSizeYUnit": "µm", "PhysicalSizeZ": 0.002, "PhysicalSizeZUnit": "mm"}
    tifffile.imwrite(ome, voxels("uint8"), metadata={"axes": "ZYX", **sizes})
    volume = read_volume(ome)
    assert volume.spacing == pytest.approx((500, 500, 2000))
    assert volume.file.spacing_unit == "nm"


@pytest.mark.parametrize("function", [0, 3])
def test_a_calibration_line_and_a_curve(tmp_path, function):
    array = voxels("uint8")
    info = f"ImageJ=1.54\nimages=6\nslices=6\ncf={function}\nc0=-10.0\nc1=0.5\nvunit=K\n"
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, array, photometric="minisblack", description=info, metadata=None)
    volume = read_volume(path)
    if function == 0:
        np.testing.assert_allclose(volume.voxels, array * 0.5 - 10)
        assert volume.units == "K"
    else:
        np.testing.assert_array_equal(volume.voxels, array)
        assert "calibration curve" in described(volume)


def test_ome_images_are_series_and_thumbnails_are_left_out(tmp_path):
    path = tmp_path / "a.ome.tif"
    small, large = voxels("uint8", (4, 5, 7)), voxels("uint8", (6, 10, 14))
    with tifffile.TiffWriter(path, ome=True) as writer:
        writer.write(small, metadata={"axes": "ZYX", "Name": "overview", "PhysicalSizeX": 9.0})
        writer.write(large, metadata={"axes": "ZYX", "Name": "detail", "PhysicalSizeX": 3.0})
        writer.write(large[0], metadata={"axes": "YX", "Name": "label"})
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, large)
    assert volume.spacing[0] == 3.0
    assert "Flat images were left out: 1" in described(volume)
    other = read_volume(path, choice=Choice(series="overview"))
    np.testing.assert_array_equal(other.voxels, small)
    assert other.spacing[0] == 9.0


def test_pages_written_one_by_one_are_a_stack_beside_a_thumbnail(tmp_path):
    path, array = tmp_path / "a.tif", voxels("uint8", (6, 5, 7))
    with tifffile.TiffWriter(path) as writer:
        for page in array:
            writer.write(page, photometric="minisblack", contiguous=False)
        writer.write(array[0, :3, :4], photometric="minisblack")
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, array)
    assert "Flat images were left out: 1" in described(volume)


def test_colours_are_components(tmp_path):
    array = voxels("uint8", (4, 5, 7, 3))
    for config in ("contig", "separate"):
        stored = array if config == "contig" else np.moveaxis(array, -1, 1)
        path = tmp_path / f"{config}.tif"
        tifffile.imwrite(path, stored, photometric="rgb", planarconfig=config)
        np.testing.assert_array_equal(read_volume(path, component=1).voxels, array[..., 1])


def test_a_declared_value_of_no_data_is_missing(tmp_path):
    array = voxels("float32")
    array[2, 3, 4] = -9999
    path = tmp_path / "a.tif"
    nodata = (42113, 2, 0, "-9999", True)
    tifffile.imwrite(path, array, extratags=[nodata], photometric="minisblack")
    volume = read_volume(path)
    assert "1 voxels are missing by what the file says" in described(volume)
    assert volume.data_range[0] > -9999


@pytest.mark.parametrize("file", ["gap", "two_channels"])
def test_folders_of_slices(file):
    folder = CASES / "folder" / file
    volume = read_volume(folder)
    if file == "gap":
        assert "Slices are missing: 7 and 8" in described(volume)
        assert volume.dimensions == (28, 20, 10)
        return
    for number in range(2):
        files = sorted(folder.glob(f"fused_ch0{number}_*"))
        volume = read_volume(folder, choice=Choice(series=str(number)))
        np.testing.assert_array_equal(volume.voxels, np.stack([whole(path) for path in files]))
    assert [content.name for content in volume.file.contents] == [
        "fused_ch00_z*.tif",
        "fused_ch01_z*.tif",
    ]


@pytest.mark.parametrize(
    ("names", "order"),
    [
        (["z-10", "z-5", "z0", "z5"], ["z-10", "z-5", "z0", "z5"]),
        (["s-10", "s-9", "s-8"], ["s-8", "s-9", "s-10"]),
        (["b10_123", "b9_456", "b1_789"], ["b1_789", "b9_456", "b10_123"]),
        (["top", "middle", "bottom"], ["bottom", "middle", "top"]),
        (["2024-01-02_7", "2024-01-02_12"], ["2024-01-02_7", "2024-01-02_12"]),
    ],
)
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
    np.testing.assert_array_equal(volume.voxels, stacks["t2.tif"])
    assert len(volume.file.contents) == 3


def test_one_slice_offers_its_folder():
    with pytest.raises(VolumeError, match=r"one of the 10 slices in its folder, open the folder"):
        read_volume(CASES / "folder" / "gap" / "s0001.tif")


def test_pages_outside_the_folder_are_not_read(tmp_path):
    (tmp_path / "sub").mkdir()
    outside = tmp_path / "secret.ome.tif"
    tifffile.imwrite(outside, voxels("uint8"), metadata={"axes": "ZYX"})
    uuid = ome_text(outside).split('UUID="')[1].split('"')[0]
    inside = tmp_path / "sub" / "a.ome.tif"
    tifffile.imwrite(inside, voxels("uint8"), metadata={"axes": "ZYX"})
    text = ome_text(inside)
    own = text.split('UUID="')[1].split('"')[0]
    planes = f'<TiffData IFD="0" PlaneCount="6"><UUID FileName="../secret.ome.tif">{uuid}</UUID>'
    changed = text.replace("</Pixels>", f"{planes}</TiffData></Pixels>")
    start, _, rest = changed.partition("<TiffData")
    tail = "<TiffData" + rest[rest.index("<TiffData") + 9 :]
    tifffile.imwrite(
        inside, voxels("uint8"), description=(start + tail).encode(), metadata=None, ome=False
    )
    assert own != uuid
    with pytest.raises(VolumeError, match="lie outside its folder"):
        read_volume(inside)
