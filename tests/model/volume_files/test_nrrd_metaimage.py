"""NRRD and MetaImage, by hand: what their heads may say, against SimpleITK and the definitions."""

import bz2
import gzip
import zlib
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from volume_writers import SPACING, check, refused, voxels, write_metaimage, write_nrrd

from model.volume_files import Choice, describe, read_volume

ARRAY = voxels()
LAST = len(ARRAY) - 1


def nrrd(path, *fields, array=ARRAY, **kwargs):
    return read_volume(write_nrrd(path / "a.nrrd", array, *fields, **kwargs))


# --- NRRD ---------------------------------------------------------------------------------

ENCODINGS = {
    "raw": bytes,
    "gzip": gzip.compress,
    "gz": lambda data: gzip.compress(data[:99]) + gzip.compress(data[99:]),
    "bzip2": bz2.compress,
    "bz2": lambda data: bz2.compress(data[:99]) + bz2.compress(data[99:]),
}


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("endian", ["big", "little"])
def test_nrrd_byte_orders_and_encodings(tmp_path, endian, encoding):
    data = ENCODINGS[encoding](ARRAY.astype(f"{'>' if endian == 'big' else '<'}u2").tobytes())
    fields = [f"endian: {endian}", f"encoding: {encoding}", "spacings: 0.5 2 3"]
    path = write_nrrd(tmp_path / "a.nrrd", ARRAY, *fields, data=data)
    check(read_volume(path), ARRAY, spacing=SPACING, origin=(0, 0, 0))


SKIPS = {
    "byte skip: 5": b"12345",
    "byteskip: -1": b"?" * 77,
    "line skip: 2": b"a\nbc\n",
    "# none": b"",
}


@pytest.mark.parametrize("skip", SKIPS)
def test_nrrd_skips_and_line_endings(tmp_path, skip):
    path = write_nrrd(tmp_path / "a.nrrd", ARRAY, skip, data=SKIPS[skip] + ARRAY.tobytes())
    if not SKIPS[skip]:
        header, _, payload = path.read_bytes().partition(b"\n\n")
        path.write_bytes(header.replace(b"\n", b"\r\n") + b"\r\n\r\n" + payload)
    check(read_volume(path), ARRAY)


nz, ny, nx = ARRAY.shape
ENDS = f"axis maxs: {0.5 * (nx - 1)} {2 * (ny - 1)} {3 * nz}"
RIGHT = "space directions: (1,0,0) (0,1,0) (0,0,1)"
LEFT, SHEARED = RIGHT.replace("0,0,1", "0,0,2"), RIGHT.replace("0,1,0", "0.5,1,0")
BROKEN = RIGHT.replace("1,0,0", "0,0,0")
# A left-handed grid is read from the other end, so that it is not mirrored.
REVERSED, FAR = np.s_[::-1], {"spacing": (1, 1, 2), "origin": (0, 0, 2 * LAST)}
NEGATIVE = {"spacing": SPACING, "origin": (7, -20, 30), "spacing_unit": "mm"}


def labels(letters, up=""):
    return {"axis_labels": tuple(letters), "up": up}


HEADS = {
    # Fields, what notes say, and what is found, where.
    "silent": ([], "gives no voxel spacing; 1 is assumed.", labels("")),
    "units": (["spacings: 1 1 1", 'sample units: "K"'], None, {"units": "K"}),
    "ends": (["axis mins: 0 0 0", ENDS, "centers: node node cell"],
             "least and greatest values", {"spacing": SPACING}),
    "unlike units": (["spacings: 500 0.8 2", 'units: "um" "mm" "mm"'],
                     "", {"spacing": (500, 800, 2000), "spacing_unit": "um"}),
    "units of a space": (["space: LPS", RIGHT, 'space units: "um" "um" "um"'],
                         "", {"spacing_unit": "um", "space": "LPS"}),
    "sheared": (["space dimension: 3", SHEARED], "not at right angles", {}),
    "a line": (["spacings: 1e-14 1 1"], "1e-14 x 1 x 1 is unusable", {"spacing": (1, 1, 1)}),
    "LAS": (["space: LAS", LEFT], "left-handed", FAR, REVERSED),
    "left": (["space: 3D-left-handed", LEFT], "left-handed", FAR, REVERSED),
    "broken": (["space: LPS", BROKEN], "", {"up": ""}),
    "negative": (["spacings: -0.5 2 3", "axis mins: 10 -20 30", 'units: "mm" "mm" "mm"'],
                 "", NEGATIVE, np.s_[:, :, ::-1]),
    "LPS": (["space: left-posterior-superior", RIGHT], "", labels("LRPASI", "+z")),
    "RAS": (["space: RAS", RIGHT], "", labels("RLAPSI", "+z")),
    "las": (["space: left-anterior-superior", RIGHT], "", labels("LRAPIS", "-z"), REVERSED),
    "no patient": (["space: 3D-right-handed", RIGHT], "", labels("")),
    "scanner": (["space: scanner-xyz", RIGHT], "", labels("")),
    "mha RAI": (["AnatomicalOrientation = RAI"], "", labels("LRPASI", "+z")),
    "mha ASL": (["AnatomicalOrientation = ASL"], "", {"axis_labels": tuple("PAISRL")}),
    "mha ???": (["AnatomicalOrientation = ???", "TransformMatrix = 1 0 0 0 1 0 0 0 1"],
                "", labels("")),
    "mha": ([], "", labels("")),
}  # fmt: skip


@pytest.mark.parametrize("name", HEADS)
def test_what_heads_say(tmp_path, name):
    fields, said, facts, *seen = HEADS[name]
    if name.startswith("mha"):
        volume = read_volume(write_metaimage(tmp_path / "a.mha", ARRAY, *fields))
    else:
        volume = nrrd(tmp_path, *fields)
    check(volume, ARRAY[seen[0]] if seen else ARRAY, said, **facts)
    row = ("axes point to", "L, P, S of the patient")
    assert (row in describe(volume)) == (volume.axis_labels == tuple("LRPASI"))


@pytest.mark.parametrize(("directions", "spacing", "said"), [
    ("(0.5,0,0) (0,2,0) (0,0,3)", SPACING, None),
    ("(-0.5,0,0) (0,-2,0) (0,0,3)", SPACING, "turned"),
    ("(0,2,0) (3,0,0) (0,0,0.5)", (2, 3, 0.5), "left-handed|turned"),
    ("(-0.5,0,0) (0,2,0) (0,0,3)", SPACING, "left-handed|turned"),
    ("(0.3,0.4,0) (-1.6,1.2,0) (0,0,3)", SPACING, "oblique"),
    ("(0,0,0) (0,2,0) (0,0,nan)", (1, 2, 1), "x, z is unusable"),
])  # fmt: skip
def test_nrrd_directions_keep_the_index_frame(tmp_path, directions, spacing, said):
    fields = ["space: left-posterior-superior", "space origin: (10,-20,30)"]
    volume = nrrd(tmp_path, *fields, f"space directions: {directions}")
    mirrored = said is not None and "left-handed" in said
    origin = (10, -20, 30 + LAST * spacing[2] * mirrored)
    check(volume, ARRAY[::-1] if mirrored else ARRAY, said, spacing=spacing, origin=origin)
    assert len(volume.notes) == (0 if said is None else len(said.split("|")))


def test_nrrd_without_an_order_of_bytes_and_one_of_few_columns(tmp_path):
    few = voxels(shape=(6, 5, 3))
    check(nrrd(tmp_path, array=few), few, spacing=(1, 1, 1), origin=(0, 0, 0))
    path = write_nrrd(tmp_path / "a.nrrd", ARRAY, "spacings: 1 1 1")
    path.write_bytes(path.read_bytes().replace(b"endian: little\n", b""))
    check(read_volume(path), ARRAY, "little-endian is assumed")


TIMES = voxels("uint16", (4, 6, 5, 11))


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("time", [0, 2, 3])
@pytest.mark.parametrize("kind", ["kinds: domain domain domain time", "# none", "mha"])
def test_time_steps_are_no_components(tmp_path, kind, time, compressed):
    array = TIMES if kind.startswith("kinds") else np.concatenate([TIMES, TIMES + 1, TIMES + 2])
    data = zlib.compress(array.tobytes()) if compressed else array.tobytes()
    if kind == "mha":
        fields = [f"CompressedData = {compressed}"]
        path = write_metaimage(tmp_path / "a.mha", array, *fields, data=data)
    else:
        encoding = f"encoding: {'gzip' if compressed else 'raw'}"
        path = write_nrrd(tmp_path / "a.nrrd", array, encoding, kind, data=data)
    volume = read_volume(path, choice=Choice(time=str(time)))
    check(volume, array[time])
    assert [content.kind for content in volume.file.contents] == ["time"] * len(array)


def test_time_as_the_first_axis_of_a_nrrd(tmp_path):
    array = np.moveaxis(TIMES, 0, -1)
    path = write_nrrd(tmp_path / "a.nrrd", array, "kinds: time domain domain domain")
    check(read_volume(path, choice=Choice(time="2")), TIMES[2])


SCALED = "(1,0,0{}) (0,1,0{}) (0,0,1{})"


@pytest.mark.parametrize(("space", "directions"), [
    ("left-posterior-superior-time", SCALED.format(",0", ",0", ",0") + " (0,0,0,1)"),
    ("LPST", SCALED.format(",0", ",0", ",0") + " (0,0,0,1)"),
    ("left-posterior-superior", SCALED.format("", "", "") + " (nan,nan,nan)"),
    ("left-posterior-superior", SCALED.format("", "", "") + " none"),
])  # fmt: skip
def test_a_space_with_time_and_rows_of_nan(tmp_path, space, directions):
    fields = [f"space: {space}", f"space directions: {directions}"]
    path = write_nrrd(tmp_path / "a.nrrd", TIMES, *fields)
    volume = read_volume(path, choice=Choice(time="2"))
    check(volume, TIMES[2], axis_labels=tuple("LRPASI"), spacing=(1, 1, 1))


# --- MetaImage ----------------------------------------------------------------------------


@pytest.mark.parametrize("key", ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])
@pytest.mark.parametrize("compressed", [False, True])
def test_big_endian_metaimage(tmp_path, key, compressed):
    data = ARRAY.astype(">u2").tobytes()
    fields = ["BinaryData = True", f"{key} = True", f"CompressedData = {compressed}"]
    fields += ["ElementSize = 0.5 2 3", "Offset = 10 -20 30"]
    data = zlib.compress(data) if compressed else data
    path = write_metaimage(tmp_path / "a.mha", ARRAY, *fields, data=data)
    check(read_volume(path), ARRAY, spacing=SPACING, origin=(10, -20, 30))


@pytest.mark.parametrize("skip", [-1, 40])
def test_metaimage_header_size(tmp_path, skip):
    (tmp_path / "a.bin").write_bytes(b"?" * 40 + ARRAY.tobytes())
    path = tmp_path / "a.mhd"
    write_metaimage(path, ARRAY, f"HeaderSize = {skip}", data=b"", file="a.bin")
    check(read_volume(path), ARRAY)


@pytest.mark.parametrize(
    "lines", [["# a comment"], [f"Field{k} = {'x' * 60}" for k in range(1200)]]
)
def test_comments_and_long_heads_of_a_metaimage(tmp_path, lines):
    path = write_metaimage(tmp_path / "a.mha", ARRAY, *lines, "ElementSpacing = 0.5 2 3")
    check(read_volume(path), ARRAY, spacing=SPACING)


def test_empty_lines_of_a_metaimage():
    path = Path(__file__).parent / "cases" / "metaimage" / "empty_lines.mha"
    image = sitk.ReadImage(str(path))
    place = {"spacing": image.GetSpacing(), "origin": image.GetOrigin()}
    check(read_volume(path), sitk.GetArrayFromImage(image), **place)


def test_negative_spacing_of_a_metaimage_is_as_in_itk(tmp_path):
    fields = ["ElementSpacing = 0.5 2 -3", "Offset = 10 -20 30", "DistanceUnits = um"]
    path = write_metaimage(tmp_path / "a.mha", ARRAY, *fields)
    image = sitk.ReadImage(str(path))
    last = image.TransformIndexToPhysicalPoint((0, 0, LAST))
    expected = sitk.GetArrayFromImage(image)[::-1]
    check(read_volume(path), expected, "mirrors", origin=last, spacing_unit="um")


def test_a_sheared_metaimage(tmp_path):
    fields = ["ElementSpacing = 1 1 2", "TransformMatrix = 1 0 0 0 1 0 0 .6 .8"]
    volume = read_volume(write_metaimage(tmp_path / "shear.mha", ARRAY, *fields))
    assert "sheared back" in " ".join(volume.notes) and volume.missing is not None
    assert volume.spacing == pytest.approx((1, 1, 1.6))


def write_header(folder, kind, name):
    path, fields = folder / f"a.{kind}", [f"data file: {name}"]
    if kind == "nhdr":
        return write_nrrd(path, ARRAY, *fields, data=b"")
    return write_metaimage(path, ARRAY, data=b"", file=name)


@pytest.mark.parametrize(
    "name", ["../secret.raw", "{tmp}/secret.raw", "sub/../../secret.raw", "link"]
)
@pytest.mark.parametrize("kind", ["nhdr", "mhd"])
def test_no_header_leads_out_of_its_folder(tmp_path, kind, name):
    folder = tmp_path / "data"
    (folder / "sub").mkdir(parents=True)
    for path in (tmp_path / "secret.raw", folder / "sub" / "inside.raw"):
        path.write_bytes(ARRAY.tobytes())
    (folder / "link").symlink_to(tmp_path / "secret.raw")
    path = write_header(folder, kind, name.format(tmp=tmp_path))
    refused(path, "outside the header's folder")
    check(read_volume(write_header(folder, kind, "sub/inside.raw")), ARRAY)
